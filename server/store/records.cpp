#include "server/store/records.hpp"

#include <algorithm>
#include <array>

namespace colony::server {
namespace {
constexpr std::array<std::string_view, kJobStateCount> kNames = {"queued",    "running", "paused",
                                                                 "succeeded", "failed",  "cancelled"};
}  // namespace

std::string_view name_of(JobState state) { return kNames[static_cast<std::size_t>(state)]; }

std::optional<JobState> job_state_from(std::string_view name) {
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (kNames[i] == name) return static_cast<JobState>(i);
  }
  return std::nullopt;
}

bool is_terminal(JobState state) {
  return state == JobState::kSucceeded || state == JobState::kFailed || state == JobState::kCancelled;
}

bool RevisionCondition::holds(std::uint64_t revision) const {
  const auto names = [revision](const std::vector<std::uint64_t>& list) {
    return std::find(list.begin(), list.end(), revision) != list.end();
  };
  return (!one_of || names(*one_of)) && !names(none_of);
}

bool may_follow(JobState from, JobState to) {
  switch (from) {
    case JobState::kQueued:
      return to == JobState::kRunning || to == JobState::kPaused || to == JobState::kCancelled ||
             to == JobState::kFailed;
    case JobState::kRunning:
      return to == JobState::kPaused || to == JobState::kSucceeded || to == JobState::kFailed ||
             to == JobState::kCancelled;
    case JobState::kPaused:
      return to == JobState::kQueued || to == JobState::kCancelled;
    case JobState::kSucceeded:
    case JobState::kFailed:
    case JobState::kCancelled:
      return false;
  }
  return false;
}

}  // namespace colony::server
