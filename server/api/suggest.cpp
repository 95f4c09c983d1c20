#include "server/api/suggest.hpp"

#include <algorithm>
#include <vector>

namespace colony::server::api {
namespace {

constexpr std::size_t kNameLengthMax = 64;  // longer ones are not near any name of ours; bounds the work

// Levenshtein distance.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

bool one_begins_with_other(std::string_view a, std::string_view b) {
  return std::min(a.size(), b.size()) >= 4 && (a.starts_with(b) || b.starts_with(a));
}

}  // namespace

std::string suggestion(std::string_view wrong, std::span<const std::string_view> known) {
  if (wrong.empty() || wrong.size() > kNameLengthMax) return {};
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(2, wrong.size() / 3) + 1;
  for (const std::string_view name : known) {
    // "mean_h" for "cycle_mean_h" and "mean": the part that was left out or put in is no misspelling.
    std::size_t d = distance(wrong, name);
    if (one_begins_with_other(wrong, name)) d = std::min<std::size_t>(d, 2);
    if (d < best_distance && d < std::max(wrong.size(), name.size())) {
      best = name;
      best_distance = d;
    }
  }
  return best.empty() ? std::string() : ", did you mean " + std::string(best) + "?";
}

}  // namespace colony::server::api
