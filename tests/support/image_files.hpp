// image_files: image files made in memory, as other programs would write them. For tests and the fuzzers' corpora.
// Shapes:  samples row-major, the channels of a pixel beside each other.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <tiffio.h>
#include <turbojpeg.h>
#include <vector>

#include <spng.h>

namespace colony::testing {

struct Picture16 {
  int width = 0;
  int height = 0;
  int channels = 1;
  std::vector<std::uint16_t> samples;
};

/// Different in every pixel and channel, within 0..value_max.
inline Picture16 gradient(int width, int height, int channels, std::uint32_t value_max) {
  Picture16 picture{width, height, channels, {}};
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(width * height * channels); ++i) {
    picture.samples.push_back(static_cast<std::uint16_t>((i * 2654435761U >> 8) % (value_max + 1)));
  }
  return picture;
}

inline std::vector<std::uint8_t> as_bytes(const std::vector<std::uint16_t>& samples, int bits) {
  std::vector<std::uint8_t> bytes(samples.size() * static_cast<std::size_t>(bits / 8));
  if (bits == 16) std::memcpy(bytes.data(), samples.data(), bytes.size());
  if (bits == 8)
    for (std::size_t i = 0; i < samples.size(); ++i) bytes[i] = static_cast<std::uint8_t>(samples[i]);
  return bytes;
}

struct PngSpec {
  std::uint8_t colour_type = SPNG_COLOR_TYPE_GRAYSCALE;
  std::uint8_t bits = 8;
  std::uint8_t interlace = 0;
  std::vector<spng_plte_entry> palette = {};
  std::uint32_t pixels_per_metre = 0;
};
/// `rows`: as a PNG holds them, but 16-bit samples in this machine's order.
inline std::string png_file(int width, int height, const PngSpec& spec, const std::vector<std::uint8_t>& rows) {
  spng_ctx* context = spng_ctx_new(SPNG_CTX_ENCODER);
  spng_set_option(context, SPNG_ENCODE_TO_BUFFER, 1);
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.bit_depth = spec.bits;
  header.color_type = spec.colour_type;
  header.interlace_method = spec.interlace;
  spng_set_ihdr(context, &header);
  if (!spec.palette.empty()) {
    spng_plte palette{};
    palette.n_entries = static_cast<std::uint32_t>(spec.palette.size());
    for (std::size_t i = 0; i < spec.palette.size(); ++i) palette.entries[i] = spec.palette[i];
    spng_set_plte(context, &palette);
  }
  if (spec.pixels_per_metre > 0) {
    spng_phys physical{spec.pixels_per_metre, spec.pixels_per_metre, 1};
    spng_set_phys(context, &physical);
  }
  std::string file;
  if (spng_encode_image(context, rows.data(), rows.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE) == 0) {
    std::size_t size = 0;
    int status = 0;
    void* bytes = spng_get_png_buffer(context, &size, &status);
    file.assign(static_cast<const char*>(bytes), size);
    std::free(bytes);
  }
  spng_ctx_free(context);
  return file;
}

struct TiffSpec {
  int bits = 8;
  std::uint16_t compression = COMPRESSION_NONE;
  std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
  bool planar = false;
  int tile = 0;  // side; 0: strips
  int rows_per_strip = 3;
  bool predictor = false;
  bool big_endian = false;
  bool big_tiff = false;
  int alpha = -1;  // EXTRASAMPLE_...; -1: the further channels are unspecified
  float per_centimetre = 0.0F;
  std::string description = {};
  bool centimetres = false;  // the resolution's unit also where there is a description
};

namespace tiff_memory {
struct File {
  std::string bytes;
  std::size_t position = 0;
};
inline tmsize_t read(thandle_t handle, void* to, tmsize_t size) {
  auto& file = *static_cast<File*>(handle);
  const std::size_t count =
      std::min(static_cast<std::size_t>(size), file.bytes.size() - std::min(file.bytes.size(), file.position));
  std::memcpy(to, file.bytes.data() + file.position, count);
  file.position += count;
  return static_cast<tmsize_t>(count);
}
inline tmsize_t write(thandle_t handle, void* from, tmsize_t size) {
  auto& file = *static_cast<File*>(handle);
  if (file.position + static_cast<std::size_t>(size) > file.bytes.size())
    file.bytes.resize(file.position + static_cast<std::size_t>(size));
  std::memcpy(file.bytes.data() + file.position, from, static_cast<std::size_t>(size));
  file.position += static_cast<std::size_t>(size);
  return size;
}
inline toff_t seek(thandle_t handle, toff_t offset, int whence) {
  auto& file = *static_cast<File*>(handle);
  file.position = static_cast<std::size_t>(offset) + (whence == SEEK_CUR   ? file.position
                                                      : whence == SEEK_END ? file.bytes.size()
                                                                           : 0);
  return file.position;
}
inline int close(thandle_t) { return 0; }
inline toff_t size(thandle_t handle) { return static_cast<File*>(handle)->bytes.size(); }
}  // namespace tiff_memory

/// Every picture one page.
inline std::string tiff_file(const std::vector<Picture16>& pages, const TiffSpec& spec) {
  tiff_memory::File file;
  const std::string mode = std::string("w") + (spec.big_endian ? "b" : "l") + (spec.big_tiff ? "8" : "4");
  TIFF* tiff = TIFFClientOpen("made", mode.c_str(), &file, tiff_memory::read, tiff_memory::write, tiff_memory::seek,
                              tiff_memory::close, tiff_memory::size, nullptr, nullptr);
  for (const Picture16& page : pages) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, page.width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, page.height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, spec.bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, page.channels);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, spec.compression);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, spec.photometric);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, spec.planar ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    const int extra = page.channels - (spec.photometric == PHOTOMETRIC_RGB ? 3 : 1);
    if (extra > 0) {
      const std::vector<std::uint16_t> kinds(static_cast<std::size_t>(extra),
                                             static_cast<std::uint16_t>(std::max(0, spec.alpha)));
      TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, extra, kinds.data());
    }
    if (spec.photometric == PHOTOMETRIC_PALETTE) {
      std::vector<std::uint16_t> red(256), green(256), blue(256);
      for (std::size_t i = 0; i < 256; ++i) {
        red[i] = static_cast<std::uint16_t>(i << 8);
        green[i] = static_cast<std::uint16_t>((255 - i) << 8);
        blue[i] = static_cast<std::uint16_t>(7 << 8);
      }
      TIFFSetField(tiff, TIFFTAG_COLORMAP, red.data(), green.data(), blue.data());
    }
    if (spec.predictor) TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
    if (spec.per_centimetre > 0.0F) {
      TIFFSetField(tiff, TIFFTAG_XRESOLUTION, spec.per_centimetre);
      TIFFSetField(tiff, TIFFTAG_YRESOLUTION, spec.per_centimetre);
      TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, spec.description.empty() || spec.centimetres ? RESUNIT_CENTIMETER : RESUNIT_NONE);
    }
    if (!spec.description.empty()) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, spec.description.c_str());
    const int planes = spec.planar ? page.channels : 1, block_channels = spec.planar ? 1 : page.channels;
    const int block_width = spec.tile > 0 ? spec.tile : page.width,
              block_height = spec.tile > 0 ? spec.tile : spec.rows_per_strip;
    if (spec.tile > 0) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, spec.tile);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, spec.tile);
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, spec.rows_per_strip);
    }
    std::uint32_t block = 0;
    for (int plane = 0; plane < planes; ++plane) {
      for (int top = 0; top < page.height; top += block_height) {
        for (int left = 0; left < page.width; left += block_width, ++block) {
          const int rows = spec.tile > 0 ? block_height : std::min(block_height, page.height - top);
          std::vector<std::uint16_t> samples(static_cast<std::size_t>(block_width * rows * block_channels), 0);
          for (int y = 0; y < rows && top + y < page.height; ++y) {
            for (int x = 0; x < block_width && left + x < page.width; ++x) {
              for (int c = 0; c < block_channels; ++c) {
                samples[static_cast<std::size_t>((y * block_width + x) * block_channels + c)] =
                    page.samples[static_cast<std::size_t>(((top + y) * page.width + left + x) * page.channels + plane +
                                                          c)];
              }
            }
          }
          std::vector<std::uint8_t> bytes = as_bytes(samples, spec.bits);
          const auto size = static_cast<tmsize_t>(bytes.size());
          spec.tile > 0 ? TIFFWriteEncodedTile(tiff, block, bytes.data(), size)
                        : TIFFWriteEncodedStrip(tiff, block, bytes.data(), size);
        }
      }
    }
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  return file.bytes;
}

/// `samples` of 8 bits, one channel or three.
inline std::string jpeg_file(const Picture16& picture, int quality, bool progressive = false) {
  const std::vector<std::uint8_t> bytes = as_bytes(picture.samples, 8);
  tjhandle handle = tjInitCompress();
  unsigned char* out = nullptr;
  unsigned long size = 0;
  const bool grey = picture.channels == 1;
  tjCompress2(handle, bytes.data(), picture.width, 0, picture.height, grey ? TJPF_GRAY : TJPF_RGB, &out, &size,
              grey ? TJSAMP_GRAY : TJSAMP_444, quality, progressive ? TJFLAG_PROGRESSIVE : 0);
  std::string file(reinterpret_cast<const char*>(out), size);
  tjFree(out);
  tjDestroy(handle);
  return file;
}

}  // namespace colony::testing
