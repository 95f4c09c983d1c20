#include "engine/picture/ome_tiff.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <memory>
#include <tiffio.h>
#include <vector>
#include <zlib.h>

#include "engine/base/check.hpp"
#include "engine/picture/optics.hpp"
#include "engine/picture/paths.hpp"
#include "engine/picture/top_view.hpp"

namespace colony {
namespace {

enum class Channel { kBrightfield, kPhase, kNuclei, kLabels };

constexpr double kFull = 65535.0;
constexpr int kCompressionLevel = 6;
constexpr double kUmPerCm = 1e4;
constexpr std::int64_t kChunkPixels = 4'000'000;

const char* name_of(Channel channel) {
  switch (channel) {
    case Channel::kBrightfield:
      return "brightfield";
    case Channel::kPhase:
      return "phase";
    case Channel::kNuclei:
      return "nuclei";
    case Channel::kLabels:
      return "labels";
  }
  CHECK(false);
  return "";
}

std::string text_of(double value) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, value);
  return std::string(digits, end.ptr);
}

std::string ome_xml(const Frame& frame, const std::vector<Channel>& channels, int sample_bits) {
  const std::string schema = "http://www.openmicroscopy.org/Schemas/OME/2016-06";
  const std::string size_um = text_of(frame.um_per_px);
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OME xmlns=\"" + schema +
      "\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:schemaLocation=\"" + schema + " " + schema +
      "/ome.xsd\" Creator=\"colony\">\n <Image ID=\"Image:0\" Name=\"colony\">\n  <Pixels ID=\"Pixels:0\" "
      "DimensionOrder=\"XYCZT\" Type=\"uint" +
      std::to_string(sample_bits) + "\" BigEndian=\"false\" SizeX=\"" + std::to_string(frame.width_px) + "\" SizeY=\"" +
      std::to_string(frame.height_px) + "\" SizeC=\"" + std::to_string(channels.size()) +
      "\" SizeZ=\"1\" SizeT=\"1\" PhysicalSizeX=\"" + size_um + "\" PhysicalSizeXUnit=\"&#181;m\" PhysicalSizeY=\"" +
      size_um + "\" PhysicalSizeYUnit=\"&#181;m\">\n";
  for (std::size_t i = 0; i < channels.size(); ++i) {
    xml += "   <Channel ID=\"Channel:0:" + std::to_string(i) + "\" Name=\"" + name_of(channels[i]) +
           "\" SamplesPerPixel=\"1\"/>\n";
  }
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const std::string number = std::to_string(i);
    xml +=
        "   <TiffData IFD=\"" + number + "\" FirstC=\"" + number + "\" FirstZ=\"0\" FirstT=\"0\" PlaneCount=\"1\"/>\n";
  }
  return xml + "  </Pixels>\n </Image>\n</OME>\n";
}

// ---- libtiff over a RandomAccessFile ----

struct Handle {
  RandomAccessFile& file;
  std::uint64_t position = 0;
};
Handle& handle_of(thandle_t user) { return *static_cast<Handle*>(user); }

tmsize_t read_at(thandle_t user, void* bytes, tmsize_t size) {
  Handle& handle = handle_of(user);
  const std::uint64_t end = handle.file.size();
  const std::uint64_t left = handle.position < end ? end - handle.position : 0;
  const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(static_cast<std::uint64_t>(size), left));
  if (!handle.file.read(handle.position, std::span(static_cast<char*>(bytes), count))) return -1;
  handle.position += count;
  return static_cast<tmsize_t>(count);
}
tmsize_t write_at(thandle_t user, void* bytes, tmsize_t size) {
  Handle& handle = handle_of(user);
  const auto count = static_cast<std::size_t>(size);
  if (!handle.file.write(handle.position, std::string_view(static_cast<const char*>(bytes), count))) return -1;
  handle.position += count;
  return size;
}
toff_t seek_to(thandle_t user, toff_t offset, int whence) {
  Handle& handle = handle_of(user);
  if (whence == SEEK_SET) handle.position = offset;
  if (whence == SEEK_CUR) handle.position += offset;
  if (whence == SEEK_END) handle.position = handle.file.size() + offset;
  return handle.position;
}
int close_nothing(thandle_t) { return 0; }
toff_t size_of(thandle_t user) { return handle_of(user).file.size(); }
int keep_quiet(TIFF*, void*, const char*, const char*, va_list) { return 1; }  // a refusal is returned, not printed

// Not TIFFClose: that would write, also where writing has failed or was stopped.
struct Abandon {
  void operator()(TIFF* tiff) const { TIFFCleanup(tiff); }
};
using Tiff = std::unique_ptr<TIFF, Abandon>;

Tiff open_tiff(Handle& handle, bool big) {
  const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                             TIFFOpenOptionsFree);
  CHECK(options != nullptr);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_quiet, nullptr);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), keep_quiet, nullptr);
  return Tiff(TIFFClientOpenExt("colony", big ? "wl8" : "wl", &handle, read_at, write_at, seek_to, close_nothing,
                                size_of, nullptr, nullptr, options.get()));
}

bool set_tags(TIFF* tiff, const Frame& frame, int sample_bits, const std::string& description) {
  const auto per_cm = static_cast<float>(kUmPerCm / frame.um_per_px);
  return TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(frame.width_px)) == 1 &&
         TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(frame.height_px)) == 1 &&
         TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, sample_bits) == 1 &&
         TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1) == 1 &&
         TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT) == 1 &&
         TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == 1 &&
         TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == 1 &&
         TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE) == 1 &&
         TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(kTiffStripRows_px)) == 1 &&
         TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, RESUNIT_CENTIMETER) == 1 &&
         TIFFSetField(tiff, TIFFTAG_XRESOLUTION, static_cast<double>(per_cm)) == 1 &&
         TIFFSetField(tiff, TIFFTAG_YRESOLUTION, static_cast<double>(per_cm)) == 1 &&
         TIFFSetField(tiff, TIFFTAG_SOFTWARE, "colony") == 1 &&
         (description.empty() || TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str()) == 1);
}

// ---- samples ----

/// One value a pixel of the rows.
std::vector<std::uint32_t> samples_of(const Colony& colony, ContactRule rule, const Frame& frame, Channel channel,
                                      RowRange rows, const Effort& effort) {
  if (channel == Channel::kLabels) return top_view(colony, frame, rows, effort).owner;
  const PathView view = path_lengths(colony, rule, frame, rows, effort);
  const std::vector<float> intensity =
      channel == Channel::kPhase ? phase_contrast(colony, rule, view, effort) : std::vector<float>();
  std::vector<std::uint32_t> samples(view.cell_um.size());
  for_each_piece(static_cast<std::size_t>(rows.end - rows.first), effort, [&](std::size_t row) {
    const std::size_t begin = row * static_cast<std::size_t>(frame.width_px);
    for (std::size_t at = begin; at < begin + static_cast<std::size_t>(frame.width_px); ++at) {
      double share = view.nucleus_um[at] > 0.0F ? 1.0 : 0.0;
      if (channel == Channel::kPhase) share = static_cast<double>(intensity[at]);
      if (channel == Channel::kBrightfield) {
        share = transmission(kGreen, static_cast<double>(view.cell_um[at]), static_cast<double>(view.nucleus_um[at]));
      }
      samples[at] = static_cast<std::uint32_t>(kFull * share + 0.5);
    }
  });
  return samples;
}

/// A strip as it stands in the file.
std::string packed(std::span<const std::uint32_t> samples, int sample_bits) {
  const auto width = static_cast<std::size_t>(sample_bits / 8);
  std::string plain(samples.size() * width, '\0');
  for (std::size_t i = 0; i < samples.size(); ++i)
    std::memcpy(plain.data() + i * width, &samples[i], width);  // little endian (digest.hpp)
  uLongf size = compressBound(plain.size());
  std::string bytes(size, '\0');
  CHECK(compress2(reinterpret_cast<Bytef*>(bytes.data()), &size, reinterpret_cast<const Bytef*>(plain.data()),
                  plain.size(), kCompressionLevel) == Z_OK);
  bytes.resize(size);
  return bytes;
}

bool write_plane(TIFF* tiff, const Colony& colony, ContactRule rule, const Frame& frame, Channel channel,
                 int sample_bits, const Effort& effort) {
  const std::int64_t chunk_rows =
      std::clamp<std::int64_t>(kChunkPixels / frame.width_px / kTiffStripRows_px, 1, 8) * kTiffStripRows_px;
  for (std::int64_t first = 0; first < frame.height_px; first += chunk_rows) {
    const RowRange rows{first, std::min(first + chunk_rows, frame.height_px)};
    const std::vector<std::uint32_t> samples = samples_of(colony, rule, frame, channel, rows, effort);
    std::vector<std::string> strips(
        static_cast<std::size_t>((rows.end - rows.first + kTiffStripRows_px - 1) / kTiffStripRows_px));
    for_each_piece(strips.size(), effort, [&](std::size_t index) {
      const std::size_t length = static_cast<std::size_t>(kTiffStripRows_px * frame.width_px);
      const std::size_t begin = index * length;
      strips[index] = packed(std::span(samples).subspan(begin, std::min(length, samples.size() - begin)), sample_bits);
    });
    for (std::size_t i = 0; i < strips.size(); ++i) {
      const auto number = static_cast<std::uint32_t>(static_cast<std::size_t>(first / kTiffStripRows_px) + i);
      const auto size = static_cast<tmsize_t>(strips[i].size());
      if (TIFFWriteRawStrip(tiff, number, strips[i].data(), size) != size) return false;
    }
  }
  return true;
}

}  // namespace

bool MemoryFile::write(std::uint64_t offset, std::string_view bytes) {
  if (bytes_.size() < offset + bytes.size()) bytes_.resize(offset + bytes.size());
  std::copy(bytes.begin(), bytes.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(offset));
  return true;
}

bool MemoryFile::read(std::uint64_t offset, std::span<char> bytes) {
  if (offset > bytes_.size() || bytes.size() > bytes_.size() - offset) return false;
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), bytes.size(), bytes.begin());
  return true;
}

Status write_ome_tiff(const Colony& colony, const Params& params, const PictureSpec& spec, const OmeChannels& chosen,
                      const Effort& effort, RandomAccessFile& file) {
  const Result<Frame> framed = frame_of(colony, spec);
  if (!framed) return framed.error();
  const Frame& frame = *framed;
  std::vector<Channel> channels;
  if (chosen.brightfield) channels.push_back(Channel::kBrightfield);
  if (chosen.phase) channels.push_back(Channel::kPhase);
  if (chosen.nuclei) channels.push_back(Channel::kNuclei);
  if (chosen.labels) channels.push_back(Channel::kLabels);
  if (channels.empty()) {
    return Error{ErrorCode::kInvalid,
                 "the picture cannot be written",
                 {FieldError{"channels", "must name at least one channel"}}};
  }
  const int sample_bits = chosen.labels && colony.cells().size() > 65535 ? 32 : 16;
  const std::uint64_t bytes = static_cast<std::uint64_t>(frame.width_px) * static_cast<std::uint64_t>(frame.height_px) *
                              static_cast<std::uint64_t>(sample_bits / 8) * channels.size();
  const Error refused{ErrorCode::kStorage, "the file could not be written", {}};
  Handle handle{file};
  const Tiff tiff = open_tiff(handle, chosen.big || bytes > kClassicBytesMax);
  if (!tiff) return refused;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (!set_tags(tiff.get(), frame, sample_bits, i == 0 ? ome_xml(frame, channels, sample_bits) : std::string()) ||
        !write_plane(tiff.get(), colony, params.contact.rule, frame, channels[i], sample_bits, effort) ||
        TIFFWriteDirectory(tiff.get()) != 1) {
      return refused;
    }
  }
  return Ok{};
}

}  // namespace colony
