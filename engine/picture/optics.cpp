#include "engine/picture/optics.hpp"

#include <algorithm>

#include "engine/base/maths.hpp"
#include "engine/picture/pixels.hpp"

namespace colony {
namespace {

constexpr double kPitchPerSigma = 1.0 / 6.0;
constexpr double kReachPerSigma = 3.0;

/// The coarse raster of K * phi that some rows of a frame need.
struct Halo {
  std::int64_t pixels = 1;      // of the frame in one of the raster
  std::int64_t reach = 0;       // of the kernel, coarse pixels
  Frame frame;                  // of phi: wider than the picture by reach + 1 on each side
  std::vector<double> weights;  // -reach..reach, sum 1

  explicit Halo(const Frame& picture) {
    pixels = std::max<std::int64_t>(1, floor_to_int(kHaloSigma_um * kPitchPerSigma / picture.um_per_px));
    frame.um_per_px = static_cast<double>(pixels) * picture.um_per_px;
    reach = ceil_to_int(kReachPerSigma * kHaloSigma_um / frame.um_per_px);
    const auto coarse = [&](std::int64_t side_px) { return (side_px + pixels - 1) / pixels + 2 * (reach + 1); };
    frame.width_px = coarse(picture.width_px);
    frame.height_px = coarse(picture.height_px);
    frame.left_um = picture.left_um - static_cast<double>(reach + 1) * frame.um_per_px;
    frame.top_um = picture.top_um + static_cast<double>(reach + 1) * frame.um_per_px;
    double sum = 0.0;
    for (std::int64_t i = -reach; i <= reach; ++i) {
      const double sigmas = static_cast<double>(i) * frame.um_per_px / kHaloSigma_um;
      weights.push_back(maths::exp(-0.5 * std::min(sigmas * sigmas, 1400.0)));
      sum += weights.back();
    }
    for (double& weight : weights) weight /= sum;
  }
  /// Where a pixel's centre lies between the centres of the coarse raster's rows (or columns).
  double position(std::int64_t pixel) const {
    return (static_cast<double>(pixel) + 0.5) / static_cast<double>(pixels) - 0.5 + static_cast<double>(reach + 1);
  }
};

struct Blurred {
  std::int64_t first_row = 0;
  std::int64_t width_px = 0;
  std::vector<float> values;
  double at(double row, double column) const {
    const std::int64_t r = floor_to_int(row), c = floor_to_int(column);
    const double down = row - static_cast<double>(r), right = column - static_cast<double>(c);
    const float* upper = values.data() + (r - first_row) * width_px + c;
    const float* lower = upper + width_px;
    const double top =
        static_cast<double>(upper[0]) + right * (static_cast<double>(upper[1]) - static_cast<double>(upper[0]));
    const double bottom =
        static_cast<double>(lower[0]) + right * (static_cast<double>(lower[1]) - static_cast<double>(lower[0]));
    return top + down * (bottom - top);
  }
};

/// K * phi on the coarse rows that the picture's `rows` lie between.
Blurred blurred_phase(const Colony& colony, ContactRule rule, const Halo& halo, RowRange rows, const Effort& effort) {
  const RowRange out{floor_to_int(halo.position(rows.first)), floor_to_int(halo.position(rows.end - 1)) + 2};
  const RowRange in{out.first - halo.reach, out.end + halo.reach};
  const PathView paths = path_lengths(colony, rule, halo.frame, in, effort);
  const std::int64_t width = halo.frame.width_px;
  const auto taps = static_cast<std::int64_t>(halo.weights.size());
  std::vector<float> along(paths.cell_um.size(), 0.0F);
  for_each_piece(static_cast<std::size_t>(in.end - in.first), effort, [&](std::size_t index) {
    const float* cell = paths.cell_um.data() + static_cast<std::int64_t>(index) * width;
    const float* nucleus = paths.nucleus_um.data() + static_cast<std::int64_t>(index) * width;
    std::vector<double> phase(static_cast<std::size_t>(width));
    for (std::size_t c = 0; c < phase.size(); ++c)
      phase[c] = phase_rad(static_cast<double>(cell[c]), static_cast<double>(nucleus[c]));
    float* to = along.data() + static_cast<std::int64_t>(index) * width;
    for (std::int64_t c = halo.reach; c < width - halo.reach; ++c) {
      double sum = 0.0;
      for (std::int64_t i = 0; i < taps; ++i)
        sum += halo.weights[static_cast<std::size_t>(i)] * phase[static_cast<std::size_t>(c - halo.reach + i)];
      to[c] = static_cast<float>(sum);
    }
  });
  Blurred blurred;
  blurred.first_row = out.first;
  blurred.width_px = width;
  blurred.values.assign(static_cast<std::size_t>((out.end - out.first) * width), 0.0F);
  for_each_piece(static_cast<std::size_t>(out.end - out.first), effort, [&](std::size_t index) {
    std::vector<double> sums(static_cast<std::size_t>(width), 0.0);
    for (std::int64_t i = 0; i < taps; ++i) {
      const float* from = along.data() + (static_cast<std::int64_t>(index) + i) * width;
      const double weight = halo.weights[static_cast<std::size_t>(i)];
      for (std::size_t c = 0; c < sums.size(); ++c) sums[c] += weight * static_cast<double>(from[c]);
    }
    float* to = blurred.values.data() + static_cast<std::int64_t>(index) * width;
    for (std::size_t c = 0; c < sums.size(); ++c) to[c] = static_cast<float>(sums[c]);
  });
  return blurred;
}

}  // namespace

double transmission(int colour, double cell_um, double nucleus_um) {
  const auto at = static_cast<std::size_t>(colour);
  const double depth =
      kCytoplasmAbsorption_per_um[at] * (cell_um - nucleus_um) + kNucleusAbsorption_per_um[at] * nucleus_um;
  return maths::exp(-std::min(depth, 700.0));
}

double phase_rad(double cell_um, double nucleus_um) {
  return 2.0 * maths::kPi / kWavelength_um *
         (kCytoplasmIndexExcess * (cell_um - nucleus_um) + kNucleusIndexExcess * nucleus_um);
}

std::vector<float> phase_contrast(const Colony& colony, ContactRule rule, const PathView& view, const Effort& effort) {
  std::vector<float> intensity(view.cell_um.size(), static_cast<float>(kPhaseGrey));
  if (intensity.empty()) return intensity;
  const Halo halo(view.frame);
  const Blurred blurred = blurred_phase(colony, rule, halo, view.rows, effort);
  for_each_piece(static_cast<std::size_t>(view.rows.end - view.rows.first), effort, [&](std::size_t index) {
    const std::int64_t row = view.rows.first + static_cast<std::int64_t>(index);
    const double coarse_row = halo.position(row);
    for (std::int64_t column = 0; column < view.frame.width_px; ++column) {
      const std::size_t at = view.index(row, column);
      const double phase = phase_rad(static_cast<double>(view.cell_um[at]), static_cast<double>(view.nucleus_um[at]));
      const double lifted = kPhaseGrey + kPhaseGain_per_rad * (blurred.at(coarse_row, halo.position(column)) - phase);
      intensity[at] = static_cast<float>(std::clamp(lifted, 0.0, 1.0));
    }
  });
  return intensity;
}

}  // namespace colony
