// Volumes by Sobol and by Monte Carlo points; what the contact rules leave of cells and of the plane between them.
#include <algorithm>
#include <cmath>

#include "engine/base/maths.hpp"
#include "engine/growth/search.hpp"
#include "engine/random/sobol.hpp"
#include "tests/bench/evidence.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/runs.hpp"

namespace colony::bench {
namespace {

// Relative root mean square error of the volume of a ball in its own box.
double volume_error(std::uint32_t n, bool sobol, int repeats) {
  double squares = 0.0;
  for (int k = 0; k < repeats; ++k) {
    PointSet points;
    Stream stream(20'001, CellId{static_cast<std::uint32_t>(k + 1)}, 0, Purpose::kSearchPoints);
    if (sobol) points = testing::points(n, static_cast<std::uint32_t>(k + 1));
    std::uint32_t hits = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      double r2 = 0.0;
      for (int axis = 0; axis < 3; ++axis) {
        const float unit = !sobol      ? static_cast<float>(stream.uniform())
                           : axis == 0 ? points.x[i]
                           : axis == 1 ? points.y[i]
                                       : points.z[i];
        const double x = 2.0 * static_cast<double>(unit) - 1.0;
        r2 += x * x;
      }
      hits += r2 <= 1.0 ? 1 : 0;
    }
    const double error = hits / (n * maths::kPi / 6.0) - 1.0;
    squares += error * error / repeats;
  }
  return std::sqrt(squares);
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace

void print_volume_error(const EvidenceSize& size) {
  const int repeats = size.of(200, 2000);
  std::printf(
      "\nRelative RMS error of a ball's volume, %d scramblings\n\n| points | Sobol, %% | Monte Carlo, %% |\n| --- | "
      "--- | --- |\n",
      repeats);
  std::vector<double> logs, sobol, random;
  for (std::uint32_t n = 64; n <= 4096; n *= 2) {
    const double s = volume_error(n, true, repeats), m = volume_error(n, false, repeats);
    std::printf("| %u | %.2f | %.2f |\n", n, 100.0 * s, 100.0 * m);
    logs.push_back(std::log(n));
    sobol.push_back(std::log(s));
    random.push_back(std::log(m));
  }
  std::printf("| slope in log-log | %.3f | %.3f |\n", testing::fit_line(logs, sobol).slope,
              testing::fit_line(logs, random).slope);
}

void print_contact(const EvidenceSize& size) {
  const int seed_count = size.of(3, 20);
  std::printf(
      "\nContact, preset paper at 300 cells, %d seeds, 4,096 points a cell: share of its volume that a cell retains "
      "beside its neighbours; "
      "share of the union's volume that belongs to nobody\n\n| rule | deformed volume, um3 | retained: mean | 5 %% "
      "quantile | least | void, %% |\n"
      "| --- | --- | --- | --- | --- | --- |\n",
      seed_count);
  for (const ContactRule rule : {ContactRule::kSum, ContactRule::kMax}) {
    std::vector<std::vector<double>> retained(static_cast<std::size_t>(seed_count)), volumes(retained.size());
    std::vector<double> voids(retained.size());
    for_each_slot(seed_count, [&](int k) {
      const auto slot = static_cast<std::size_t>(k);
      Params params;
      params.contact.rule = rule;
      const testing::Run run = testing::run(testing::spec_of(static_cast<Seed>(7001 + k), 300, params));
      const Colony& colony = run.colony();
      double open = 0.0, covered = 0.0;  // um3: nobody's; under any body
      OverlapScratch scratch;
      for (const Cell& cell : colony.cells()) {
        const PointSet points = testing::points(4096, cell.id.value);
        const Body& body = colony.body(cell.id);
        const std::vector<const Body*> near = testing::neighbours_of(colony, cell.id);
        const MassEstimate pressed = deformed_mass(body, near, rule, points, scratch);
        const MassEstimate alone = deformed_mass(body, {}, rule, points, scratch);
        retained[slot].push_back(alone.hit_count > 0 ? static_cast<double>(pressed.hit_count) / alone.hit_count : 1.0);
        volumes[slot].push_back(pressed.volume_um3);
        // A point under m bodies counts 1/m in each of them: the union, and no point twice. It is nobody's where even
        // the largest of their fields is less than the others' sum (rule `sum`; with `max` the largest always holds
        // it).
        double share = 0.0, nobody = 0.0;
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Vec3 p = placed_um(body.box(), points, i);
          if (!body.contains(p)) continue;
          double largest = body.field(p), sum = largest;
          int holders = 1;
          for (const Body* other : near) {
            if (!other->contains(p)) continue;
            const double field = other->field(p);
            largest = std::max(largest, field);
            sum += field;
            ++holders;
          }
          share += 1.0 / holders;
          if (rule == ContactRule::kSum && largest < sum - largest) nobody += 1.0 / holders;
        }
        covered += body.box().volume() * share / static_cast<double>(points.size());
        open += body.box().volume() * nobody / static_cast<double>(points.size());
      }
      voids[slot] = 100.0 * open / covered;
    });
    std::vector<double> all, volume;
    for (const std::vector<double>& each : retained) all.insert(all.end(), each.begin(), each.end());
    for (const std::vector<double>& each : volumes) volume.insert(volume.end(), each.begin(), each.end());
    std::printf("| %s | %s | %s | %.3f | %.3f | %s |\n", rule == ContactRule::kSum ? "sum" : "max",
                text_of(testing::mean_of(volume), 1).c_str(), text_of(testing::mean_of(all), 3).c_str(),
                quantile(all, 0.05), quantile(all, 0.0), text_of(testing::mean_of(voids), 2).c_str());
  }
}

}  // namespace colony::bench
