#include "server/api/json.hpp"

#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

namespace colony::server::api {
namespace {

// Counts what the lexer has read, so that errors found by the handler below have a byte offset too.
class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, std::size_t* read) : at_(at), read_(read) {}
  const char& operator*() const { return *at_; }
  CountingIterator& operator++() {
    ++at_;
    ++*read_;
    return *this;
  }
  friend bool operator==(const CountingIterator& a, const CountingIterator& b) { return a.at_ == b.at_; }

 private:
  const char* at_;
  std::size_t* read_;
};

class Builder : public nlohmann::json_sax<Json> {
 public:
  explicit Builder(const std::size_t& read) : read_(read) {}

  bool null() override { return put(nullptr); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(std::int64_t value) override { return put(value); }
  bool number_unsigned(std::uint64_t value) override { return put(value); }
  bool number_float(double value, const std::string&) override {
    if (!std::isfinite(value)) return fail("a number is too large", false);
    return put(value + 0.0);  // -0.0 becomes 0.0: the two are one number
  }
  bool string(std::string& value) override {
    if (value.find('\0') != std::string::npos) return fail("a string contains U+0000", true);
    return put(std::move(value));
  }
  bool binary(binary_t&) override { return fail("binary values are not JSON", false); }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(std::string& name) override {
    if (name.find('\0') != std::string::npos) return fail("a member name contains U+0000", false);
    Json& object = *open_.back();
    key_ = std::move(name);
    if (object.contains(key_)) return fail("the member name is used twice", true);
    if (object.size() >= kJsonMembersMax) {
      return fail("an object has more than " + std::to_string(kJsonMembersMax) + " members", false);
    }
    return true;
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception& error) override {
    // Of the library's text only the reason is kept; the position is given in our own words.
    std::string reason = error.what();
    if (const std::size_t bracket = reason.find("] "); bracket != std::string::npos) reason.erase(0, bracket + 2);
    if (reason.starts_with("parse error at")) reason.erase(0, reason.find(": ") + 2);
    error_ = Error{ErrorCode::kMalformed,
                   "malformed JSON at byte offset " + std::to_string(position == 0 ? 0 : position - 1) + ": " + reason};
    return false;
  }

  Json take() { return std::move(root_); }
  const Error& error() const { return error_; }

 private:
  bool put(Json value) { return place(std::move(value)) != nullptr; }

  // Pointers in open_ stay valid: a container grows only while it is the innermost one.
  Json* place(Json&& value) {
    if (open_.empty()) {
      root_ = std::move(value);
      return &root_;
    }
    Json& parent = *open_.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    Json& member = parent[key_];
    member = std::move(value);
    return &member;
  }

  bool open(Json&& container) {
    if (open_.size() >= kJsonDepthMax) return fail("nested deeper than " + std::to_string(kJsonDepthMax), false);
    const std::string token = open_.empty() ? std::string() : current_token();
    Json* placed = place(std::move(container));
    if (!open_.empty())
      pointers_.push_back(child_pointer(pointers_.back(), token));
    else
      pointers_.emplace_back();
    open_.push_back(placed);
    return true;
  }

  bool close() {
    open_.pop_back();
    pointers_.pop_back();
    return true;
  }

  std::string current_token() const { return open_.back()->is_array() ? std::to_string(open_.back()->size()) : key_; }

  bool fail(const std::string& reason, bool names_field) {
    error_ = Error{ErrorCode::kMalformed, "malformed JSON at byte offset " + std::to_string(read_) + ": " + reason};
    if (names_field) {
      error_.fields.push_back(
          {open_.empty() ? std::string() : child_pointer(pointers_.back(), current_token()), reason});
    }
    return false;
  }

  const std::size_t& read_;
  Json root_;
  std::vector<Json*> open_;
  std::vector<std::string> pointers_;  // of open_
  std::string key_;
  Error error_{ErrorCode::kMalformed, "malformed JSON"};
};

// Length of the well-formed UTF-8 sequence at `at`, 0 if there is none (RFC 3629: no overlong forms, no surrogates).
std::size_t sequence_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const auto tail = [&](std::size_t i, unsigned low, unsigned high) {
    return i < text.size() && byte(i) >= low && byte(i) <= high;
  };
  const unsigned first = byte(at);
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return tail(at + 1, 0x80, 0xBF) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    const unsigned low = first == 0xE0 ? 0xA0 : 0x80;
    const unsigned high = first == 0xED ? 0x9F : 0xBF;
    return tail(at + 1, low, high) && tail(at + 2, 0x80, 0xBF) ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const unsigned low = first == 0xF0 ? 0x90 : 0x80;
    const unsigned high = first == 0xF4 ? 0x8F : 0xBF;
    return tail(at + 1, low, high) && tail(at + 2, 0x80, 0xBF) && tail(at + 3, 0x80, 0xBF) ? 4 : 0;
  }
  return 0;
}

}  // namespace

Result<Json> parse_json(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) {
    return Error{ErrorCode::kMalformed, "malformed JSON at byte offset 0: a byte order mark is not part of JSON"};
  }
  // The library takes this byte for the end of the text, and what follows it would not be looked at.
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos) {
    return Error{ErrorCode::kMalformed, "malformed JSON at byte offset " + std::to_string(nul) + ": a zero byte"};
  }
  std::size_t read = 0;
  Builder builder(read);
  const CountingIterator begin(text.data(), &read);
  const CountingIterator end(text.data() + text.size(), &read);
  if (!nlohmann::ordered_json::sax_parse(begin, end, &builder)) return builder.error();
  return builder.take();
}

std::string to_text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string child_pointer(std::string_view pointer, std::string_view token) {
  std::string out(pointer);
  out += '/';
  for (const char c : token) {
    if (c == '~')
      out += "~0";
    else if (c == '/')
      out += "~1";
    else
      out += c;
  }
  return out;
}

bool is_text(std::string_view bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t length = sequence_length(bytes, at);
    if (length == 0 || bytes[at] == '\0') return false;
    at += length;
  }
  return true;
}

std::size_t code_point_count(std::string_view text) {
  std::size_t count = 0;
  for (const char c : text) count += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  return count;
}

bool has_control_character(std::string_view text) {
  for (std::size_t at = 0; at < text.size(); ++at) {
    const unsigned byte = static_cast<unsigned char>(text[at]);
    if (byte < 0x20 || byte == 0x7F) return true;
    // C1 controls are U+0080..U+009F: C2 80..C2 9F.
    if (byte == 0xC2 && at + 1 < text.size() && static_cast<unsigned char>(text[at + 1]) < 0xA0) return true;
  }
  return false;
}

std::optional<std::int64_t> integer_of(const Json& json) {
  if (json.is_number_unsigned()) {
    const std::uint64_t value = json.get<std::uint64_t>();
    if (value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return std::nullopt;
    return static_cast<std::int64_t>(value);
  }
  if (json.is_number_integer()) return json.get<std::int64_t>();
  if (!json.is_number_float()) return std::nullopt;
  const double value = json.get<double>();
  if (!(std::fabs(value) <= 9007199254740992.0) || value != std::floor(value)) return std::nullopt;
  return static_cast<std::int64_t>(value);
}

}  // namespace colony::server::api
