// tokens: what is kept of the secrets that let somebody in: their SHA-256, never themselves.
// Promise: as the store's: a call that returned success is on disk. Names are not unique: two tokens of one name stand for the
//          same person or program (one of them being replaced, say).
// Errors:  kNotFound, kLimit, kStorage as named at each call; the data is then as before.
// Threads: every function from any thread.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/result.hpp"

namespace colony::server {

/// Valid at the same time; and stored, since expired ones give way.
inline constexpr std::size_t kTokensMax = 1000;

struct NewToken {
  std::string name;
  std::string scope;  // "read", "submit" or "admin"
  std::array<std::uint8_t, 32> secret_hash{};
  std::string created_by;
  std::string expires_at;  // RFC 3339 UTC, ms
};

struct TokenRow {
  std::string id;  // UUIDv7
  std::string name;
  std::string scope;
  std::array<std::uint8_t, 32> secret_hash{};
  std::string created_by;
  std::string created_at, expires_at;
};

struct StoredToken {
  TokenRow row;
  std::vector<TokenRow> removed;  // expired ones that gave way to it
};

class TokenStore {
 public:
  virtual ~TokenStore() = default;
  /// kLimit with kTokensMax valid ones. Where so many are stored, those that expired first are removed, as many as must be.
  virtual Result<StoredToken> create(const NewToken& token) = 0;
  /// All, newest first.
  virtual Result<std::vector<TokenRow>> list() = 0;
  /// kNotFound for an unknown id.
  virtual Status remove(const std::string& id) = 0;
};

}  // namespace colony::server
