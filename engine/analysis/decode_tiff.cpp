#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstring>
#include <iterator>
#include <memory>
#include <tiffio.h>

#include "engine/analysis/decode_parts.hpp"
#include "engine/analysis/ome_xml.hpp"
#include "engine/base/check.hpp"

namespace colony::decode_parts {
namespace {

// A side of a tile may be that of the image rounded up as tiles must be, or what programs take whatever the image is. Memory is asked for a whole tile.
constexpr std::uint32_t kTileSideStep_px = 16;
constexpr std::uint32_t kTileSideAlways_px = 1024;
constexpr tmsize_t kTableMax_bytes = 64 << 20;  // the largest single table or compressed block that libtiff may ask for
constexpr std::size_t kDescriptionMax_bytes = 4096;
constexpr double kUmPerCentimetre = 1e4;

struct Source {
  std::string_view bytes;
  std::uint64_t position = 0;
  bool failed = false;  // libtiff said so; in which words is for its own developers

  static Source& of(thandle_t handle) { return *static_cast<Source*>(handle); }
};

tmsize_t read_bytes(thandle_t handle, void* to, tmsize_t size) {
  Source& source = Source::of(handle);
  if (size <= 0 || source.position >= source.bytes.size()) return 0;
  const auto count = std::min<std::uint64_t>(static_cast<std::uint64_t>(size), source.bytes.size() - source.position);
  std::memcpy(to, source.bytes.data() + source.position, count);
  source.position += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t write_nothing(thandle_t, void*, tmsize_t) { return 0; }
int close_nothing(thandle_t) { return 0; }
toff_t size_of(thandle_t handle) { return Source::of(handle).bytes.size(); }

toff_t seek_to(thandle_t handle, toff_t offset, int whence) {
  Source& source = Source::of(handle);
  // Unsigned sums wrap: a negative step arrives as a large offset and does what it says.
  if (whence == SEEK_CUR) offset += source.position;
  if (whence == SEEK_END) offset += source.bytes.size();
  source.position = offset;
  return offset;
}

// Both return 1: the process-wide handlers, which print, are not called.
int keep_error(TIFF*, void* user_data, const char*, const char*, std::va_list) {
  static_cast<Source*>(user_data)->failed = true;
  return 1;
}
int drop_warning(TIFF*, void*, const char*, const char*, std::va_list) { return 1; }

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
struct FreeOptions {
  void operator()(TIFFOpenOptions* options) const { TIFFOpenOptionsFree(options); }
};

/// The tags of a page that say how its pixels lie.
struct Page {
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 1, channels = 1, planar = PLANARCONFIG_CONTIG, compression = COMPRESSION_NONE,
                photometric = PHOTOMETRIC_MINISBLACK;
  std::uint16_t format = SAMPLEFORMAT_UINT;
  std::uint16_t alpha = EXTRASAMPLE_UNSPECIFIED;  // of the last channel
  std::array<const std::uint16_t*, 3> palette{};

  /// The most bytes of samples that a byte of the file can become; 0: a compression that is not read.
  std::int64_t expansion_max() const {
    switch (compression) {
      case COMPRESSION_NONE:
        return 1;
      case COMPRESSION_PACKBITS:
        return 64;  // 128 bytes from 2
      case COMPRESSION_LZW:
        return 2731;  // 4,096 bytes from 12 bits
      case COMPRESSION_DEFLATE:
      case COMPRESSION_ADOBE_DEFLATE:
        return 1032;  // 258 bytes from 2 bits
      default:
        return 0;
    }
  }

  bool same_shape(const Page& other) const {
    return width == other.width && height == other.height && bits == other.bits && channels == other.channels &&
           photometric == other.photometric && format == other.format;
  }
};

class Reader {
 public:
  Reader(std::string_view bytes, const DecodeLimits& limits) : source_{bytes, 0, false}, limits_(limits) {}
  Result<DecodedImage> read();

 private:
  static Error failed(const std::string& what) { return malformed("damaged or cut-off TIFF: " + what); }
  Result<Page> page() const;
  Status check(const Page& page, std::int64_t channel_count) const;
  Status append(const Page& page, DecodedImage& image, std::int64_t first_channel);
  Status read_block(bool tiled, std::uint32_t block, std::int64_t bytes);
  void copy_block(const Page& page, DecodedImage& image, std::int64_t first_channel, std::int64_t left,
                  std::int64_t top, std::int64_t block_width, std::int64_t block_height,
                  std::int64_t block_channels) const;
  void read_scale(DecodedImage& image) const;
  static void finish_colours(const Page& page, std::int64_t page_count, DecodedImage& image);

  Source source_;
  const DecodeLimits& limits_;
  std::unique_ptr<TIFF, CloseTiff> tiff_;
  std::vector<std::uint8_t> block_;
};

Result<Page> Reader::page() const {
  Page page;
  if (TIFFGetField(tiff_.get(), TIFFTAG_IMAGEWIDTH, &page.width) == 0 ||
      TIFFGetField(tiff_.get(), TIFFTAG_IMAGELENGTH, &page.height) == 0) {
    return failed("no size is stated");
  }
  TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_BITSPERSAMPLE, &page.bits);
  TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_SAMPLESPERPIXEL, &page.channels);
  TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_PLANARCONFIG, &page.planar);
  TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_COMPRESSION, &page.compression);
  TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_SAMPLEFORMAT, &page.format);
  if (TIFFGetField(tiff_.get(), TIFFTAG_PHOTOMETRIC, &page.photometric) == 0 && page.channels == 3)
    page.photometric = PHOTOMETRIC_RGB;
  std::uint16_t extra_count = 0;
  const std::uint16_t* extra = nullptr;
  TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_EXTRASAMPLES, &extra_count, &extra);
  if (extra_count > 0 && extra != nullptr) page.alpha = extra[extra_count - 1];
  if (page.photometric == PHOTOMETRIC_PALETTE) {
    std::uint16_t *red = nullptr, *green = nullptr, *blue = nullptr;
    if (TIFFGetField(tiff_.get(), TIFFTAG_COLORMAP, &red, &green, &blue) == 0)
      return failed("a palette image without a palette");
    page.palette = {red, green, blue};
  }
  return page;
}

Status Reader::check(const Page& page, std::int64_t channel_count) const {
  if (page.bits != 8 && page.bits != 16) {
    return not_read("a TIFF of " + std::to_string(page.bits) + " bits a sample is not read: save it with 8 or 16");
  }
  if (page.format != SAMPLEFORMAT_UINT && page.format != SAMPLEFORMAT_VOID) {
    return not_read("a TIFF of signed or floating-point samples is not read: save it with 8 or 16 bits, unsigned");
  }
  const bool palette = page.photometric == PHOTOMETRIC_PALETTE;
  if (page.photometric != PHOTOMETRIC_MINISBLACK && page.photometric != PHOTOMETRIC_MINISWHITE &&
      page.photometric != PHOTOMETRIC_RGB && !(palette && page.bits == 8 && page.channels == 1)) {
    return not_read("a TIFF of photometric interpretation " + std::to_string(page.photometric) +
                    " is not read: save it in grey or RGB");
  }
  if (page.photometric == PHOTOMETRIC_RGB && page.channels < 3)
    return malformed("a TIFF in RGB states fewer than 3 channels");
  const std::int64_t expansion = page.expansion_max();
  if (expansion == 0) {
    return not_read("a TIFF with compression " + std::to_string(page.compression) +
                    " is not read: save it uncompressed or with LZW, deflate or PackBits");
  }
  // What lies in the file is one page; what it becomes in memory is checked with no such bound.
  if (Status status =
          check_claim({page.width, page.height, page.channels, page.bits, expansion}, source_.bytes.size(), limits_);
      !status) {
    return status;
  }
  return check_claim({page.width, page.height, palette ? 3 : channel_count, page.bits, 0}, source_.bytes.size(),
                     limits_);
}

Status Reader::read_block(bool tiled, std::uint32_t block, std::int64_t bytes) {
  const auto size = static_cast<tmsize_t>(bytes);
  const tmsize_t got = tiled ? TIFFReadEncodedTile(tiff_.get(), block, block_.data(), size)
                             : TIFFReadEncodedStrip(tiff_.get(), block, block_.data(), size);
  if (got != size) return failed(std::string(tiled ? "tile " : "strip ") + std::to_string(block) + " cannot be read");
  return Ok{};
}

void Reader::copy_block(const Page& page, DecodedImage& image, std::int64_t first_channel, std::int64_t left,
                        std::int64_t top, std::int64_t block_width, std::int64_t block_height,
                        std::int64_t block_channels) const {
  const std::int64_t columns = std::min<std::int64_t>(block_width, image.width_px - left);
  const std::int64_t rows = std::min<std::int64_t>(block_height, image.height_px - top);
  for (std::int64_t row = 0; row < rows; ++row) {
    const std::uint8_t* from = block_.data() + row * block_width * block_channels * page.bits / 8;
    std::uint16_t* to =
        image.samples.data() + ((top + row) * image.width_px + left) * image.channel_count + first_channel;
    for (std::int64_t column = 0; column < columns; ++column, to += image.channel_count) {
      for (std::int64_t channel = 0; channel < block_channels; ++channel) {
        if (page.bits == 8) {
          to[channel] = *from++;
        } else {
          std::memcpy(to + channel, from, 2);  // libtiff has put the bytes into this machine's order
          from += 2;
        }
      }
    }
  }
}

/// The current page's channels to first_channel and on.
Status Reader::append(const Page& page, DecodedImage& image, std::int64_t first_channel) {
  const bool tiled = TIFFIsTiled(tiff_.get()) != 0;
  std::uint32_t block_width = page.width, block_height = page.height;
  if (tiled) {
    TIFFGetField(tiff_.get(), TIFFTAG_TILEWIDTH, &block_width);
    TIFFGetField(tiff_.get(), TIFFTAG_TILELENGTH, &block_height);
  } else {
    TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_ROWSPERSTRIP, &block_height);
    block_height = std::min(block_height, page.height);
  }
  if (block_width < 1 || block_height < 1) return failed("strips or tiles of no size");
  const bool planar = page.planar == PLANARCONFIG_SEPARATE && page.channels > 1;
  const std::int64_t block_channels = planar ? 1 : page.channels;
  const std::int64_t pixel_bytes = block_channels * page.bits / 8;
  const auto fits = [](std::uint32_t side, std::uint32_t image_side) {
    return side <= std::max((image_side + kTileSideStep_px - 1) / kTileSideStep_px * kTileSideStep_px, kTileSideAlways_px);
  };
  if (!fits(block_width, page.width) || !fits(block_height, page.height)) {
    return Error{ErrorCode::kLimit, "the TIFF's tiles of " + std::to_string(block_width) + " x " + std::to_string(block_height) +
                                        " pixels are too large for an image of " + std::to_string(page.width) + " x " +
                                        std::to_string(page.height)};
  }
  // Both sides are at most 50,015, so the product fits.
  const std::int64_t full_bytes = std::int64_t{block_width} * block_height * pixel_bytes;
  if (full_bytes > static_cast<std::int64_t>(source_.bytes.size()) * page.expansion_max() + kClaimSlack_bytes) {
    return failed("it states strips or tiles of " + std::to_string(full_bytes) + " bytes, more than the file can hold");
  }
  if (tiled ? TIFFTileSize64(tiff_.get()) != static_cast<std::uint64_t>(full_bytes)
            : TIFFVStripSize64(tiff_.get(), block_height) != static_cast<std::uint64_t>(full_bytes)) {
    return failed("strips or tiles whose size is not that of their pixels");
  }
  block_.resize(static_cast<std::size_t>(full_bytes));
  std::uint32_t block = 0;
  for (std::int64_t plane = 0; plane < (planar ? page.channels : 1); ++plane) {
    for (std::int64_t top = 0; top < page.height; top += block_height) {
      for (std::int64_t left = 0; left < page.width; left += block_width, ++block) {
        const std::int64_t rows = tiled ? block_height : std::min<std::int64_t>(block_height, page.height - top);
        if (Status status = read_block(tiled, block, std::int64_t{block_width} * rows * pixel_bytes); !status)
          return status;
        copy_block(page, image, first_channel + plane, left, top, block_width, rows, block_channels);
      }
    }
  }
  return Ok{};
}

void Reader::read_scale(DecodedImage& image) const {
  const char* text = nullptr;
  TIFFGetField(tiff_.get(), TIFFTAG_IMAGEDESCRIPTION, &text);
  const std::string_view whole(text == nullptr ? "" : text, text == nullptr ? 0 : ::strnlen(text, kOmeTextMax_bytes + 1));
  if (is_ome_xml(whole)) {
    OmeScale ome = read_ome_scale(whole);
    image.um_per_px_ome = ome.um_per_px;
    std::move(ome.notes.begin(), ome.notes.end(), std::back_inserter(image.notes));
  }
  float x = 0.0F, y = 0.0F;
  if (TIFFGetField(tiff_.get(), TIFFTAG_XRESOLUTION, &x) == 0 ||
      TIFFGetField(tiff_.get(), TIFFTAG_YRESOLUTION, &y) == 0)
    return;
  if (!(x > 0.0F && x < 1e9F && x == y)) return;
  std::uint16_t unit = RESUNIT_INCH;
  TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_RESOLUTIONUNIT, &unit);
  const std::string_view description = whole.substr(0, kDescriptionMax_bytes);
  const bool micron = description.starts_with("ImageJ") && (description.find("unit=micron") != description.npos ||
                                                            description.find("unit=um") != description.npos ||
                                                            description.find("unit=\\u00B5m") != description.npos);
  if (micron) image.um_per_px_stated = 1.0 / double{x};
  // Inches say what a printer should do, not what a microscope saw.
  if (!micron && unit == RESUNIT_CENTIMETER) image.um_per_px_stated = kUmPerCentimetre / double{x};
}

/// `page`: the one just read, so that its palette is alive.
void Reader::finish_colours(const Page& page, std::int64_t page_count, DecodedImage& image) {
  if (page.photometric == PHOTOMETRIC_PALETTE) {
    const std::vector<std::uint16_t> indices = std::move(image.samples);
    image.channel_count = 3;
    image.samples.resize(indices.size() * 3);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        image.samples[3 * i + c] = static_cast<std::uint16_t>(page.palette[c][indices[i]] >> 8);
    }
    image.model = ColourModel::kRgb;
    return;
  }
  if (page.photometric == PHOTOMETRIC_MINISWHITE) {
    for (std::uint16_t& sample : image.samples) sample = static_cast<std::uint16_t>(image.value_max() - sample);
  }
  const std::int64_t colours = page.photometric == PHOTOMETRIC_RGB ? 3 : 1;
  const bool alpha = page.alpha == EXTRASAMPLE_ASSOCALPHA || page.alpha == EXTRASAMPLE_UNASSALPHA;
  if (alpha && page_count == 1 && page.channels == colours + 1)
    blend_alpha(image, page.alpha == EXTRASAMPLE_ASSOCALPHA);
  image.model = image.channel_count != colours ? ColourModel::kChannels
                : colours == 3                 ? ColourModel::kRgb
                                               : ColourModel::kGrey;
}

Result<DecodedImage> Reader::read() {
  const std::unique_ptr<TIFFOpenOptions, FreeOptions> options(TIFFOpenOptionsAlloc());
  if (options == nullptr) return Error{ErrorCode::kLimit, "not enough memory to read the image"};
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), kTableMax_bytes);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_error, &source_);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), drop_warning, nullptr);
  // "m": not through a memory map, so every access goes through read_bytes with its bounds.
  tiff_.reset(TIFFClientOpenExt("image", "rm", &source_, read_bytes, write_nothing, seek_to, close_nothing, size_of,
                                nullptr, nullptr, options.get()));
  if (tiff_ == nullptr) return failed("its directory cannot be read");

  // Pages are looked at twice: first how many belong together, then their pixels. Never more than channels_max of them.
  const Result<Page> first = page();
  if (!first) return first.error();
  if (Status status = check(*first, first->channels); !status) return status.error();
  DecodedImage image;
  image.format = ImageFormat::kTiff;
  image.width_px = first->width;
  image.height_px = first->height;
  image.bits = first->bits;
  read_scale(image);
  std::int64_t pages = 1;
  bool others = false;
  const bool grey = first->photometric == PHOTOMETRIC_MINISBLACK || first->photometric == PHOTOMETRIC_MINISWHITE;
  while (TIFFReadDirectory(tiff_.get()) != 0) {
    const Result<Page> next = page();
    others = !grey || !next || !next->same_shape(*first) || !check(*next, first->channels * (pages + 1));
    if (others) break;
    ++pages;
  }
  if (others || source_.failed) {
    image.notes.push_back("of the TIFF's pages only the first " + std::to_string(pages) +
                          " were read: the next is damaged, of another shape or too many");
  }
  source_.failed = false;
  image.channel_count = first->channels * pages;
  image.samples.resize(static_cast<std::size_t>(image.pixel_count() * image.channel_count));
  if (TIFFSetDirectory(tiff_.get(), 0) == 0) return failed("its first page is gone");
  Page last;
  for (std::int64_t number = 0; number < pages; ++number) {
    if (number > 0 && TIFFReadDirectory(tiff_.get()) == 0) return failed("a page is gone");
    const Result<Page> current = page();
    if (!current) return current.error();
    if (!current->same_shape(*first)) return failed("a page changed while it was read");
    if (Status status = append(*current, image, first->channels * number); !status) return status.error();
    last = *current;
  }
  finish_colours(last, pages, image);
  return image;
}

}  // namespace

Result<DecodedImage> decode_tiff(std::string_view bytes, const DecodeLimits& limits) {
  return Reader(bytes, limits).read();
}

}  // namespace colony::decode_parts
