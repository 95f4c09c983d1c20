// ome_tiff: a colony as a microscope's file: OME-TIFF with the physical size of a pixel and a plane for each channel.
// Format:  classic little-endian TIFF, BigTIFF where the samples come to more than kClassicBytesMax; one directory a
//          channel, strips of kTiffStripRows_px rows, each a zlib stream (Compression 8), no predictor; XResolution in
//          pixels per cm; OME-XML 2016-06 in the first directory's ImageDescription, ASCII only. All planes have one
//          type, as OME has it: uint16, or uint32 where a label would not fit. brightfield: 65535 times the green
//          transmission. phase: 65535 times the intensity (optics.hpp). nuclei: 65535 where a ray meets a nucleus, seen
//          or covered. labels: id of the visible cell, 0 for none.
// Method:  each channel is a pass over strips, so memory is a strip's whatever the picture: libtiff writes one directory
//          after another.
// Units:   um, pixels.
// Errors:  those of frame_of; kInvalid (channels) where none is asked for; kStorage where the file refuses. Throws Stopped.
// Threads: strips are computed and compressed side by side; the bytes are the same for one libtiff and zlib.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "engine/picture/render.hpp"

namespace colony {

inline constexpr std::int64_t kTiffStripRows_px = 64;
inline constexpr std::uint64_t kClassicBytesMax = 4'000'000'000;  // before compression, which can only come close to it

/// Bytes that can be read and written anywhere: TIFF links its directories backwards. False: refused.
class RandomAccessFile {
 public:
  virtual ~RandomAccessFile() = default;
  virtual bool write(std::uint64_t offset, std::string_view bytes) = 0;  // grows the file as needed
  virtual bool read(std::uint64_t offset, std::span<char> bytes) = 0;    // all of them, or false
  virtual std::uint64_t size() const = 0;
};

class MemoryFile : public RandomAccessFile {
 public:
  bool write(std::uint64_t offset, std::string_view bytes) override;
  bool read(std::uint64_t offset, std::span<char> bytes) override;
  std::uint64_t size() const override { return bytes_.size(); }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Written in this order.
struct OmeChannels {
  bool brightfield = true;
  bool phase = true;
  bool nuclei = true;
  bool labels = true;
  bool big = false;  // BigTIFF also where classic TIFF would do
};

/// Of `spec` only the scale counts.
Status write_ome_tiff(const Colony& colony, const Params& params, const PictureSpec& spec, const OmeChannels& channels,
                      const Effort& effort, RandomAccessFile& file);

}  // namespace colony
