// suggest: the known name that a wrong one was probably meant to be.
// Threads: pure.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace colony::server::api {

/// ", did you mean mean_h?" or an empty string. Ties go to the earlier candidate.
std::string suggestion(std::string_view wrong, std::span<const std::string_view> known);

}  // namespace colony::server::api
