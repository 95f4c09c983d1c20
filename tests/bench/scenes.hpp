// scenes: the colonies that speed is judged by.
// Threads: pure.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "engine/sim/simulator.hpp"

namespace colony::bench {

struct Scene {
  std::string_view name;
  std::string_view text;             // one line, for people
  std::optional<RunSpec> (*make)();  // none: a preset it needs is not in this version
};

/// From the shortest to the longest.
std::span<const Scene> scenes();

}  // namespace colony::bench
