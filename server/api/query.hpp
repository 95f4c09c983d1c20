// query: the query parameters of an endpoint, read by one table that also makes their OpenAPI description.
// Errors:  kInvalid with every wrong parameter at once: unknown ones (with a near miss), repeated ones, values out of
// range. Threads: pure.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/result.hpp"
#include "server/http/message.hpp"

namespace colony::server::api {

enum class QueryType { kInteger, kNumber, kBoolean, kName, kNames, kText };  // kNames: one or more, separated by commas

struct QueryParam {
  std::string_view name;
  QueryType type = QueryType::kText;
  double min = 0.0, max = 0.0;               // closed; of kInteger and kNumber
  std::vector<std::string_view> names = {};  // of kName and kNames
  std::string_view text;
  bool repeatable = false;
};

class Query {
 public:
  static Result<Query> parse(const http::Request& request, std::span<const QueryParam> table);

  /// The parameters in the order of their names, numbers in one spelling: queries that mean the same mostly read the same.
  const std::string& normalised() const { return normalised_; }

  bool has(std::string_view name) const { return values_.find(name) != values_.end(); }
  std::optional<std::uint64_t> integer(std::string_view name) const;  // of a parameter with min >= 0
  std::optional<double> number(std::string_view name) const;
  bool boolean(std::string_view name, bool otherwise) const;
  std::optional<std::string> text(std::string_view name) const;
  /// All values of a repeatable parameter, in their order.
  std::vector<std::string> texts(std::string_view name) const;

 private:
  std::map<std::string, std::vector<std::string>, std::less<>> values_;  // checked against the table
  std::string normalised_;
};

/// A decimal integer without sign or spaces; nullopt for anything else and beyond 64 bits.
std::optional<std::uint64_t> parse_integer(std::string_view text);
/// A finite decimal number; nullopt for anything else ("NaN", "inf", "0x10", spaces).
std::optional<double> parse_number(std::string_view text);
std::vector<std::string> split(std::string_view text, char separator);
/// "a, b, c"
std::string joined(std::span<const std::string_view> names);

/// Index of the offered media type that an Accept header prefers (RFC 9110, 12.5.1; ties go to the earlier one);
/// without the header the first. nullopt: none is acceptable.
std::optional<std::size_t> choose_media(const http::Headers& headers, std::span<const std::string_view> offered);
/// True if the request has exactly one Content-Type, application/json, with at most the parameter charset=utf-8.
bool has_json_body(const http::Headers& headers);
/// True if the request has exactly one Content-Type, one of `media` without parameters.
bool has_body_of(const http::Headers& headers, std::span<const std::string_view> media);

}  // namespace colony::server::api
