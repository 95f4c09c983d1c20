// The scale of a TIFF with OME metadata: read, used where nothing contradicts it, and never resolved in silence.
#include "engine/analysis/ome_xml.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/analysis/image_analysis.hpp"
#include "engine/picture/ome_tiff.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/image_files.hpp"

namespace colony {
namespace {

using namespace testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string ome(const std::string& pixels_attributes, const std::string& more = {}) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"><Image ID=\"Image:0\">"
         "<Pixels ID=\"Pixels:0\" SizeX=\"64\" " + pixels_attributes + "/></Image>" + more + "</OME>";
}

/// A square on a dark ground, so that there is something to analyse.
Picture16 square() {
  Picture16 picture{64, 64, 1, std::vector<std::uint16_t>(64 * 64, 20)};
  for (std::size_t y = 20; y < 40; ++y) {
    for (std::size_t x = 20; x < 40; ++x) picture.samples[64 * y + x] = 200;
  }
  return picture;
}

ImageAnalysis analysed(const TiffSpec& spec, std::optional<double> um_per_px = {}) {
  AnalysisOptions options;
  options.um_per_px = um_per_px;
  auto result = analyse_image(tiff_file({square()}, spec), options);
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? std::move(*result) : ImageAnalysis{};
}

TEST(OmeXml, UnitsAndPrefixes) {
  const auto scale = [](const std::string& xml) { return read_ome_scale(xml).um_per_px.value_or(0.0); };
  EXPECT_DOUBLE_EQ(scale(ome(R"(PhysicalSizeX="0.65" PhysicalSizeY="0.65")")), 0.65);  // the format's default is um
  EXPECT_DOUBLE_EQ(scale(ome("PhysicalSizeX=\"0.65\" PhysicalSizeXUnit=\"\xc2\xb5m\" PhysicalSizeY=\"0.65\" PhysicalSizeYUnit=\"\xce\xbcm\"")), 0.65);
  EXPECT_DOUBLE_EQ(scale(ome(R"(PhysicalSizeX="650" PhysicalSizeXUnit="nm" PhysicalSizeY="6.5e-4" PhysicalSizeYUnit="mm")")), 0.65);
  EXPECT_DOUBLE_EQ(scale(ome(R"(PhysicalSizeX="1" PhysicalSizeXUnit="&#181;m" PhysicalSizeY="1" PhysicalSizeYUnit="&#xB5;m")")), 1.0);
  EXPECT_DOUBLE_EQ(scale(R"(<ome:OME xmlns:ome="u"><ome:Image><ome:Pixels PhysicalSizeX="2" PhysicalSizeY="2"/></ome:Image></ome:OME>)"), 2.0);
  EXPECT_FALSE(read_ome_scale(ome("")).um_per_px);
  EXPECT_THAT(read_ome_scale(ome("")).notes, IsEmpty());  // to state nothing is no mistake
}

TEST(OmeXml, WhatCannotBeUsedIsSaid) {
  const std::string same = R"(PhysicalSizeX="0.5" PhysicalSizeY="0.5")";
  const std::pair<std::string, const char*> cases[] = {
      {ome(R"(PhysicalSizeX="0.5" PhysicalSizeY="0.6")"), "it states 0.5 and 0.6 um"},
      {ome(same, R"(<Image><Pixels PhysicalSizeX="0.9" PhysicalSizeY="0.9"/></Image>)"), "it states 0.5 and 0.9 um"},
      {ome(R"(PhysicalSizeX="0.5")"), "only one side"},
      {ome(R"(PhysicalSizeX="0,5" PhysicalSizeY="0,5")"), "PhysicalSizeX \"0,5\""},
      {ome(R"(PhysicalSizeX="nan" PhysicalSizeY="nan")"), "is no size of a pixel"},
      {ome(R"(PhysicalSizeX="-1" PhysicalSizeY="-1")"), "is no size of a pixel"},
      {ome(R"(PhysicalSizeX="1" PhysicalSizeXUnit="pixel" PhysicalSizeY="1")"), "PhysicalSizeX \"1\" pixel"},
      {ome(same).substr(0, 150), "no well-formed XML"},
      {"<!DOCTYPE OME [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]>" + ome(same).substr(38), "document type"},
      {ome(same) + std::string(kOmeTextMax_bytes, ' '), "longer than 1 MiB"}};
  ASSERT_EQ(ome(same).substr(38, 4), "<OME");
  for (const auto& [xml, note] : cases) {
    const OmeScale scale = read_ome_scale(xml);
    EXPECT_FALSE(scale.um_per_px) << xml.substr(0, 300);
    EXPECT_THAT(scale.notes, ElementsAre(HasSubstr(note)));
  }
}

TEST(OmeXml, TheScaleOfTheFileIsUsedAndItsSourceIsTold) {
  const std::string xml = ome(R"(PhysicalSizeX="0.5" PhysicalSizeY="0.5")");
  const ImageAnalysis read = analysed({.description = xml});
  EXPECT_EQ(read.um_per_px, 0.5);
  EXPECT_EQ(read.metadata.scale_source, ScaleSource::kOme);
  EXPECT_EQ(*read.area_mean_um2, 0.25 * read.area_mean_px);
  EXPECT_THAT(read.metadata.notes, IsEmpty());
  // 20,000 pixels a cm are 0.5 um: the same, to what TIFF keeps.
  const ImageAnalysis agreeing = analysed({.per_centimetre = 20010.0F, .description = xml, .centimetres = true});
  EXPECT_EQ(agreeing.um_per_px, 0.5);
  EXPECT_THAT(agreeing.metadata.notes, IsEmpty());
  // A resolution alone may be a printer's.
  const ImageAnalysis printer = analysed({.per_centimetre = 20000.0F});
  EXPECT_FALSE(printer.um_per_px);
  EXPECT_EQ(printer.metadata.scale_source, ScaleSource::kNone);
  EXPECT_NEAR(*printer.metadata.um_per_px_stated, 0.5, 1e-6);
}

TEST(OmeXml, ContradictionsAreNotResolvedInSilence) {
  const std::string xml = ome(R"(PhysicalSizeX="0.5" PhysicalSizeY="0.5")");
  const ImageAnalysis within = analysed({.per_centimetre = 10000.0F, .description = xml, .centimetres = true});
  EXPECT_FALSE(within.um_per_px);
  EXPECT_FALSE(within.area_mean_um2);
  EXPECT_THAT(within.metadata.notes, ElementsAre(HasSubstr("OME metadata says 0.5 um a pixel, its resolution 1: give um_per_px")));
  const ImageAnalysis asked = analysed({.description = xml}, 0.65);
  EXPECT_EQ(asked.um_per_px, 0.65);
  EXPECT_EQ(asked.metadata.scale_source, ScaleSource::kGiven);
  EXPECT_EQ(asked.metadata.um_per_px_stated, 0.5);
  EXPECT_THAT(asked.metadata.notes, ElementsAre("um_per_px is 0.65 as asked for; the file says 0.5"));
  EXPECT_THAT(analysed({.description = xml}, 0.502).metadata.notes, IsEmpty());
}

TEST(OmeXml, OurOwnOmeTiffComesBackWithItsScale) {
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(6, 25.0, 5));
  PictureSpec spec;
  spec.um_per_px = 0.37;
  MemoryFile file;
  ASSERT_TRUE(write_ome_tiff(colony, params, spec, OmeChannels{}, {}, file));
  AnalysisOptions options;
  options.channel = 2;  // nuclei
  const auto result = analyse_image(file.bytes(), options);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_NEAR(result->um_per_px.value_or(0.0), 0.37, 1e-6);
  EXPECT_EQ(result->metadata.scale_source, ScaleSource::kOme);
  EXPECT_THAT(result->metadata.notes, IsEmpty());
}

}  // namespace
}  // namespace colony
