// tokens: who may ask. Secrets are 256 random bits and leave the process once; what is kept is their SHA-256.
// Promises that a look-up takes no longer for a nearly right secret (it is found by its hash, of which a stranger can
//          choose no prefix, and compared in constant time), that a removed token is dead when remove() returns, and that
//          watchers of it are told.
// Why plain SHA-256: a slow hash protects guessable secrets; nobody guesses 256 bits.
// Threads: the table from any thread; nothing in it waits for a disk, so that the I/O threads may ask it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <string_view>

#include "engine/base/result.hpp"
#include "server/http/message.hpp"

namespace colony::server::http {

using TokenHash = std::array<std::uint8_t, 32>;

/// "colony_" and 64 hexadecimal digits: a form that scanners of logs and repositories can look for.
/// Errors: kInternal if the system has no randomness to give.
Result<std::string> new_token();
bool is_token_text(std::string_view text);
TokenHash hash_of_token(std::string_view token);
/// `text` with every token in it made unreadable, also what is left of one without its beginning or its end: more than 32 hexadecimal
/// digits in a row (which is what ids and digests have at most), or "colony_" and 8. For whatever goes into a log.
std::string without_tokens(std::string_view text);

std::string_view name_of(Scope scope);
std::optional<Scope> scope_from(std::string_view name);

struct KnownToken {
  std::string id;
  std::string name;  // of whom it stands for; several tokens may have the same
  Scope scope = Scope::kRead;
  TokenHash hash{};
  std::int64_t expires_unix_ms = 0;
};

/// Now, as expiry counts it.
std::int64_t unix_time_ms();

class TokenTable {
 public:
  enum class Verdict { kUnknown, kExpired, kValid };
  struct Found {
    Verdict verdict = Verdict::kUnknown;
    Principal principal;  // of a valid one
  };

  void add(KnownToken token);
  /// Wakes its watchers. An unknown id: nothing.
  void remove(const std::string& id);
  Found find(std::string_view token, std::int64_t now_unix_ms) const;
  bool is_alive(const std::string& id, std::int64_t now_unix_ms) const;
  std::int64_t expires_unix_ms(const std::string& id) const;  // 0: not there
  /// How many are valid now with this scope or more.
  std::size_t count_alive(Scope at_least, std::int64_t now_unix_ms) const;

  /// Until the handle is destroyed, `wake` is called once the token was removed; a call that is under way then may still
  /// come after. It must not call the table.
  class Watch;
  std::shared_ptr<Watch> watch(const std::string& id, std::function<void()> wake) const;

 private:
  mutable std::shared_mutex mutex_;                            // guards everything below
  std::map<std::string, KnownToken> by_id_;
  std::multimap<std::uint64_t, std::string> ids_;              // by the first bytes of the hash
  mutable std::multimap<std::string, std::weak_ptr<Watch>> watches_;   // by id of the token; dead ones go when one is added
};

}  // namespace colony::server::http
