// The paper's figure 2: what box counting gives for a simulated colony and for photographs, with controls, and what follows.
#include <cstdio>

#include "tests/bench/evidence.hpp"
#include "tests/support/figure2.hpp"

namespace colony::bench {
namespace {

using testing::CountedPicture;

std::string value_of(const MeasuredLine& line) { return line.dimensions ? with_error(line.dimensions->capacity) : "none"; }

void print_row(const CountedPicture& picture, const char* name, MeasuredLine LineReport::* which, const LineFinding& finding) {
  const MeasuredLine& line = picture.lines.*which;
  std::printf("| %s, %d %s, cover %.2f | %s | ", picture.name.c_str(), static_cast<int>(picture.cell_count), std::string(name_of(picture.objects)).c_str(),
              picture.object_cover, name);
  if (line.dimensions) {
    std::printf("%s | %.3f | %d to %d | %.2f to %.2f, %.2f of %.2f | %s |", value_of(line).c_str(), line.dimensions->capacity.r2,
                static_cast<int>(line.dimensions->side_min_px), static_cast<int>(line.dimensions->side_max_px), finding.slopes.first,
                finding.slopes.last, finding.slopes.plateau_decades, finding.slopes.decades, std::string(name_of(finding.finding)).c_str());
  } else {
    std::printf("none | | | | |");
  }
  for (const char* wanted : {"without_noise", "hexagonal", "random_discs"}) {
    std::string text = "-";
    for (const ControlReport& control : picture.controls) {
      if (control.name == wanted) text = value_of(control.lines.*which);
    }
    std::printf(" %s |", text.c_str());
  }
  std::printf("\n");
}

}  // namespace

void print_figure2(const EvidenceSize& size) {
  std::vector<CountedPicture> pictures;
  for (int seed = 1; seed <= size.of(1, 4); ++seed) {
    pictures.push_back(testing::simulated_180(static_cast<Seed>(seed), server::api::kMeasuredWidthDefault_px, kEvidenceThreads));
  }
  for (const testing::RealPicture& picture : testing::kRealPictures) {
    if (auto counted = testing::real_picture(picture, kEvidenceThreads)) {
      pictures.push_back(std::move(*counted));
    } else {
      std::printf("\n%s is not there: COLONY_DATA names the folder\n", picture.file);
    }
  }
  std::printf("\nBox counting of contours beside their controls; local slopes: of small and of large boxes, decades alike of decades counted\n\n"
              "| picture | line | D0 | r2 | boxes, px | local slopes | finding | without noise | hexagonal | random discs |\n"
              "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const CountedPicture& picture : pictures) {
    print_row(picture, "walls", &LineReport::walls, picture.findings.walls);
    print_row(picture, "outline", &LineReport::outline, picture.findings.outline);
  }
  for (const CountedPicture& picture : pictures) {
    std::printf("\n%s:\n", picture.name.c_str());
    for (const std::string& sentence : picture.verdict) std::printf("- %s\n", sentence.c_str());
  }
}

}  // namespace colony::bench
