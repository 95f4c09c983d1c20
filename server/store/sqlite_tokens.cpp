#include "server/store/sqlite_tokens.hpp"

#include <algorithm>

#include "engine/base/check.hpp"
#include "server/store/identity.hpp"

namespace colony::server {
namespace {

TokenRow row_at(const Statement& row) {
  TokenRow token;
  token.id = row.text(0);
  token.name = row.text(1);
  token.scope = row.text(2);
  const auto hash = row.blob(3);
  if (hash.size() != token.secret_hash.size()) throw DbError(SQLITE_CORRUPT, "a token has a hash of the wrong length");
  std::copy(hash.begin(), hash.end(), token.secret_hash.begin());
  token.created_by = row.text(4);
  token.created_at = row.text(5);
  token.expires_at = row.text(6);
  return token;
}

}  // namespace

Result<StoredToken> SqliteTokens::create(const NewToken& token) {
  StoredToken made;
  const Status written = writer_.request([&](Connection& connection) -> Status {
    made = {};
    const std::string now = wall_time_text();  // such texts are in the order of time
    Statement& count = connection.prepared("SELECT count(*), coalesce(sum(expires_at > ?), 0) FROM token");
    count.bind(std::string_view(now));
    CHECK(count.step());
    const std::int64_t stored = count.integer(0), valid = count.integer(1);
    count.reset();
    constexpr auto kMax = static_cast<std::int64_t>(kTokensMax);
    if (valid >= kMax) {
      return Error{ErrorCode::kLimit, std::to_string(valid) + " valid tokens are stored, which is the limit: delete some"};
    }
    if (stored >= kMax) {
      Statement& expired = connection.prepared(
          "SELECT id, name, scope, secret_hash, created_by, created_at, expires_at FROM token WHERE expires_at <= ?"
          " ORDER BY expires_at, token_key LIMIT ?");
      expired.bind(std::string_view(now)).bind(stored - kMax + 1);
      while (expired.step()) made.removed.push_back(row_at(expired));
      expired.reset();
      for (const TokenRow& old : made.removed) {
        connection.prepared("DELETE FROM token WHERE id = ?").bind(std::string_view(old.id)).run();
      }
    }
    made.row = {new_job_id(), token.name, token.scope, token.secret_hash, token.created_by, now, token.expires_at};
    const TokenRow& row = made.row;
    Statement& to = connection.prepared(
        "INSERT INTO token (id, name, scope, secret_hash, created_by, created_at, expires_at) VALUES (?, ?, ?, ?, ?, ?, ?)");
    to.bind(std::string_view(row.id)).bind(std::string_view(row.name)).bind(std::string_view(row.scope));
    to.bind_blob(row.secret_hash).bind(std::string_view(row.created_by)).bind(std::string_view(row.created_at));
    to.bind(std::string_view(row.expires_at)).run();
    return Ok{};
  });
  if (!written) return written.error();
  return made;
}

Result<std::vector<TokenRow>> SqliteTokens::list() {
  return readers_.read([](Connection& connection) -> Result<std::vector<TokenRow>> {
    Statement& row = connection.prepared(
        "SELECT id, name, scope, secret_hash, created_by, created_at, expires_at FROM token ORDER BY token_key DESC");
    std::vector<TokenRow> tokens;
    while (row.step()) tokens.push_back(row_at(row));
    return tokens;
  });
}

Status SqliteTokens::remove(const std::string& id) {
  return writer_.request([&](Connection& connection) -> Status {
    connection.prepared("DELETE FROM token WHERE id = ?").bind(std::string_view(id)).run();
    if (connection.changes() == 0) return Error{ErrorCode::kNotFound, "there is no token " + id};
    return Ok{};
  });
}

}  // namespace colony::server
