// reason: why something could not be measured, in words for people.
// Threads: pure.
#pragma once

#include <string>

#include "engine/base/result.hpp"

namespace colony {

/// The message of an error without the name of its one field, which is a name of ours ("image", "areas") and none of what was asked.
inline std::string reason_of(const Error& error) { return error.fields.size() == 1 ? error.fields.front().message : error.message; }

}  // namespace colony
