#include "server/store/sqlite_tokens.hpp"

#include <algorithm>

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

Result<TokenRow> SqliteTokens::create(const NewToken& token) {
  TokenRow made;
  const Status written = writer_.request([&](Connection& connection) -> Status {
    Statement& count = connection.prepared("SELECT count(*) FROM token");
    const std::int64_t stored = count.step() ? count.integer(0) : 0;
    count.reset();
    if (stored >= static_cast<std::int64_t>(kTokensMax)) {
      return Error{ErrorCode::kLimit, std::to_string(stored) + " tokens are stored, which is the limit: delete some"};
    }
    made = {new_job_id(), token.name, token.scope, token.secret_hash, token.created_by, wall_time_text(),
            token.expires_at};
    Statement& to = connection.prepared(
        "INSERT INTO token (id, name, scope, secret_hash, created_by, created_at, expires_at) VALUES (?, ?, ?, ?, ?, ?, ?)");
    to.bind(std::string_view(made.id)).bind(std::string_view(made.name)).bind(std::string_view(made.scope));
    to.bind_blob(made.secret_hash).bind(std::string_view(made.created_by)).bind(std::string_view(made.created_at));
    to.bind(std::string_view(made.expires_at)).run();
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
