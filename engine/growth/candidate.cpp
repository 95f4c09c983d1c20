#include "engine/growth/candidate.hpp"

#include <algorithm>
#include <cmath>

#include "engine/base/check.hpp"
#include "engine/base/maths.hpp"

namespace colony {
namespace {

constexpr double kRadiansPerDegree = maths::kPi / 180.0;

float f(double value) { return static_cast<float>(value); }

}  // namespace

GeneTables::GeneTables(const Params& params)
    : layers_(params.layers), noisy_scale_(f(std::sqrt(1.0 + noise_bound(params.noise)))) {
  const int bits = static_cast<int>(params.search.bits);
  Chromosome one(gene_count_of(params.layers), bits);
  const auto column = [&](const auto& value_of, auto& out) {
    for (std::uint32_t code = 0; code < (1U << bits); ++code) {
      one.set_code(0, code);
      out.push_back(value_of(one.value(0, params.search.coding)));
    }
  };
  const auto on = [](const Interval& range, double x) { return range.low + (range.high - range.low) * x; };
  const auto symmetric = [](double half_range, double x) { return half_range * (2.0 * x - 1.0); };
  const auto cos_sin = [](double angle_rad) {
    const auto [s, c] = maths::sincos(angle_rad);
    return Two{f(c), f(s)};
  };
  column([&](double x) { return cos_sin(symmetric(params.search.turn_max_deg * kRadiansPerDegree, x)); }, turn_);
  column([&](double x) { return f(maths::cbrt(3.0 * on(params.cell.pair_volume_um3, x) / (4.0 * maths::kPi))); }, pair_volume_);
  column([&](double x) {
    const double smaller = on(params.cell.smaller_share, x);
    return Two{f(maths::cbrt(1.0 - smaller)), f(maths::cbrt(smaller))};
  }, smaller_share_);
  column([&](double x) {
    const double root = std::sqrt(on(params.cell.elongation, x));
    return Two{f(root), f(1.0 / root)};
  }, elongation_);
  column([&](double x) {
    const double flatness = on(params.cell.flatness, x);
    return Flatness{f(1.0 / maths::cbrt(flatness)), f(flatness), f(1.0 / flatness)};
  }, flatness_);
  column([&](double x) { return cos_sin(maths::kPi * x); }, rotation_);
  column([&](double x) { return cos_sin(symmetric(params.search.tilt_max_deg * kRadiansPerDegree, x)); }, tilt_);
  column([&](double x) { return f(on(params.search.distance, x)); }, distance_);
  column([&](double x) { return f(symmetric(params.search.sideways, x)); }, sideways_);
  column([&](double x) { return f(height_above_dish(1.0, layers_, x)); }, height_);
}

void GeneTables::decode(const Chromosome& chromosome, const PairFrame& frame, std::array<kernel::CandidateBody, 2>& pair) const {
  const auto code = [&](int gene) { return chromosome.code(gene); };
  const Two turn = turn_[code(kTurn)];
  const float nx = turn.first * f(frame.direction.x()) - turn.second * f(frame.direction.y());
  const float ny = turn.second * f(frame.direction.x()) + turn.first * f(frame.direction.y());
  const float nz = f(frame.direction.z());
  const float length = layers_ == Layers::kMono ? 1.0F : std::sqrt(nx * nx + ny * ny);
  const float across_x = length > 1e-9F ? -ny / length : 1.0F;
  const float across_y = length > 1e-9F ? nx / length : 0.0F;
  const Two share = smaller_share_[code(kSmallerShare)];
  const float volume = pair_volume_[code(kPairVolume)];

  for (int k = 0; k < 2; ++k) {
    const int first = kFirstOfBody + k * kBodyGeneCount;
    const Two elongation = elongation_[code(first + kElongation)];
    const Flatness flatness = flatness_[code(first + kFlatness)];
    const float mean = volume * (k == 0 ? share.first : share.second) * flatness.mean;
    const float a = mean * elongation.first;
    const float b = mean * elongation.second;
    const float c = mean * flatness.flatness;
    const Two rotation = rotation_[code(first + kRotation)];
    const Two tilt_x = tilt_[code(first + kTiltX)];
    const Two tilt_y = tilt_[code(first + kTiltY)];

    // Rotation = about z * about x * about y, column by column.
    const float xx = tilt_y.first, xy = tilt_x.second * tilt_y.second, xz = -tilt_x.first * tilt_y.second;
    const float yy = tilt_x.first, yz = tilt_x.second;
    const float zx = tilt_y.second, zy = -tilt_x.second * tilt_y.first, zz = tilt_x.first * tilt_y.first;
    const float cos = rotation.first, sin = rotation.second;
    const float rotated[9] = {cos * xx - sin * xy, -sin * yy, cos * zx - sin * zy,   //
                              sin * xx + cos * xy, cos * yy,  sin * zx + cos * zy,   //
                              xz,                  yz,        zz};
    kernel::CandidateBody& body = pair[static_cast<std::size_t>(k)];
    const float semiaxes[3] = {a, b, c};
    const float inverse_mean = 1.0F / mean;
    const float inverse[3] = {inverse_mean * elongation.second, inverse_mean * elongation.first, inverse_mean * flatness.inverse};
    float width2 = 0.0F;
    for (int i = 0; i < 3; ++i) {
      for (int row = 0; row < 3; ++row) {
        body.axes[3 * row + i] = rotated[3 * row + i] * semiaxes[i];
        body.field.m[3 * i + row] = rotated[3 * row + i] * inverse[i];
      }
      const float along = body.axes[i] * nx + body.axes[3 + i] * ny + body.axes[6 + i] * nz;
      width2 += along * along;
    }
    const float along_n = (k == 0 ? -1.0F : 1.0F) * distance_[code(first + kDistance)] * std::sqrt(width2);
    const float across_n = sideways_[code(first + kSideways)] * mean;
    body.centre[0] = along_n * nx + across_n * across_x;
    body.centre[1] = along_n * ny + across_n * across_y;
    const float height = layers_ == Layers::kMono ? height_.front() : height_[code(kFirstHeight + k)];
    body.centre[2] = height * c - f(frame.pivot_um.z());
    for (int i = 0; i < 3; ++i) {
      const float* m = body.field.m + 3 * i;
      body.field.t[i] = -((m[0] * body.centre[0] + m[1] * body.centre[1]) + m[2] * body.centre[2]);
    }
    // In a monolayer the longest axis lies nearly flat; no point is further from the centre than it.
    const float away = std::sqrt(body.centre[0] * body.centre[0] + body.centre[1] * body.centre[1]);
    body.reach = away + noisy_scale_ * std::max({a, b, c});
  }
}

}  // namespace colony
