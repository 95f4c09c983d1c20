// spec: a job spec from a file and from flags. Flags win over the file; the server alone decides what is valid.
// Errors:  Failure kUsage for what is wrong in itself: a --set without '=', broken JSON, equal keys, one field set
// twice. Threads: pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/cli/text.hpp"

namespace colony::client {

struct Assignment {
  std::vector<std::string> path;  // {"model", "cycle", "mean_h"}
  Json value;
  std::string origin;  // the flag, for messages
};

/// "model.cycle.mean_h=10". The value is JSON if it parses as JSON, else a string; what begins like JSON ('[', '{',
/// '"') must parse.
Assignment parse_set(const std::string& text);

/// "key=value"; the value is always a string and the key may hold dots.
Assignment parse_label(const std::string& text);

/// Strict: equal keys in an object, depth over 32 and anything but an object are errors (merged silently they would be
/// lost).
Json parse_spec(std::string_view text, const std::string& name);

/// Makes objects on the way. Errors: a path twice; a path through something that is no object.
void apply(const std::vector<Assignment>& assignments, Json& spec);

}  // namespace colony::client
