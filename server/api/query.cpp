#include "server/api/query.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "server/api/json.hpp"
#include "server/api/suggest.hpp"

namespace colony::server::api {
namespace {

std::string number_text(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::fixed).ptr};
}

// The shortest text that reads back as the same number; any finite double fits.
std::string shortest(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// Why a value is wrong; empty if it is right.
std::string wrong_value(const QueryParam& param, const std::string& value) {
  const std::string range = "within " + number_text(param.min) + " to " + number_text(param.max);
  switch (param.type) {
    case QueryType::kInteger: {
      const auto integer = parse_integer(value);
      const bool inside =
          integer && static_cast<double>(*integer) >= param.min && static_cast<double>(*integer) <= param.max;
      return inside ? "" : "must be an integer " + range;
    }
    case QueryType::kNumber: {
      const auto number = parse_number(value);
      return number && *number >= param.min && *number <= param.max ? "" : "must be a number " + range;
    }
    case QueryType::kBoolean:
      return value == "true" || value == "false" ? "" : "must be true or false";
    case QueryType::kName:
    case QueryType::kNames:
      for (const std::string& one : param.type == QueryType::kName ? std::vector{value} : split(value, ',')) {
        if (std::find(param.names.begin(), param.names.end(), one) != param.names.end()) continue;
        return "must be one of " + joined(param.names) + suggestion(one, param.names);
      }
      return "";
    case QueryType::kText:
      return is_text(value) ? "" : "must be UTF-8 without U+0000";
  }
  return "";
}

// The name of a parameter at fault. A leading slash would read as a JSON Pointer, so it is shown percent-encoded.
std::string shown_name(const std::string& name) {
  if (name.empty()) return "(empty)";
  return name.front() == '/' ? "%2F" + name.substr(1) : name;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return out;
}

// How well a media range fits a type: 3 exactly, 2 as type/*, 1 as */*, 0 not.
int specificity(std::string_view range, std::string_view type) {
  if (range == type) return 3;
  if (range == "*/*") return 1;
  return range.ends_with("/*") && type.starts_with(range.substr(0, range.size() - 1)) ? 2 : 0;
}

}  // namespace

std::string joined(std::span<const std::string_view> names) {
  std::string out;
  for (const std::string_view name : names) out += (out.empty() ? "" : ", ") + std::string(name);
  return out;
}

std::optional<std::uint64_t> parse_integer(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> parse_number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value + 0.0;  // -0 is 0
}

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t at = 0;;) {
    const std::size_t end = text.find(separator, at);
    parts.emplace_back(text.substr(at, end == std::string_view::npos ? end : end - at));
    if (end == std::string_view::npos) return parts;
    at = end + 1;
  }
}

Result<Query> Query::parse(const http::Request& request, std::span<const QueryParam> table) {
  Query query;
  std::vector<FieldError> errors;
  std::vector<std::string_view> known;
  for (const QueryParam& param : table) known.push_back(param.name);
  for (const auto& [name, value] : request.query) {
    const auto param =
        std::find_if(table.begin(), table.end(), [&](const QueryParam& one) { return one.name == name; });
    if (param == table.end()) {
      errors.push_back({shown_name(name), "unknown parameter" + suggestion(name, known)});
      continue;
    }
    std::vector<std::string>& values = query.values_[name];
    if (!values.empty() && !param->repeatable)
      errors.push_back({name, "must be given once"});
    else if (std::string wrong = wrong_value(*param, value); !wrong.empty())
      errors.push_back({name, std::move(wrong)});
    values.push_back(value);
  }
  if (!errors.empty()) return Error{ErrorCode::kInvalid, "query parameters are wrong", std::move(errors)};
  for (const auto& [name, values] : query.values_) {
    const auto param = std::find_if(table.begin(), table.end(), [&](const QueryParam& one) { return one.name == name; });
    for (const std::string& value : values) {
      const bool is_number = param->type == QueryType::kInteger || param->type == QueryType::kNumber;
      const std::string text = is_number ? shortest(*parse_number(value)) : value;
      query.normalised_ += name + "=" + std::to_string(text.size()) + ":" + text + ";";
    }
  }
  return query;
}

std::optional<std::uint64_t> Query::integer(std::string_view name) const {
  const auto value = text(name);
  return value ? parse_integer(*value) : std::nullopt;
}
std::optional<double> Query::number(std::string_view name) const {
  const auto value = text(name);
  return value ? parse_number(*value) : std::nullopt;
}
bool Query::boolean(std::string_view name, bool otherwise) const {
  const auto value = text(name);
  return value ? *value == "true" : otherwise;
}
std::optional<std::string> Query::text(std::string_view name) const {
  const auto found = values_.find(name);
  return found == values_.end() ? std::nullopt : std::optional(found->second.front());
}
std::vector<std::string> Query::texts(std::string_view name) const {
  const auto found = values_.find(name);
  if (found == values_.end()) return {};
  return found->second;
}

std::optional<std::size_t> choose_media(const http::Headers& headers, std::span<const std::string_view> offered) {
  if (headers.count("Accept") == 0) return 0;
  // The weight of each offer is that of the most specific range that fits it.
  std::vector<std::pair<int, double>> best(offered.size(), {0, 0.0});
  for (const auto& [name, value] : headers.all()) {
    if (lower(name) != "accept") continue;
    for (const std::string& element : split(value, ',')) {
      const std::vector<std::string> parts = split(element, ';');
      const std::string range = lower(trimmed(parts[0]));
      double weight = 1.0;
      for (std::size_t i = 1; i < parts.size(); ++i) {
        const std::string part = lower(trimmed(parts[i]));
        if (part.starts_with("q=")) weight = std::clamp(parse_number(part.substr(2)).value_or(0.0), 0.0, 1.0);
      }
      for (std::size_t i = 0; i < offered.size(); ++i) {
        const int fit = specificity(range, offered[i]);
        if (fit > best[i].first) best[i] = {fit, weight};
      }
    }
  }
  std::optional<std::size_t> chosen;
  for (std::size_t i = 0; i < offered.size(); ++i) {
    if (best[i].second > 0.0 && (!chosen || best[i].second > best[*chosen].second)) chosen = i;
  }
  return chosen;
}

bool has_body_of(const http::Headers& headers, std::span<const std::string_view> media) {
  return headers.count("Content-Type") == 1 &&
         std::find(media.begin(), media.end(), *headers.get("Content-Type")) != media.end();
}

bool has_json_body(const http::Headers& headers) {
  if (headers.count("Content-Type") != 1) return false;
  const std::vector<std::string> parts = split(*headers.get("Content-Type"), ';');
  if (lower(trimmed(parts[0])) != "application/json" || parts.size() > 2) return false;
  if (parts.size() == 1) return true;
  const std::string parameter = lower(trimmed(parts[1]));
  return parameter == "charset=utf-8" || parameter == "charset=\"utf-8\"";
}

}  // namespace colony::server::api
