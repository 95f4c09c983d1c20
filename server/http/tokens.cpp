#include "server/http/tokens.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <utility>
#include <vector>

#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <openssl/sha.h>

#include "server/http/text.hpp"

namespace colony::server::http {
namespace {

constexpr std::string_view kPrefix = "colony_";
constexpr std::size_t kSecretBytes = 32;
constexpr std::size_t kTokenChars = kPrefix.size() + 2 * kSecretBytes;
constexpr std::array<std::string_view, 3> kScopeNames = {"read", "submit", "admin"};

bool is_lower_hex(char c) { return is_digit(c) || (c >= 'a' && c <= 'f'); }

std::uint64_t key_of(const TokenHash& hash) {
  std::uint64_t key = 0;
  std::memcpy(&key, hash.data(), sizeof key);
  return key;
}

}  // namespace

class TokenTable::Watch {
 public:
  explicit Watch(std::function<void()> wake) : wake_(std::move(wake)) {}
  void wake() const { wake_(); }

 private:
  const std::function<void()> wake_;
};

Result<std::string> new_token() {
  std::array<unsigned char, kSecretBytes> secret{};
  if (RAND_bytes(secret.data(), static_cast<int>(secret.size())) != 1) {
    return Error{ErrorCode::kInternal, "the system gave no random bytes for a token"};
  }
  std::string token(kPrefix);
  for (const unsigned char byte : secret) {
    token += "0123456789abcdef"[byte >> 4];
    token += "0123456789abcdef"[byte & 15];
  }
  OPENSSL_cleanse(secret.data(), secret.size());
  return token;
}

bool is_token_text(std::string_view text) {
  if (text.size() != kTokenChars || text.substr(0, kPrefix.size()) != kPrefix) return false;
  for (const char c : text.substr(kPrefix.size())) {
    if (!is_lower_hex(c)) return false;
  }
  return true;
}

TokenHash hash_of_token(std::string_view token) {
  TokenHash hash{};
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), hash.data());
  return hash;
}

// A run of hexadecimal digits is hidden whole, also behind the prefix one that was cut short: half a secret is half a secret too many.
// In either case of letters: who reads it can write it in the other.
std::string without_tokens(std::string_view text) {
  constexpr std::size_t kPartDigits = 8;  // "colony_face" is no secret
  constexpr std::size_t kIdDigitsMax = 32;  // of ids, cursors and digests
  std::string out;
  std::size_t at = 0;
  while (at < text.size()) {
    std::size_t end = at;
    while (end < text.size() && hex_value(text[end]) >= 0) ++end;
    const std::string_view before = std::string_view(out).substr(out.size() - std::min(out.size(), kPrefix.size()));
    const bool is_secret = end - at > kIdDigitsMax || (end - at >= kPartDigits && equals_without_case(before, kPrefix));
    out += is_secret ? std::string_view("[hidden]") : text.substr(at, end - at);
    if (end < text.size()) out += text[end++];
    at = end;
  }
  return out;
}

std::string_view name_of(Scope scope) { return kScopeNames[static_cast<std::size_t>(scope)]; }

std::optional<Scope> scope_from(std::string_view name) {
  for (std::size_t i = 0; i < kScopeNames.size(); ++i) {
    if (kScopeNames[i] == name) return static_cast<Scope>(i);
  }
  return std::nullopt;
}

std::int64_t unix_time_ms() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

void TokenTable::add(KnownToken token) {
  const std::lock_guard lock(mutex_);
  ids_.emplace(key_of(token.hash), token.id);
  by_id_.insert_or_assign(token.id, std::move(token));
}

void TokenTable::remove(const std::string& id) {
  std::vector<std::shared_ptr<Watch>> watches;
  {
    const std::lock_guard lock(mutex_);
    const auto token = by_id_.find(id);
    if (token == by_id_.end()) return;
    const auto [begin, end] = ids_.equal_range(key_of(token->second.hash));
    for (auto it = begin; it != end; ++it) {
      if (it->second != id) continue;
      ids_.erase(it);
      break;
    }
    by_id_.erase(token);
    const auto [first, last] = watches_.equal_range(id);
    for (auto it = first; it != last; ++it) {
      if (auto watch = it->second.lock()) watches.push_back(std::move(watch));
    }
    watches_.erase(first, last);
  }
  for (const auto& watch : watches) watch->wake();
}

TokenTable::Found TokenTable::find(std::string_view token, std::int64_t now_unix_ms) const {
  if (!is_token_text(token)) return {};
  const TokenHash hash = hash_of_token(token);
  const std::shared_lock lock(mutex_);
  const auto [begin, end] = ids_.equal_range(key_of(hash));
  for (auto it = begin; it != end; ++it) {
    const KnownToken& known = by_id_.at(it->second);
    if (CRYPTO_memcmp(known.hash.data(), hash.data(), hash.size()) != 0) continue;
    if (now_unix_ms >= known.expires_unix_ms) return {Verdict::kExpired, {}};
    return {Verdict::kValid, {known.name, known.scope, known.id}};
  }
  return {};
}

bool TokenTable::is_alive(const std::string& id, std::int64_t now_unix_ms) const {
  const std::shared_lock lock(mutex_);
  const auto token = by_id_.find(id);
  return token != by_id_.end() && now_unix_ms < token->second.expires_unix_ms;
}

std::int64_t TokenTable::expires_unix_ms(const std::string& id) const {
  const std::shared_lock lock(mutex_);
  const auto token = by_id_.find(id);
  return token == by_id_.end() ? 0 : token->second.expires_unix_ms;
}

std::size_t TokenTable::count_alive(Scope at_least, std::int64_t now_unix_ms) const {
  const std::shared_lock lock(mutex_);
  std::size_t count = 0;
  for (const auto& [id, token] : by_id_) count += token.scope >= at_least && now_unix_ms < token.expires_unix_ms;
  return count;
}

std::shared_ptr<TokenTable::Watch> TokenTable::watch(const std::string& id, std::function<void()> wake) const {
  auto watch = std::make_shared<Watch>(std::move(wake));
  const std::lock_guard lock(mutex_);
  const auto [first, last] = watches_.equal_range(id);
  for (auto it = first; it != last;) it = it->second.expired() ? watches_.erase(it) : std::next(it);
  watches_.emplace(id, watch);
  return watch;
}

}  // namespace colony::server::http
