#include "client/cli/spec.hpp"

#include <set>
#include <utility>

#include "client/cli/failure.hpp"

namespace colony::client {
namespace {

[[noreturn]] void fail(const std::string& message) { throw Failure(ExitCode::kUsage, message); }

std::pair<std::string, std::string> split_pair(const std::string& text, const std::string& flag, const char* form) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) fail(flag + " " + printable(text) + ": write it as " + form);
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace

Assignment parse_set(const std::string& text) {
  const auto [path, value] = split_pair(text, "--set", "model.cycle.mean_h=10");
  Assignment out;
  out.origin = "--set " + path;
  for (std::size_t start = 0;;) {
    const std::size_t dot = path.find('.', start);
    const std::string part = path.substr(start, dot == std::string::npos ? dot : dot - start);
    if (part.empty()) fail(printable(out.origin) + ": an empty name in the path");
    out.path.push_back(part);
    if (dot == std::string::npos) break;
    start = dot + 1;
  }
  if (value.empty()) fail(printable(out.origin) + ": no value (an empty string is \"\", with the quotes)");
  out.value = Json::parse(value, nullptr, false);
  if (out.value.is_discarded()) {
    if (value.front() == '[' || value.front() == '{' || value.front() == '"') {
      fail(printable(out.origin) + ": " + printable(value) + " is not valid JSON");
    }
    out.value = value;
  }
  return out;
}

Assignment parse_label(const std::string& text) {
  auto [key, value] = split_pair(text, "--label", "key=value");
  return {{"labels", key}, Json(std::move(value)), "--label " + key};
}

Json parse_spec(std::string_view text, const std::string& name) {
  std::vector<std::set<std::string>> open;  // the keys seen in each open object
  const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (depth > 32) fail(printable(name) + ": nested deeper than 32");
    if (event == Json::parse_event_t::object_start) open.emplace_back();
    if (event == Json::parse_event_t::object_end) open.pop_back();
    if (event == Json::parse_event_t::key && !open.back().insert(parsed.get<std::string>()).second) {
      fail(printable(name) + ": the key " + parsed.dump() + " stands twice in one object");
    }
    return true;
  };
  Json spec;
  try {
    spec = Json::parse(text, watch);
  } catch (const Json::parse_error& wrong) {
    fail(printable(name) + ": not valid JSON at byte " + std::to_string(wrong.byte));
  }
  if (!spec.is_object()) fail(printable(name) + ": a job spec is a JSON object");
  return spec;
}

void apply(const std::vector<Assignment>& assignments, Json& spec) {
  std::set<std::vector<std::string>> done;
  for (const Assignment& assignment : assignments) {
    const std::string origin = printable(assignment.origin);
    if (!done.insert(assignment.path).second) fail(origin + ": this field is set twice");
    Json* at = &spec;
    for (std::size_t i = 0; i + 1 < assignment.path.size(); ++i) {
      at = &(*at)[assignment.path[i]];
      if (at->is_null()) *at = Json::object();
      if (!at->is_object()) fail(origin + ": '" + printable(assignment.path[i]) + "' is not an object in this spec");
    }
    (*at)[assignment.path.back()] = assignment.value;
  }
}

}  // namespace colony::client
