// decode: every kind of file comes back as it was made; whatever is cut, forged or too large is refused by name, before memory is asked for.
#include "engine/analysis/decode.hpp"

#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/analysis/decode_parts.hpp"
#include "tests/support/image_files.hpp"

namespace colony {
namespace {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

DecodedImage read(const std::string& file) {
  Result<DecodedImage> result = decode_image(file);
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? std::move(*result) : DecodedImage{};
}

void expect_same(const DecodedImage& image, const Picture16& picture, int bits) {
  EXPECT_EQ(image.width_px, picture.width);
  EXPECT_EQ(image.height_px, picture.height);
  EXPECT_EQ(image.channel_count, picture.channels);
  EXPECT_EQ(image.bits, bits);
  EXPECT_EQ(image.samples, picture.samples);
}

std::string grey_png(int width, int height) {
  return png_file(width, height, {}, as_bytes(gradient(width, height, 1, 255).samples, 8));
}

TEST(DecodePng, GreyAndRgbOf8And16BitsInterlacedOrNotComeBackAsMade) {
  for (const std::uint8_t bits : {std::uint8_t{8}, std::uint8_t{16}}) {
    for (const int channels : {1, 3}) {
      for (const std::uint8_t interlace : {std::uint8_t{0}, std::uint8_t{1}}) {
        const Picture16 picture = gradient(13, 7, channels, bits == 8 ? 255 : 65535);
        const std::uint8_t type = channels == 1 ? SPNG_COLOR_TYPE_GRAYSCALE : SPNG_COLOR_TYPE_TRUECOLOR;
        const DecodedImage image = read(png_file(13, 7, {type, bits, interlace}, as_bytes(picture.samples, bits)));
        expect_same(image, picture, bits);
        EXPECT_EQ(image.model, channels == 1 ? ColourModel::kGrey : ColourModel::kRgb);
        EXPECT_THAT(image.notes, IsEmpty());
      }
    }
  }
}

TEST(DecodePng, FewBitsAreSpreadAndPalettesLookedUp) {
  EXPECT_EQ(read(png_file(8, 1, {SPNG_COLOR_TYPE_GRAYSCALE, 1}, {0b10110001})).samples,
            (std::vector<std::uint16_t>{255, 0, 255, 255, 0, 0, 0, 255}));
  EXPECT_EQ(read(png_file(4, 1, {SPNG_COLOR_TYPE_GRAYSCALE, 2}, {0b00011011})).samples,
            (std::vector<std::uint16_t>{0, 85, 170, 255}));
  const PngSpec indexed{SPNG_COLOR_TYPE_INDEXED, 8, 0, {{10, 20, 30, 255}, {200, 100, 50, 255}}};
  const DecodedImage image = read(png_file(3, 1, indexed, {1, 0, 1}));
  EXPECT_EQ(image.model, ColourModel::kRgb);
  EXPECT_EQ(image.samples, (std::vector<std::uint16_t>{200, 100, 50, 10, 20, 30, 200, 100, 50}));
}

TEST(DecodePng, TransparencyIsBlendedOverWhiteAndSaidSo) {
  // Black ink on nothing must not become black on black.
  const DecodedImage image = read(png_file(3, 1, {SPNG_COLOR_TYPE_GRAYSCALE_ALPHA, 8}, {0, 255, 0, 0, 100, 51}));
  EXPECT_EQ(image.samples, (std::vector<std::uint16_t>{0, 255, 224}));  // 100 / 5 + 255 * 4 / 5
  EXPECT_EQ(image.channel_count, 1);
  ASSERT_EQ(image.notes.size(), 1U);
  EXPECT_THAT(image.notes[0], HasSubstr("over white"));
  const Picture16 wide = gradient(2, 1, 4, 65535);
  const DecodedImage deep = read(png_file(2, 1, {SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, 16}, as_bytes(wide.samples, 16)));
  for (std::size_t i = 0; i < 2; ++i) {
    const double alpha = wide.samples[4 * i + 3] / 65535.0;
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(deep.samples[3 * i + c], wide.samples[4 * i + c] * alpha + 65535.0 * (1.0 - alpha), 0.51);
    }
  }
}

TEST(DecodePng, AnAnimationSaysThatOnlyItsFirstPictureWasRead) {
  using std::string_literals::operator""s;
  const std::string png = grey_png(9, 5);
  EXPECT_THAT(read(png).notes, IsEmpty());
  // After the header's chunk, which ends at byte 33: two pictures, played for ever; the CRC is that of type and data.
  std::string animated = png;
  animated.insert(33, "\0\0\0\x08" "acTL" "\0\0\0\x02" "\0\0\0\0" "\xf3\x8d\x93\x70"s);
  const DecodedImage image = read(animated);
  ASSERT_EQ(image.notes.size(), 1u);
  EXPECT_THAT(image.notes.front(), HasSubstr("only the first picture"));
  EXPECT_EQ(image.samples, read(png).samples);
}

TEST(DecodePng, ThePixelSizeIsReportedInUm) {
  const DecodedImage image = read(png_file(2, 1, {0, 8, 0, {}, 4'000'000}, {1, 2}));
  ASSERT_TRUE(image.um_per_px_stated);
  EXPECT_DOUBLE_EQ(*image.um_per_px_stated, 0.25);
}

TEST(DecodeTiff, EveryLayoutAndCompressionComesBackAsMade) {
  int count = 0;
  for (const int kind :
       {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_DEFLATE, COMPRESSION_PACKBITS}) {
    const auto compression = static_cast<std::uint16_t>(kind);
    for (const int bits : {8, 16}) {
      for (const int channels : {1, 3, 5}) {
        for (const bool planar : {false, true}) {
          for (const int tile : {0, 16}) {
            for (const bool big_endian : {false, true}) {
              TiffSpec spec{
                  .bits = bits, .compression = compression, .planar = planar, .tile = tile, .big_endian = big_endian};
              spec.predictor = compression == COMPRESSION_LZW;
              spec.photometric = channels == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK;
              const Picture16 picture = gradient(37, 22, channels, bits == 8 ? 255 : 65535);
              const DecodedImage image = read(tiff_file({picture}, spec));
              expect_same(image, picture, bits);
              EXPECT_EQ(image.model, channels == 1   ? ColourModel::kGrey
                                     : channels == 3 ? ColourModel::kRgb
                                                     : ColourModel::kChannels);
              ++count;
            }
          }
        }
      }
    }
  }
  EXPECT_EQ(count, 240);
}

TEST(DecodeTiff, PagesOfOneShapeAreChannelsAndOthersAreLeftOutByName) {
  const Picture16 a = gradient(9, 5, 1, 255);
  Picture16 b = a;
  for (std::uint16_t& sample : b.samples) sample = static_cast<std::uint16_t>(255 - sample);
  const DecodedImage image = read(tiff_file({a, b, a}, {}));
  EXPECT_EQ(image.channel_count, 3);
  EXPECT_EQ(image.model, ColourModel::kChannels);  // three stains are no colour
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    ASSERT_EQ(image.samples[3 * i], a.samples[i]);
    ASSERT_EQ(image.samples[3 * i + 1], b.samples[i]);
  }
  const DecodedImage first = read(tiff_file({a, gradient(4, 5, 1, 255)}, {}));
  expect_same(first, a, 8);
  ASSERT_EQ(first.notes.size(), 1U);
  EXPECT_THAT(first.notes[0], HasSubstr("only the first 1"));
  const DecodedImage many = read(tiff_file(std::vector<Picture16>(20, a), {}));
  EXPECT_EQ(many.channel_count, 16);
  EXPECT_EQ(many.notes.size(), 1U);
}

TEST(DecodeTiff, WhiteIsZeroPaletteAlphaBigTiffAndScale) {
  const Picture16 a = gradient(9, 5, 1, 255);
  const DecodedImage negative = read(tiff_file({a, a}, {.photometric = PHOTOMETRIC_MINISWHITE}));
  EXPECT_EQ(negative.samples[0], 255 - a.samples[0]);
  EXPECT_EQ(negative.samples[7], 255 - a.samples[3]);
  const DecodedImage palette = read(tiff_file({a}, {.photometric = PHOTOMETRIC_PALETTE}));
  EXPECT_EQ(palette.model, ColourModel::kRgb);
  EXPECT_EQ(palette.samples[3], a.samples[1]);
  EXPECT_EQ(palette.samples[4], 255 - a.samples[1]);
  const Picture16 half{1, 1, 4, {100, 50, 0, 128}};
  EXPECT_EQ(read(tiff_file({half}, {.photometric = PHOTOMETRIC_RGB, .alpha = EXTRASAMPLE_ASSOCALPHA})).samples,
            (std::vector<std::uint16_t>{227, 177, 127}));
  expect_same(read(tiff_file({a}, {.big_tiff = true})), a, 8);
  EXPECT_NEAR(read(tiff_file({a}, {.per_centimetre = 20000.0F})).um_per_px_stated.value_or(0), 0.5, 1e-9);
  EXPECT_NEAR(read(tiff_file({a}, {.per_centimetre = 4.0F, .description = "ImageJ=1.53\nunit=micron\n"}))
                  .um_per_px_stated.value_or(0),
              0.25, 1e-9);
  EXPECT_FALSE(read(tiff_file({a}, {.per_centimetre = 4.0F, .description = "no unit"})).um_per_px_stated);
}

TEST(DecodeJpeg, GreyAndRgbComeBackWithinTheirLoss) {
  for (const int channels : {1, 3}) {
    for (const bool progressive : {false, true}) {
      Picture16 picture{40, 24, channels, {}};
      for (int i = 0; i < 40 * 24; ++i) {
        for (int c = 0; c < channels; ++c)
          picture.samples.push_back(static_cast<std::uint16_t>(60 + 3 * (i % 40) + 20 * c));
      }
      const DecodedImage image = read(jpeg_file(picture, 95, progressive));
      EXPECT_EQ(image.model, channels == 1 ? ColourModel::kGrey : ColourModel::kRgb);
      ASSERT_EQ(image.samples.size(), picture.samples.size());
      for (std::size_t i = 0; i < image.samples.size(); ++i)
        ASSERT_NEAR(image.samples[i], picture.samples[i], 4.0) << i;
    }
  }
}

struct Refusal {
  std::string what;
  std::string bytes;
  ErrorCode code;
  std::string message;
};

std::string with_bytes(std::string file, std::size_t at, const std::string& bytes) {
  return file.replace(at, bytes.size(), bytes);
}

TEST(DecodeRefuses, EachByName) {
  using std::string_literals::operator""s;
  const std::string png = grey_png(64, 64);
  const std::string jpeg = jpeg_file(gradient(64, 64, 3, 255), 80);
  const std::string tiff = tiff_file({gradient(64, 64, 1, 255)}, {.rows_per_strip = 64});
  // The first directory entries of a little-endian TIFF of libtiff: width and height are tags 256 and 257.
  const auto entry = [](std::uint16_t tag, std::uint16_t type, std::uint32_t count, std::uint32_t value) {
    std::string bytes(12, '\0');
    std::memcpy(bytes.data(), &tag, 2);
    std::memcpy(bytes.data() + 2, &type, 2);
    std::memcpy(bytes.data() + 4, &count, 4);
    std::memcpy(bytes.data() + 8, &value, 4);
    return bytes;
  };
  const auto small_tiff = [&](std::uint32_t width, std::uint32_t height, std::uint32_t bits,
                              std::uint32_t compression) {
    return "II*\0\x08\0\0\0\x08\0"s + entry(256, 4, 1, width) + entry(257, 4, 1, height) + entry(258, 3, 1, bits) +
           entry(259, 3, 1, compression) + entry(262, 3, 1, 1) + entry(273, 4, 1, 8) + entry(278, 4, 1, height) +
           entry(279, 4, 1, 64) + std::string(4, '\0');
  };
  const std::vector<Refusal> refusals = {
      {"nothing", "", ErrorCode::kMalformed, "empty"},
      {"a text called .png", "cell,x,y\n1,2,3\n", ErrorCode::kMalformed, "like a text"},
      {"a GIF", "GIF89a\x01\x00\x01\x00\x80"s, ErrorCode::kMalformed, "like none"},
      {"a PNG of its signature alone", png.substr(0, 8), ErrorCode::kMalformed, "PNG"},
      {"a PNG cut in its header", png.substr(0, 20), ErrorCode::kMalformed, "PNG"},
      {"a PNG cut in its pixels", png.substr(0, png.size() / 2), ErrorCode::kMalformed, "PNG"},
      {"a PNG with a wrong checksum", with_bytes(png, png.size() / 2, "\x55\x55\x55"), ErrorCode::kMalformed, "PNG"},
      {"a JPEG cut in its pixels", jpeg.substr(0, jpeg.size() / 2), ErrorCode::kMalformed, "JPEG"},
      {"a JPEG of its first bytes", jpeg.substr(0, 4), ErrorCode::kMalformed, "JPEG"},
      {"a TIFF cut before its directory", tiff.substr(0, 100), ErrorCode::kMalformed, "TIFF"},
      {"a TIFF of its first bytes", tiff.substr(0, 4), ErrorCode::kMalformed, "TIFF"},
      {"a TIFF of a million x a million", small_tiff(1'000'000, 1'000'000, 8, 1), ErrorCode::kLimit, "at most 50000"},
      {"a TIFF of 4e9 x 4e9", small_tiff(4'000'000'000, 4'000'000'000, 8, 1), ErrorCode::kMalformed,
       "TIFF"},  // libtiff's own sums overflow
      {"a TIFF of 50,000 x 50,000", small_tiff(50'000, 50'000, 8, 1), ErrorCode::kLimit, "at most 67108864"},
      {"a TIFF of 8,000 x 8,000 in 110 bytes", small_tiff(8'000, 8'000, 8, 1), ErrorCode::kMalformed, "can hold"},
      {"the same deflated", small_tiff(8'000, 8'000, 8, 8), ErrorCode::kMalformed, "can hold"},
      {"a TIFF of no pixels", small_tiff(0, 5, 8, 1), ErrorCode::kMalformed, ""},
      {"a TIFF of 32 bits", small_tiff(2, 2, 32, 1), ErrorCode::kInvalid, "32 bits"},
      {"a TIFF of 1 bit", small_tiff(2, 2, 1, 1), ErrorCode::kInvalid, "1 bits"},
      {"a TIFF holding a JPEG", small_tiff(2, 2, 8, 7), ErrorCode::kInvalid, "compression 7"},
  };
  for (const Refusal& refusal : refusals) {
    const Result<DecodedImage> result = decode_image(refusal.bytes);
    ASSERT_FALSE(result) << refusal.what;
    EXPECT_EQ(result.error().code, refusal.code) << refusal.what << ": " << result.error().message;
    EXPECT_THAT(result.error().message, HasSubstr(refusal.message)) << refusal.what;
  }
}

/// `value` in place of what an entry of the first directory of a little-endian TIFF says.
std::string with_tag(std::string file, std::uint16_t tag, std::uint32_t value) {
  std::uint32_t at = 0;
  std::memcpy(&at, file.data() + 4, 4);
  std::uint16_t count = 0;
  std::memcpy(&count, file.data() + at, 2);
  for (std::size_t i = 0; i < count; ++i) {
    char* const entry = file.data() + at + 2 + 12 * i;
    std::uint16_t found = 0;
    std::memcpy(&found, entry, 2);
    const std::uint16_t type = TIFF_LONG;
    if (found == tag) std::memcpy(entry + 2, &type, 2);
    if (found == tag) std::memcpy(entry + 8, &value, 4);
  }
  return file;
}

TEST(DecodeRefuses, ATileThatIsLargerThanItsImageOrItsFileBeforeMemoryIsAskedFor) {
  for (const std::uint16_t compression : {std::uint16_t{COMPRESSION_NONE}, std::uint16_t{COMPRESSION_ADOBE_DEFLATE}}) {
    const std::string small = tiff_file({gradient(16, 16, 16, 65535)}, {.bits = 16, .compression = compression, .tile = 16});
    const auto stated = [&](std::uint32_t side) { return decode_image(with_tag(with_tag(small, TIFFTAG_TILEWIDTH, side), TIFFTAG_TILELENGTH, side)); };
    ASSERT_TRUE(stated(16));
    const Result<DecodedImage> huge = stated(4096);  // half a gigabyte
    ASSERT_FALSE(huge);
    EXPECT_EQ(huge.error().code, ErrorCode::kLimit);
    EXPECT_THAT(huge.error().message, HasSubstr("tiles of 4096 x 4096"));
    const Result<DecodedImage> large = stated(1024);  // 32 MiB, from a few kilobytes: 9 MB at most if deflated
    ASSERT_FALSE(large);
    EXPECT_EQ(large.error().code, ErrorCode::kMalformed);
    EXPECT_THAT(large.error().message, HasSubstr("more than the file can hold"));
  }
  // A tile of the usual size about a small image is fine, as is one of an image that is no multiple of 16.
  for (const int tile : {256, 1024}) {
    const Picture16 picture = gradient(20, 9, 1, 255);
    EXPECT_EQ(read(tiff_file({picture}, {.compression = COMPRESSION_LZW, .tile = tile})).samples, picture.samples);
  }
}

TEST(DecodeRefuses, ADamagedTiffInOurOwnWords) {
  const std::string tiff = tiff_file({gradient(64, 64, 1, 255)}, {.compression = COMPRESSION_ADOBE_DEFLATE, .rows_per_strip = 16});
  const Result<DecodedImage> broken = decode_image(with_bytes(tiff, 20, std::string(40, '\x55')));
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().message, "damaged or cut-off TIFF: strip 0 cannot be read");
}

TEST(DecodeRefuses, APngOrJpegThatStatesTooMuchBeforeItsPixelsAreLookedAt) {
  const std::string png = grey_png(3000, 20);
  DecodeLimits limits;
  limits.side_max_px = 2999;
  EXPECT_EQ(decode_image(png, limits).error().code, ErrorCode::kLimit);
  limits = {};
  limits.pixels_max = 59'999;
  EXPECT_EQ(decode_image(png, limits).error().code, ErrorCode::kLimit);
  EXPECT_EQ(decode_image(jpeg_file(gradient(300, 200, 1, 255), 80), limits).error().code, ErrorCode::kLimit);
  limits = {};
  limits.samples_bytes_max = 119'999;
  EXPECT_EQ(decode_image(png, limits).error().code, ErrorCode::kLimit);
  limits = {};
  limits.channels_max = 2;
  EXPECT_EQ(decode_image(tiff_file({gradient(4, 4, 3, 255)}, {.photometric = PHOTOMETRIC_RGB}), limits).error().code,
            ErrorCode::kLimit);
}

TEST(DecodeRefuses, EveryCutOfAFileIsAnErrorOrTheWholeImage) {
  // A TIFF's directory may stand at its end, a PNG's last chunk holds no pixels: what counts is that nothing is half read.
  const Picture16 picture = gradient(19, 11, 1, 255);
  for (const std::string& file :
       {grey_png(19, 11), tiff_file({picture}, {}), tiff_file({picture}, {.compression = COMPRESSION_LZW})}) {
    for (std::size_t size = 0; size < file.size(); ++size) {
      const Result<DecodedImage> result = decode_image(std::string_view(file).substr(0, size));
      if (result) {
        EXPECT_EQ(result->samples, picture.samples) << size;
      }
    }
  }
}

TEST(Decode, ErrorsOfOneThreadAreNotSeenByAnother) {
  const std::string bad = tiff_file({gradient(64, 64, 1, 255)}, {.compression = COMPRESSION_LZW}).substr(0, 900);
  const std::string good = tiff_file({gradient(64, 64, 1, 255)}, {});
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 50; ++i) {
        const bool read = static_cast<bool>(decode_image(t % 2 == 0 ? bad : good));
        EXPECT_EQ(read, t % 2 == 1);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace colony
