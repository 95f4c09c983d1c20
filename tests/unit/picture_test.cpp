#include <cmath>
#include <limits>
#include <memory>

#include <gtest/gtest.h>
#include <spng.h>

#include "engine/picture/annotate.hpp"
#include "engine/picture/colour.hpp"
#include "engine/picture/glyphs.hpp"
#include "engine/picture/render.hpp"
#include "engine/picture/styles.hpp"
#include "engine/picture/top_view.hpp"
#include "tests/support/founding.hpp"

namespace colony {
namespace {

using testing::ball_at;
using testing::found;
using testing::paper;
using testing::paper_without_noise;
using testing::scattered_cells;

Rgb pixel(const Picture& picture, std::int64_t row, std::int64_t column) {
  const auto at = static_cast<std::size_t>(3 * (row * picture.width_px + column));
  return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}

Frame frame_of(const Picture& picture) {
  return {picture.width_px, picture.height_px, picture.um_per_px, picture.left_um, picture.top_um};
}

double luminance(Rgb colour) { return 0.2126 * colour.red + 0.7152 * colour.green + 0.0722 * colour.blue; }

/// The pointer of the only field of an error; empty if the picture was drawn.
std::string refused_field(const Colony& colony, const PictureSpec& spec, ErrorCode code) {
  const Result<Picture> result = render(colony, paper(), spec);
  if (result) return "";
  EXPECT_EQ(result.error().code, code);
  EXPECT_EQ(result.error().fields.size(), 1u);
  return result.error().fields.front().pointer;
}

PictureSpec of_scale(double um_per_px) {
  PictureSpec spec;
  spec.um_per_px = um_per_px;
  return spec;
}
PictureSpec of_width(std::int64_t width_px) {
  PictureSpec spec;
  spec.width_px = width_px;
  return spec;
}

TEST(Picture, FrameIsTheBodiesAndAMarginOfOneTwentieth) {
  const Params params = paper_without_noise();
  const Colony colony = found(params, {ball_at(-50.0, 10.0, 6.0), ball_at(70.0, 40.0, 6.0)});
  const double width_um = 132.0, height_um = 42.0, margin_um = 0.05 * 132.0;
  const Picture by_width = *render(colony, params, PictureSpec{});
  EXPECT_EQ(by_width.width_px, 1024);
  EXPECT_NEAR(by_width.um_per_px, (width_um + 2.0 * margin_um) / 1024.0, 1e-9);
  EXPECT_EQ(by_width.height_px,
            static_cast<std::int64_t>(std::ceil((height_um + 2.0 * margin_um) / by_width.um_per_px)));
  EXPECT_NEAR(by_width.left_um, -56.0 - margin_um, 1e-9);
  EXPECT_NEAR(by_width.top_um, 46.0 + margin_um, by_width.um_per_px);
  EXPECT_EQ(by_width.rgb.size(), static_cast<std::size_t>(3 * by_width.width_px * by_width.height_px));

  const Picture by_scale = *render(colony, params, of_scale(0.5));
  EXPECT_EQ(by_scale.um_per_px, 0.5);
  EXPECT_EQ(by_scale.width_px, static_cast<std::int64_t>(std::ceil((width_um + 2.0 * margin_um) / 0.5)));
  EXPECT_EQ(by_scale.height_px, static_cast<std::int64_t>(std::ceil((height_um + 2.0 * margin_um) / 0.5)));
}

TEST(Picture, YPointsUpAndXToTheRight) {
  const Params params = paper_without_noise();
  std::vector<Cell> cells = {ball_at(-30.0, -20.0, 6.0), ball_at(30.0, 20.0, 6.0)};
  cells[1].activity = Activity::kPassive;
  for (Cell& cell : cells) cell.nucleus_radius_um = 0.5;
  PictureSpec spec = of_width(200);
  spec.scale_bar = false;
  const Picture picture = *render(found(params, cells), params, spec);
  std::int64_t green_rows = 0, green = 0, purple_rows = 0, purple = 0, green_columns = 0, purple_columns = 0;
  for (std::int64_t row = 0; row < picture.height_px; ++row) {
    for (std::int64_t column = 0; column < picture.width_px; ++column) {
      const Rgb at = pixel(picture, row, column);
      if (at == kDarkBackground) continue;
      if (at.green > at.red + 40) green_rows += row, green_columns += column, ++green;
      if (at.red > at.green + 10) purple_rows += row, purple_columns += column, ++purple;
    }
  }
  ASSERT_GT(green, 100);
  ASSERT_GT(purple, 100);
  EXPECT_GT(green_rows / green, purple_rows / purple);        // the active cell lies below
  EXPECT_LT(green_columns / green, purple_columns / purple);  // and to the left
}

TEST(Picture, LightComesFromTheUpperLeft) {
  const Params params = paper_without_noise();
  std::vector<Cell> cells = {ball_at(0.0, 0.0, 7.0)};
  cells[0].nucleus_radius_um = 0.5;
  const Picture picture = *render(found(params, cells), params, of_width(200));
  const std::int64_t middle = 100, off = 55;
  EXPECT_GT(luminance(pixel(picture, middle - off, middle - off)),
            luminance(pixel(picture, middle + off, middle + off)) + 60.0);
}

TEST(Picture, ColonyWithoutCellsIsABackgroundOf100Um) {
  for (const PictureStyle style : {PictureStyle::kShaded, PictureStyle::kContours}) {
    PictureSpec spec = of_width(50);
    spec.style = style;
    spec.scale_bar = false;
    const Picture picture = *render(Colony(paper()), paper(), spec);
    EXPECT_EQ(picture.width_px, 50);
    EXPECT_EQ(picture.height_px, 50);
    EXPECT_DOUBLE_EQ(picture.um_per_px, 2.0);
    for (std::int64_t row = 0; row < 50; ++row) {
      for (std::int64_t column = 0; column < 50; ++column) {
        ASSERT_EQ(pixel(picture, row, column), style == PictureStyle::kShaded ? kDarkBackground : kWhite);
      }
    }
  }
  for (const ColourBy colour_by : {ColourBy::kActivity, ColourBy::kGeneration, ColourBy::kAge, ColourBy::kVolume}) {
    PictureSpec spec;
    spec.colour_by = colour_by;
    EXPECT_TRUE(render(Colony(paper()), paper(), spec));
  }
}

TEST(Picture, LimitsAreRefusedByTheirNames) {
  const Colony colony = found(paper(), {ball_at(0.0, 0.0, 7.0)});
  EXPECT_EQ(refused_field(colony, of_width(kPictureSideMax_px + 1), ErrorCode::kLimit), "width_px");
  EXPECT_EQ(refused_field(colony, of_width(std::numeric_limits<std::int64_t>::max()), ErrorCode::kLimit), "width_px");
  EXPECT_EQ(refused_field(colony, of_width(0), ErrorCode::kInvalid), "width_px");
  EXPECT_EQ(refused_field(colony, of_width(-1024), ErrorCode::kInvalid), "width_px");
  EXPECT_EQ(refused_field(colony, of_scale(0.0015), ErrorCode::kLimit), "um_per_px");
  EXPECT_EQ(refused_field(colony, of_scale(-0.5), ErrorCode::kInvalid), "um_per_px");
  EXPECT_EQ(refused_field(colony, of_scale(1e-300), ErrorCode::kInvalid), "um_per_px");
  EXPECT_EQ(refused_field(colony, of_scale(1e300), ErrorCode::kInvalid), "um_per_px");
  EXPECT_EQ(refused_field(colony, of_scale(std::numeric_limits<double>::quiet_NaN()), ErrorCode::kInvalid),
            "um_per_px");
  EXPECT_EQ(refused_field(colony, of_scale(std::numeric_limits<double>::infinity()), ErrorCode::kInvalid), "um_per_px");
  // The width fits, the height that follows from it does not.
  const Colony tall = found(paper(), {ball_at(0.0, -500.0, 7.0), ball_at(0.0, 500.0, 7.0)});
  EXPECT_EQ(refused_field(tall, of_width(2000), ErrorCode::kLimit), "width_px");
  EXPECT_EQ(refused_field(tall, of_width(200), ErrorCode::kLimit), "");
  EXPECT_EQ(refused_field(colony, of_width(1), ErrorCode::kLimit), "");
}

TEST(Picture, SameColonySameBytes) {
  const Colony one = found(paper(), scattered_cells(15, 50.0, 3));
  const Colony two = found(paper(), scattered_cells(15, 50.0, 3));
  for (const PictureStyle style : {PictureStyle::kShaded, PictureStyle::kContours}) {
    PictureSpec spec = of_width(320);
    spec.style = style;
    EXPECT_EQ(encode_png(*render(one, paper(), spec)), encode_png(*render(two, paper(), spec)));
  }
}

/// 4-connected parts of what is not line: does each lie in one owner?
bool white_parts_have_one_owner(const Picture& picture, const TopView& view) {
  std::vector<bool> seen(view.owner.size(), false);
  std::vector<std::pair<std::int64_t, std::int64_t>> open;
  for (std::int64_t row = 0; row < picture.height_px; ++row) {
    for (std::int64_t column = 0; column < picture.width_px; ++column) {
      if (seen[view.index(row, column)] || pixel(picture, row, column) == kBlack) continue;
      const std::uint32_t owner = view.owner[view.index(row, column)];
      open.assign(1, {row, column});
      seen[view.index(row, column)] = true;
      while (!open.empty()) {
        const auto [r, c] = open.back();
        open.pop_back();
        if (view.owner[view.index(r, c)] != owner) return false;
        for (const auto& [dr, dc] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
          const std::int64_t nr = r + dr, nc = c + dc;
          if (nr < 0 || nr >= picture.height_px || nc < 0 || nc >= picture.width_px) continue;
          if (seen[view.index(nr, nc)] || pixel(picture, nr, nc) == kBlack) continue;
          seen[view.index(nr, nc)] = true;
          open.emplace_back(nr, nc);
        }
      }
    }
  }
  return true;
}

TEST(Picture, ContoursAreClosedLinesOfOnePixelAtChangesOfOwner) {
  const Colony colony = found(paper(), scattered_cells(25, 60.0, 8));
  PictureSpec spec = of_width(500);
  spec.style = PictureStyle::kContours;
  spec.scale_bar = false;
  Picture picture = *render(colony, paper(), spec);
  const TopView view = top_view(colony, frame_of(picture));
  std::int64_t lines = 0;
  for (std::int64_t row = 1; row + 1 < picture.height_px; ++row) {
    for (std::int64_t column = 1; column + 1 < picture.width_px; ++column) {
      const Rgb at = pixel(picture, row, column);
      ASSERT_TRUE(at == kBlack || at == kWhite);
      const std::uint32_t owner = view.owner[view.index(row, column)];
      bool higher_side = false;
      for (const auto& [dr, dc] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        const std::uint32_t other = view.owner[view.index(row + dr, column + dc)];
        // Of the two pixels at a change of owner exactly the one of the higher id is line on its account.
        higher_side = higher_side || other < owner;
      }
      ASSERT_EQ(at == kBlack, higher_side) << row << " " << column;
      lines += at == kBlack;
    }
  }
  EXPECT_GT(lines, 1000);
  EXPECT_TRUE(white_parts_have_one_owner(picture, view));

  // The check above is alive: a gap in a line joins two owners.
  for (std::int64_t column = 0; column < picture.width_px; ++column) {
    const auto at = static_cast<std::size_t>(3 * (picture.height_px / 2 * picture.width_px + column));
    std::fill_n(picture.rgb.begin() + static_cast<std::ptrdiff_t>(at), 3, std::uint8_t{255});
  }
  EXPECT_FALSE(white_parts_have_one_owner(picture, view));
}

TEST(Picture, ContourOfADiscIsThin) {
  const Params params = paper_without_noise();
  PictureSpec spec = of_width(220);
  spec.style = PictureStyle::kContours;
  spec.scale_bar = false;
  const Picture picture = *render(found(params, {ball_at(0.0, 0.0, 7.0)}), params, spec);
  std::int64_t lines = 0;
  for (std::int64_t row = 0; row + 1 < picture.height_px; ++row) {
    for (std::int64_t column = 0; column + 1 < picture.width_px; ++column) {
      lines += pixel(picture, row, column) == kBlack;
      ASSERT_FALSE(pixel(picture, row, column) == kBlack && pixel(picture, row, column + 1) == kBlack &&
                   pixel(picture, row + 1, column) == kBlack && pixel(picture, row + 1, column + 1) == kBlack);
    }
  }
  // An 8-connected circle of radius r px has 4 sqrt(2) r pixels.
  EXPECT_NEAR(static_cast<double>(lines), 4.0 * std::sqrt(2.0) * 7.0 / picture.um_per_px, 10.0);
}

TEST(Picture, ScaleBarIsAsLongAsItsLabelSays) {
  const Colony colony = found(paper(), {ball_at(-100.0, 0.0, 7.0), ball_at(100.0, 90.0, 7.0)});
  for (const double um_per_px : {0.17, 0.25, 0.31, 0.5, 0.77, 1.0}) {
    const Picture picture = *render(colony, paper(), of_scale(um_per_px));
    const ScaleBar bar = scale_bar_of(picture);
    EXPECT_LE(bar.length_um, 0.2 * static_cast<double>(picture.width_px) * um_per_px);
    EXPECT_GT(bar.length_um, 0.07 * static_cast<double>(picture.width_px) * um_per_px);
    EXPECT_NEAR(static_cast<double>(bar.length_px) * um_per_px, bar.length_um, 0.5 * um_per_px + 1e-9);
    EXPECT_EQ(std::stod(bar.label), bar.length_um);
    EXPECT_NE(bar.label.find(" µm"), std::string::npos);
    std::int64_t run = 0;
    while (pixel(picture, bar.row, bar.column + run) == kWhite) ++run;
    EXPECT_EQ(run, bar.length_px);
    EXPECT_NE(pixel(picture, bar.row, bar.column - 1), kWhite);
  }
  Picture wide;
  wide.width_px = wide.height_px = 1000;
  for (const auto& [um_per_px, label] :
       {std::pair{0.001, "0.2 µm"}, {0.01, "2 µm"}, {0.3, "50 µm"}, {1.0, "200 µm"}, {5.0, "1 mm"}, {80.0, "10 mm"}}) {
    wide.um_per_px = um_per_px;
    EXPECT_EQ(scale_bar_of(wide).label, label);
  }
}

TEST(Picture, ScaleBarCanBeLeftOut) {
  const Colony colony = found(paper(), {ball_at(0.0, 0.0, 7.0)});
  for (const PictureStyle style : {PictureStyle::kShaded, PictureStyle::kContours}) {
    PictureSpec spec = of_width(300);
    spec.style = style;
    spec.scale_bar = false;
    const Picture picture = *render(colony, paper(), spec);
    const ScaleBar bar = scale_bar_of(picture);
    EXPECT_EQ(pixel(picture, bar.row, bar.column + 5), style == PictureStyle::kShaded ? kDarkBackground : kWhite);
  }
}

TEST(Picture, ColoursFollowTheQuantity) {
  std::vector<Cell> cells = {ball_at(0.0, 0.0, 6.0), ball_at(20.0, 0.0, 6.0), ball_at(40.0, 0.0, 6.0)};
  cells[0].volume_um3 = 500.0, cells[1].volume_um3 = 1500.0, cells[2].volume_um3 = 1000.0;
  cells[0].generation = 4, cells[1].generation = 0, cells[2].generation = 8;
  cells[0].born_h = 0.0, cells[1].born_h = 10.0, cells[2].born_h = 7.5;
  cells[1].activity = Activity::kPassive, cells[2].activity = Activity::kSenescent;
  const Colony colony = found(paper(), cells, 10.0);
  using Colours = std::vector<Rgb>;
  EXPECT_EQ(colour_cells(colony, ColourBy::kActivity).of_cell,
            (Colours{kActiveColour, kPassiveColour, kSenescentColour}));
  EXPECT_EQ(colour_cells(colony, ColourBy::kVolume).of_cell,
            (Colours{map_colour(0.0), map_colour(1.0), map_colour(0.5)}));
  EXPECT_EQ(colour_cells(colony, ColourBy::kGeneration).of_cell,
            (Colours{map_colour(0.5), map_colour(0.0), map_colour(1.0)}));
  EXPECT_EQ(colour_cells(colony, ColourBy::kAge).of_cell,
            (Colours{map_colour(1.0), map_colour(0.0), map_colour(0.25)}));
  EXPECT_EQ(colour_cells(colony, ColourBy::kVolume).scale.low_text, "500 µm³");
  EXPECT_EQ(colour_cells(colony, ColourBy::kVolume).scale.high_text, "1500 µm³");
  EXPECT_EQ(colour_cells(colony, ColourBy::kAge).scale.high_text, "10.0 h");
  EXPECT_EQ(colour_cells(colony, ColourBy::kGeneration).scale.high_text, "8");
}

TEST(Picture, ColourMapRisesInLightness) {
  for (int i = 0; i < 200; ++i) {
    EXPECT_LE(luminance(map_colour(i / 200.0)), luminance(map_colour((i + 1) / 200.0)) + 1.0) << i;
  }
  EXPECT_GT(luminance(map_colour(0.0)), luminance(kDarkBackground) + 25.0);
}

TEST(Picture, TextIsDrawnDotByDot) {
  EXPECT_EQ(text_width_px(""), 0);
  EXPECT_EQ(text_width_px("1"), kGlyphWidth_px);
  EXPECT_EQ(text_width_px("50 µm"), 5 * kGlyphAdvance_px - 1);
  Picture picture;
  picture.width_px = 30;
  picture.height_px = 20;
  picture.rgb.assign(3 * 30 * 20, 0);
  draw_text(picture, 2, 3, "l", 2, kWhite);
  std::string drawn;
  for (std::int64_t row = 2; row < 2 + 2 * kGlyphAscent_px; row += 2) {
    for (std::int64_t column = 3; column < 3 + 2 * kGlyphWidth_px; column += 2) {
      ASSERT_EQ(pixel(picture, row, column), pixel(picture, row + 1, column + 1));
      drawn += pixel(picture, row, column) == kWhite ? '#' : '.';
    }
  }
  EXPECT_EQ(drawn, ".##....#....#....#....#....#...###.");
  draw_text(picture, 15, 25, "µm³", 3, kWhite);  // runs over the edge: cut, not refused
  draw_text(picture, -5, -4, "8", 2, kWhite);
}

TEST(Picture, PngDecodesToTheSamePixelsAndSaysItsScale) {
  const Colony colony = found(paper(), scattered_cells(8, 30.0, 2));
  for (const double um_per_px : {0.11, 0.31, 2.0}) {
    const Picture picture = *render(colony, paper(), of_scale(um_per_px));
    const std::string png = encode_png(picture);
    const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(0), spng_ctx_free);
    ASSERT_EQ(spng_set_png_buffer(context.get(), png.data(), png.size()), 0);
    spng_ihdr header{};
    ASSERT_EQ(spng_get_ihdr(context.get(), &header), 0);
    EXPECT_EQ(header.width, static_cast<std::uint32_t>(picture.width_px));
    EXPECT_EQ(header.height, static_cast<std::uint32_t>(picture.height_px));
    EXPECT_EQ(header.bit_depth, 8);
    EXPECT_EQ(header.color_type, SPNG_COLOR_TYPE_TRUECOLOR);
    std::vector<std::uint8_t> rgb(picture.rgb.size());
    ASSERT_EQ(spng_decode_image(context.get(), rgb.data(), rgb.size(), SPNG_FMT_RGB8, 0), 0);
    EXPECT_EQ(rgb, picture.rgb);
    spng_phys physical{};
    ASSERT_EQ(spng_get_phys(context.get(), &physical), 0);
    EXPECT_EQ(physical.unit_specifier, 1);
    EXPECT_EQ(physical.ppu_x, static_cast<std::uint32_t>(std::lround(1e6 / um_per_px)));
    EXPECT_EQ(physical.ppu_y, physical.ppu_x);
    std::uint8_t intent = 255;
    EXPECT_EQ(spng_get_srgb(context.get(), &intent), 0);
  }
}

}  // namespace
}  // namespace colony
