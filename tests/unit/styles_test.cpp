// Brightfield, phase and labels as pictures; colony outlines apart from cell outlines; strips, threads, large pictures.
#include "engine/picture/styles.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <spng.h>

#include "engine/picture/optics.hpp"
#include "engine/picture/pixels.hpp"
#include "engine/picture/render.hpp"
#include "engine/picture/top_view.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/founding.hpp"
#include "tests/support/scale.hpp"

namespace colony {
namespace {

using testing::ball_at;
using testing::cell_at;
using testing::found;
using testing::paper;
using testing::paper_without_noise;
using testing::scaled;
using testing::scattered_cells;

PictureSpec plain(PictureStyle style, double um_per_px) {
  PictureSpec spec;
  spec.style = style;
  spec.um_per_px = um_per_px;
  spec.scale_bar = false;
  return spec;
}

struct At {
  const Picture& picture;
  Rgb operator()(double x_um, double y_um) const {
    const std::int64_t column = floor_to_int((x_um - picture.left_um) / picture.um_per_px);
    const std::int64_t row = floor_to_int((picture.top_um - y_um) / picture.um_per_px);
    const auto at = static_cast<std::size_t>(3 * (row * picture.width_px + column));
    return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
  }
};

TEST(Brightfield, AbsorbsAlongThePathThroughCytoplasmAndNucleus) {
  Cell cell = ball_at(0.0, 0.0, 8.0);
  cell.centre_um.z() = 10.0;
  cell.nucleus_um = Vec3(-3.0, 0.0, 10.0);
  cell.nucleus_radius_um = 3.0;
  const Params params = paper_without_noise();
  const Picture picture = *render(found(params, {cell}), params, plain(PictureStyle::kBrightfield, 0.05));
  const At at{picture};
  // A column through the centre runs 16 um in cytoplasm; one through the nucleus's centre 6 um of its chord in the nucleus.
  const double chord_um = 2.0 * std::sqrt(64.0 - 9.0);
  for (int colour = 0; colour < 3; ++colour) {
    const auto i = static_cast<std::size_t>(colour);
    const auto value = [&](Rgb rgb) {
      return static_cast<double>(colour == 0 ? rgb.red : colour == 1 ? rgb.green : rgb.blue);
    };
    const double c = kCytoplasmAbsorption_per_um[i], n = kNucleusAbsorption_per_um[i];
    EXPECT_NEAR(value(at(3.0, 0.0)), 255.0 * std::exp(-c * chord_um), 0.6);
    EXPECT_NEAR(value(at(-3.0, 0.0)), 255.0 * std::exp(-c * (chord_um - 6.0) - n * 6.0), 0.6);
  }
  EXPECT_EQ(at(8.2, 0.0), kWhite);
}

TEST(Brightfield, CellsOverEachOtherAbsorbTogether) {
  Cell low = cell_at(0.0, 0.0, Vec3(6.0, 6.0, 3.0)), high = low;
  low.centre_um.z() = 4.0;
  high.centre_um.z() = 12.0;
  for (Cell* cell : {&low, &high})
    cell->nucleus_radius_um = 0.1, cell->nucleus_um = cell->centre_um + Vec3(5.0, 0.0, 0.0);
  const Params params = paper_without_noise();
  const Picture one = *render(found(params, {low}), params, plain(PictureStyle::kBrightfield, 0.1));
  const Picture two = *render(found(params, {low, high}), params, plain(PictureStyle::kBrightfield, 0.1));
  const double once = At{one}(0.0, 0.0).green / 255.0, twice = At{two}(0.0, 0.0).green / 255.0;
  EXPECT_NEAR(twice, once * once, 0.006);
}

TEST(Phase, CellsAreDarkInABrightHalo) {
  const Params params = paper();
  std::vector<Cell> cells = {cell_at(0.0, 0.0, Vec3(9.0, 8.0, 4.0)), cell_at(120.0, 0.0, Vec3(9.0, 8.0, 4.0))};
  const Picture picture = *render(found(params, cells), params, plain(PictureStyle::kPhase, 0.2));
  const At at{picture};
  const int background = at(60.0, 0.0).red;
  EXPECT_EQ(background, 128);  // kPhaseGrey, beyond the kernel's reach
  EXPECT_LT(at(5.0, 0.0).red, background - 30);
  EXPECT_GT(at(11.5, 0.0).red, background + 15);  // just outside the cell
  EXPECT_LT(at(0.0, 0.0).red, at(6.0, 0.0).red);  // the nucleus delays more
}

TEST(Phase, HaloIsTheBlurOfThePhase) {
  // The kernel over the rows and columns of the picture itself, where the coarse raster has pixels of the picture's size or more.
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(6, 20.0, 2));
  const Frame frame{160, 160, 0.5, -40.0, 40.0};
  const PathView view = path_lengths(colony, params.contact.rule, frame, {0, 160});
  const std::vector<float> intensity = phase_contrast(colony, params.contact.rule, view);
  const auto phase = [&](std::int64_t row, std::int64_t column) {
    if (row < 0 || row >= 160 || column < 0 || column >= 160) return 0.0;
    const std::size_t at = view.index(row, column);
    return phase_rad(static_cast<double>(view.cell_um[at]), static_cast<double>(view.nucleus_um[at]));
  };
  double brightest = 0.0, darkest = 1.0;
  for (std::int64_t row = 30; row < 130; row += scaled<std::int64_t>(13, 3)) {
    for (std::int64_t column = 30; column < 130; column += scaled<std::int64_t>(13, 3)) {
      double sum = 0.0, weights = 0.0;
      for (std::int64_t dy = -24; dy <= 24; ++dy) {
        for (std::int64_t dx = -24; dx <= 24; ++dx) {
          const double weight =
              std::exp(-0.5 * 0.25 * static_cast<double>(dx * dx + dy * dy) / (kHaloSigma_um * kHaloSigma_um));
          sum += weight * phase(row + dy, column + dx);
          weights += weight;
        }
      }
      const double truth = std::clamp(kPhaseGrey + kPhaseGain_per_rad * (sum / weights - phase(row, column)), 0.0, 1.0);
      ASSERT_NEAR(static_cast<double>(intensity[view.index(row, column)]), truth, 0.004);
      brightest = std::max(brightest, truth);
      darkest = std::min(darkest, truth);
    }
  }
  EXPECT_GT(brightest - darkest, 0.3);
}

TEST(Labels, ColoursAreIdsAndBack) {
  std::set<std::uint32_t> colours;
  for (std::uint32_t id = 0; id < 100'000; ++id) {
    const std::uint32_t colour = label_colour(CellId{id});
    ASSERT_LT(colour, 1U << 24);
    ASSERT_TRUE(id == 0 || (colour & 0x808080U) != 0) << "nearly black: " << id;
    ASSERT_EQ(label_of_colour(colour).value, id);
    colours.insert(colour);
  }
  EXPECT_EQ(colours.size(), 100'000u);
  EXPECT_EQ(label_colour(CellId{0}), 0u);
  for (const std::uint32_t id : {kLabelColours - 1, kLabelColours / 2}) EXPECT_EQ(label_of_colour(label_colour(CellId{id})).value, id);
  for (const std::uint32_t dark : {0x7F7F7FU, 0x010000U, 0x00007FU}) EXPECT_EQ(label_of_colour(dark).value, 0u);
  // As the comment in render.hpp says it, for who reads a picture without this program: id 1 is number 9,072,779.
  const std::uint32_t number = 9'072'779, high = (number >> 21) + 1;
  EXPECT_EQ(label_colour(CellId{1}), ((high >> 2 & 1U) << 7 | (number >> 14 & 127U)) << 16 | ((high >> 1 & 1U) << 7 | (number >> 7 & 127U)) << 8 |
                                         (high & 1U) << 7 | (number & 127U));
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(20, 40.0, 3));
  PictureSpec spec = plain(PictureStyle::kLabels, 0.2);
  spec.scale_bar = true;  // no bar: it would be a cell
  const Picture picture = *render(colony, params, spec);
  const TopView view = top_view(colony, *frame_of(colony, spec));
  for (std::size_t i = 0; i < view.owner.size(); ++i) {
    const std::uint32_t rgb = static_cast<std::uint32_t>(picture.rgb[3 * i]) << 16 |
                              static_cast<std::uint32_t>(picture.rgb[3 * i + 1]) << 8 | picture.rgb[3 * i + 2];
    ASSERT_EQ(label_of_colour(rgb).value, view.owner[i]);
  }
}

TEST(Labels, AreasAreThoseOfSobolPoints) {
  // Visible area: the share of points of the plane above which this cell reaches highest.
  const Params params = paper();
  // Few cells and many points: 1 % of an area takes some thousand hits.
  const Colony colony = found(params, scattered_cells(scaled(5, 12), scaled(18.0, 30.0), 5));
  const TopView view = top_view(colony, *frame_of(colony, plain(PictureStyle::kLabels, 0.05)));
  std::vector<double> areas_um2(colony.cells().size() + 1, 0.0);
  for (const std::uint32_t owner : view.owner) areas_um2[owner] += view.frame.um_per_px * view.frame.um_per_px;

  const PointSet points = testing::points(scaled(16384u, 65536u), 4);
  std::vector<double> hits(areas_um2.size(), 0.0);
  const double width_um = static_cast<double>(view.frame.width_px) * view.frame.um_per_px;
  const double height_um = static_cast<double>(view.frame.height_px) * view.frame.um_per_px;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = view.frame.left_um + static_cast<double>(points.x[i]) * width_um;
    const double y = view.frame.top_um - static_cast<double>(points.y[i]) * height_um;
    double highest_um = 0.0;
    std::uint32_t owner = 0;
    for (const Cell& cell : colony.cells()) {
      const Body& body = colony.body(cell.id);
      const Box box = body.box();
      if (x < box.low.x() || x > box.high.x() || y < box.low.y() || y > box.high.y()) continue;
      for (double z = box.high.z(); z > highest_um; z -= 0.02) {
        if (!body.contains({x, y, z})) continue;
        highest_um = z;
        owner = cell.id.value;
        break;
      }
    }
    hits[owner] += 1.0;
  }
  const double share_um2 = width_um * height_um / static_cast<double>(points.size());
  int compared = 0;
  double worst = 0.0;
  for (std::size_t id = 1; id < areas_um2.size(); ++id) {
    if (areas_um2[id] < 20.0) continue;  // a few hits say nothing
    ++compared;
    worst = std::max(worst, std::abs(hits[id] * share_um2 / areas_um2[id] - 1.0));
    EXPECT_NEAR(areas_um2[id], hits[id] * share_um2, 0.01 * areas_um2[id]) << id;
  }
  EXPECT_GE(compared, 4);
  std::printf("figure: label areas of %d cells within %.2f %% of %zu Sobol points\n", compared, 100.0 * worst, points.size());
}

TEST(Contours, OutlineAndWallsAreApart) {
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(20, 34.0, 3));
  PictureSpec spec = plain(PictureStyle::kContours, 0.2);
  const auto drawn = [&](ContourLines lines) {
    spec.contour_lines = lines;
    return *render(colony, params, spec);
  };
  const Picture both = drawn(ContourLines::kBoth), outline = drawn(ContourLines::kColony),
                walls = drawn(ContourLines::kCells);
  const TopView view = top_view(colony, *frame_of(colony, spec));
  std::size_t outline_count = 0, wall_count = 0;
  for (std::int64_t row = 1; row + 1 < view.frame.height_px; ++row) {
    for (std::int64_t column = 1; column + 1 < view.frame.width_px; ++column) {
      const auto at = [&](std::int64_t r, std::int64_t c) { return view.owner[view.index(r, c)]; };
      const std::uint32_t owner = at(row, column);
      const std::uint32_t around[4] = {at(row - 1, column), at(row + 1, column), at(row, column - 1),
                                       at(row, column + 1)};
      const bool rim = owner != 0 && std::any_of(around, around + 4, [](std::uint32_t o) { return o == 0; });
      const bool wall = std::any_of(around, around + 4, [&](std::uint32_t o) { return o != 0 && o < owner; });
      const std::size_t i = 3 * view.index(row, column);
      ASSERT_EQ(outline.rgb[i] == 0, rim);
      ASSERT_EQ(walls.rgb[i] == 0, wall);
      ASSERT_EQ(both.rgb[i] == 0, rim || wall);
      outline_count += rim ? 1 : 0;
      wall_count += wall ? 1 : 0;
    }
  }
  EXPECT_GT(outline_count, 300u);
  EXPECT_GT(wall_count, 300u);
}

constexpr PictureStyle kStyles[] = {PictureStyle::kShaded, PictureStyle::kContours, PictureStyle::kBrightfield,
                                    PictureStyle::kPhase, PictureStyle::kLabels};

TEST(Strips, ThreadsCannotMatterInAnyStyle) {
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(8, 14.0, 7));
  for (const PictureStyle style : kStyles) {
    PictureSpec spec = plain(style, 0.1);
    spec.scale_bar = true;
    const Picture one = *render(colony, params, spec);
    ASSERT_GT(one.height_px, 256);  // more than one strip
    for (const int threads : {2, 7}) EXPECT_EQ(render(colony, params, spec, Effort{threads, nullptr})->rgb, one.rgb);
  }
}

TEST(Strips, PngByStripsDecodesToTheSamePixels) {
  const Params params = paper();
  const Colony colony = found(params, scattered_cells(8, 14.0, 7));
  for (const PictureStyle style : kStyles) {
    PictureSpec spec = plain(style, 0.1);
    spec.scale_bar = true;
    const Picture picture = *render(colony, params, spec);
    std::string bytes;
    std::size_t pieces = 0;
    ASSERT_TRUE(render_png(colony, params, spec, Effort{2, nullptr},
                           [&](std::string_view piece) { bytes += piece, ++pieces; }));
    EXPECT_GT(pieces, 2u);
    const std::unique_ptr<spng_ctx, void (*)(spng_ctx*)> context(spng_ctx_new(0), spng_ctx_free);
    ASSERT_EQ(spng_set_png_buffer(context.get(), bytes.data(), bytes.size()), 0);
    std::vector<std::uint8_t> rgb(picture.rgb.size());
    ASSERT_EQ(spng_decode_image(context.get(), rgb.data(), rgb.size(), SPNG_FMT_RGB8, 0), 0);
    EXPECT_EQ(rgb, picture.rgb);
  }
  struct Full {};
  const auto full = [](std::string_view) { throw Full(); };
  EXPECT_THROW(static_cast<void>(render_png(colony, params, plain(PictureStyle::kLabels, 0.1), Effort{}, full)), Full);
}

TEST(Strips, TwentyThousandPixelsAreTheEnd) {
  const Params params = paper();
  const Colony colony = found(params, {ball_at(0.0, 0.0, 7.0), ball_at(10.0, 0.0, 7.0)});
  PictureSpec spec;
  spec.style = PictureStyle::kBrightfield;
  spec.width_px = 20000;
  EXPECT_EQ(frame_of(colony, spec).error().fields.at(0).pointer, "width_px");
  spec.side_max_px = 20001;
  EXPECT_EQ(frame_of(colony, spec).error().fields.at(0).pointer, "side_max_px");
  spec.side_max_px = kRasterSideMax_px;
  ASSERT_TRUE(frame_of(colony, spec));
  // Strips of the whole width come one by one, and a caller can stop in the middle.
  spec.width_px = scaled<std::int64_t>(4200, 20000);
  std::int64_t rows = 0;
  ASSERT_TRUE(render_strips(colony, params, spec, Effort{2, nullptr}, [&](const Picture& strip) {
    EXPECT_EQ(strip.first_row, rows);
    rows += static_cast<std::int64_t>(strip.rgb.size()) / (3 * strip.width_px);
    EXPECT_LE(strip.rgb.size(), 20000u * 256u * 3u);
  }));
  EXPECT_EQ(rows, frame_of(colony, spec)->height_px);
}

}  // namespace
}  // namespace colony
