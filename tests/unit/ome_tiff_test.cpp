// OME-TIFF: what libtiff reads back is what was computed; physical size, types, BigTIFF's threshold, refusals.
#include "engine/picture/ome_tiff.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <memory>
#include <string>
#include <tiffio.h>
#include <vector>

#include <gtest/gtest.h>

#include "engine/picture/optics.hpp"
#include "engine/picture/paths.hpp"
#include "engine/picture/top_view.hpp"
#include "tests/support/founding.hpp"

namespace colony {
namespace {

using testing::found;
using testing::paper;
using testing::scattered_cells;

PictureSpec of_scale(double um_per_px) {
  PictureSpec spec;
  spec.um_per_px = um_per_px;
  return spec;
}

/// libtiff over bytes in memory, read only.
struct Source {
  std::string bytes;
  std::uint64_t position = 0;
};
using Tiff = std::unique_ptr<TIFF, void (*)(TIFF*)>;
Tiff open(Source& source) {
  const auto read = [](thandle_t user, void* to, tmsize_t size) -> tmsize_t {
    Source& s = *static_cast<Source*>(user);
    if (s.position >= s.bytes.size()) return 0;
    const std::size_t count = std::min(static_cast<std::size_t>(size), s.bytes.size() - s.position);
    std::memcpy(to, s.bytes.data() + s.position, count);
    s.position += count;
    return static_cast<tmsize_t>(count);
  };
  const auto write = [](thandle_t, void*, tmsize_t) -> tmsize_t { return -1; };
  const auto seek = [](thandle_t user, toff_t offset, int whence) -> toff_t {
    Source& s = *static_cast<Source*>(user);
    s.position = whence == SEEK_SET ? offset : whence == SEEK_CUR ? s.position + offset : s.bytes.size() + offset;
    return s.position;
  };
  return Tiff(TIFFClientOpen(
                  "memory", "rm", &source, read, write, seek, [](thandle_t) { return 0; },
                  [](thandle_t user) -> toff_t { return static_cast<Source*>(user)->bytes.size(); }, nullptr, nullptr),
              TIFFClose);
}

std::vector<std::uint16_t> plane(TIFF* tiff, const Frame& frame) {
  std::vector<std::uint16_t> samples(static_cast<std::size_t>(frame.width_px * frame.height_px));
  for (std::int64_t row = 0; row < frame.height_px; ++row) {
    EXPECT_EQ(TIFFReadScanline(tiff, samples.data() + row * frame.width_px, static_cast<std::uint32_t>(row), 0), 1);
  }
  return samples;
}

std::string attribute(const std::string& xml, const std::string& name) {
  const std::size_t at = xml.find(" " + name + "=\"");
  if (at == std::string::npos) return "";
  const std::size_t begin = at + name.size() + 3;
  return xml.substr(begin, xml.find('"', begin) - begin);
}

TEST(OmeTiff, PlanesAreTheChannels) {
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(25, 40.0, 7));
  const PictureSpec spec = of_scale(0.23);
  MemoryFile file;
  ASSERT_TRUE(write_ome_tiff(colony, params, spec, OmeChannels{}, Effort{2, nullptr}, file));
  Source source{file.bytes()};
  const Tiff tiff = open(source);
  ASSERT_TRUE(tiff);
  EXPECT_FALSE(TIFFIsBigTIFF(tiff.get()));
  ASSERT_EQ(TIFFNumberOfDirectories(tiff.get()), 4);

  const Frame frame = *frame_of(colony, spec);
  const PathView paths = path_lengths(colony, params.contact.rule, frame, {0, frame.height_px});
  const std::vector<float> phase = phase_contrast(colony, params.contact.rule, paths);
  const TopView view = top_view(colony, frame);
  for (std::uint16_t channel = 0; channel < 4; ++channel) {
    ASSERT_EQ(TIFFSetDirectory(tiff.get(), channel), 1);
    float per_cm = 0.0F;
    std::uint16_t unit = 0, bits = 0;
    std::uint32_t width = 0, height = 0;
    TIFFGetField(tiff.get(), TIFFTAG_XRESOLUTION, &per_cm);
    TIFFGetField(tiff.get(), TIFFTAG_RESOLUTIONUNIT, &unit);
    TIFFGetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
    EXPECT_EQ(unit, RESUNIT_CENTIMETER);
    EXPECT_NEAR(per_cm, 1e4 / 0.23, 0.1);
    EXPECT_EQ(bits, 16);
    ASSERT_EQ(width, frame.width_px);
    ASSERT_EQ(height, frame.height_px);
    const std::vector<std::uint16_t> samples = plane(tiff.get(), frame);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const auto cell_um = static_cast<double>(paths.cell_um[i]), nucleus_um = static_cast<double>(paths.nucleus_um[i]);
      const double expected = channel == 0   ? 65535.0 * transmission(kGreen, cell_um, nucleus_um)
                              : channel == 1 ? 65535.0 * static_cast<double>(phase[i])
                              : channel == 2 ? (nucleus_um > 0.0 ? 65535.0 : 0.0)
                                             : static_cast<double>(view.owner[i]);
      ASSERT_NEAR(static_cast<double>(samples[i]), expected, 0.5001) << channel << " " << i;
    }
  }
}

TEST(OmeTiff, XmlSaysSizeTypeAndChannels) {
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(3, 20.0, 7));
  MemoryFile file;
  OmeChannels channels;
  channels.phase = channels.nuclei = false;
  ASSERT_TRUE(write_ome_tiff(colony, params, of_scale(0.25), channels, Effort{}, file));
  Source source{file.bytes()};
  const Tiff tiff = open(source);
  char* description = nullptr;
  ASSERT_EQ(TIFFGetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, &description), 1);
  const std::string xml = description;
  const Frame frame = *frame_of(colony, of_scale(0.25));
  EXPECT_EQ(xml.rfind("<?xml", 0), 0u);
  EXPECT_EQ(attribute(xml, "Type"), "uint16");
  EXPECT_EQ(attribute(xml, "SizeX"), std::to_string(frame.width_px));
  EXPECT_EQ(attribute(xml, "SizeY"), std::to_string(frame.height_px));
  EXPECT_EQ(attribute(xml, "SizeC"), "2");
  EXPECT_EQ(attribute(xml, "PhysicalSizeX"), "0.25");
  EXPECT_EQ(attribute(xml, "PhysicalSizeXUnit"), "&#181;m");
  EXPECT_NE(xml.find("Name=\"brightfield\""), std::string::npos);
  EXPECT_NE(xml.find("Name=\"labels\""), std::string::npos);
  EXPECT_EQ(xml.find("Name=\"phase\""), std::string::npos);
  for (const char c : xml) ASSERT_TRUE(c == '\n' || (c >= ' ' && c <= '~'));  // the tag is ASCII
}

TEST(OmeTiff, BeyondSixteenBitsOfCellsSamplesHaveThirtyTwo) {
  // A lattice of 65,792 cells, each a few coarse pixels; as BigTIFF, which nothing of a test's size would be by itself.
  const Params params = testing::paper_without_noise();
  std::vector<Cell> cells;
  for (int row = 0; row < 256; ++row) {
    for (int column = 0; column < 257; ++column) cells.push_back(testing::ball_at(16.0 * column, 16.0 * row, 6.0));
  }
  const Colony colony = found(params, cells);
  OmeChannels channels{true, false, false, true};
  channels.big = true;
  MemoryFile file;
  ASSERT_TRUE(write_ome_tiff(colony, params, of_scale(4.0), channels, Effort{2, nullptr}, file));
  Source source{file.bytes()};
  const Tiff tiff = open(source);
  ASSERT_TRUE(tiff);
  EXPECT_TRUE(TIFFIsBigTIFF(tiff.get()));
  char* description = nullptr;
  ASSERT_EQ(TIFFGetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, &description), 1);
  EXPECT_EQ(attribute(description, "Type"), "uint32");
  ASSERT_EQ(TIFFSetDirectory(tiff.get(), 1), 1);
  const Frame frame = *frame_of(colony, of_scale(4.0));
  const TopView view = top_view(colony, frame);
  std::vector<std::uint32_t> row(static_cast<std::size_t>(frame.width_px));
  std::uint32_t greatest = 0;
  for (std::int64_t y = 0; y < frame.height_px; ++y) {
    ASSERT_EQ(TIFFReadScanline(tiff.get(), row.data(), static_cast<std::uint32_t>(y), 0), 1);
    ASSERT_TRUE(std::equal(row.begin(), row.end(), view.owner.begin() + y * frame.width_px)) << y;
    greatest = std::max(greatest, *std::max_element(row.begin(), row.end()));
  }
  EXPECT_EQ(greatest, 65792u);
}

TEST(OmeTiff, ThreadsCannotMatter) {
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(25, 40.0, 7));
  MemoryFile one;
  ASSERT_TRUE(write_ome_tiff(colony, params, of_scale(0.2), OmeChannels{}, Effort{}, one));
  for (const int threads : {2, 7}) {
    MemoryFile other;
    ASSERT_TRUE(write_ome_tiff(colony, params, of_scale(0.2), OmeChannels{}, Effort{threads, nullptr}, other));
    EXPECT_EQ(other.bytes(), one.bytes());
  }
}

/// Refuses to hold more than a number of bytes.
class SmallFile : public MemoryFile {
 public:
  explicit SmallFile(std::uint64_t bytes_max) : bytes_max_(bytes_max) {}
  bool write(std::uint64_t offset, std::string_view bytes) override {
    return offset + bytes.size() <= bytes_max_ && MemoryFile::write(offset, bytes);
  }

 private:
  std::uint64_t bytes_max_;
};

TEST(OmeTiff, RefusalsAreErrors) {
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(5, 20.0, 7));
  MemoryFile whole;
  ASSERT_TRUE(write_ome_tiff(colony, params, of_scale(0.5), OmeChannels{}, Effort{}, whole));
  // A file that is full anywhere on the way, the last byte included.
  for (std::uint64_t bytes = 0; bytes < whole.size(); bytes += whole.size() / 40 + 1) {
    SmallFile file(bytes);
    const Status status = write_ome_tiff(colony, params, of_scale(0.5), OmeChannels{}, Effort{}, file);
    ASSERT_FALSE(status) << bytes;
    EXPECT_EQ(status.error().code, ErrorCode::kStorage);
  }
  SmallFile almost(whole.size() - 1);
  EXPECT_FALSE(write_ome_tiff(colony, params, of_scale(0.5), OmeChannels{}, Effort{}, almost));
  MemoryFile file;
  OmeChannels none{false, false, false, false};
  EXPECT_EQ(write_ome_tiff(colony, params, of_scale(0.5), none, Effort{}, file).error().fields.at(0).pointer,
            "channels");
  EXPECT_EQ(write_ome_tiff(colony, params, of_scale(-1.0), OmeChannels{}, Effort{}, file).error().fields.at(0).pointer,
            "um_per_px");
  const std::atomic<bool> stop = true;
  EXPECT_THROW(static_cast<void>(write_ome_tiff(colony, params, of_scale(0.5), OmeChannels{}, Effort{1, &stop}, file)),
               Stopped);
}

}  // namespace
}  // namespace colony
