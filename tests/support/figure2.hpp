// figure2: the paper's figure 2, box counting of the contours of a colony of 180 cells, as the service measures it: test and evidence share it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/api/analyse.hpp"
#include "server/api/measure.hpp"
#include "tests/support/image_scenes.hpp"
#include "tests/support/runs.hpp"

namespace colony::testing {

/// The lines of one picture beside its controls, and what is said about them.
struct CountedPicture {
  std::string name;
  std::uint64_t cell_count = 0;
  double cell_area_mean_px = 0.0;
  LineReport lines;
  std::vector<ControlReport> controls;
  LineFindings findings;
  std::vector<std::string> verdict;
  ObjectKind objects = ObjectKind::kCells;
  double object_cover = 0.0;
};

/// Preset `paper`, grown to 180 cells.
inline CountedPicture simulated_180(Seed seed, std::int64_t width_px, int threads) {
  const Run grown = run(spec_of(seed, 180, *preset("paper")));
  server::ColonyAt at{std::make_shared<Colony>(grown.colony()), std::make_shared<RunSpec>(grown.simulator.spec()), grown.colony().time_h(),
                      grown.colony().digest()};
  PictureSpec spec;
  spec.width_px = width_px;
  spec.side_max_px = server::api::kMeasuredSideMax_px;
  const Effort effort{threads, nullptr};
  const auto image = server::api::label_colony(*at.colony, spec, effort);
  CHECK(static_cast<bool>(image));
  auto report = server::api::measure_colony(at, *image, effort);
  CHECK(static_cast<bool>(report));
  return {"simulated, seed " + std::to_string(seed), report->cell_count, report->cell_area_mean_px, report->lines, report->controls, report->findings,
          report->verdict, report->objects, report->object_cover};
}

struct RealPicture {
  const char* file;
  Pipeline pipeline;
};
/// Of the first it is known that they are nuclei. Actin shows borders of cells, so its regions are what can be counted; the others are left to choose.
inline constexpr RealPicture kRealPictures[] = {{"ht29_nuclei_d0.tif", Pipeline::kNuclei},
                                                {"ht29_actin_d2.tif", Pipeline::kPhase},
                                                {"phantast_demo_colony_edge.tif", Pipeline::kAuto},
                                                {"h3122_clonogenic_frame01.tif", Pipeline::kAuto},
                                                {"h3122_clonogenic_frame15.tif", Pipeline::kAuto}};

/// As POST /v1/analyses does; nothing where the file is not there.
inline std::optional<CountedPicture> real_picture(const RealPicture& picture, int threads) {
  const auto file = real_file(picture.file);
  if (!file) return std::nullopt;
  server::api::ImageOptions options;
  options.pipeline = picture.pipeline;
  auto measured = server::api::measure_picture(*file, options, {threads, nullptr});
  CHECK(static_cast<bool>(measured));
  return CountedPicture{picture.file, measured->object_count, measured->object_area_mean_px, measured->lines, measured->controls, measured->findings,
                        measured->verdict, measured->objects, measured->object_cover};
}

}  // namespace colony::testing
