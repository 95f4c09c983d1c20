// handlers_tokens: tokens as the interface shows them, and the making of one, which the command line of the server shares.
// Promise: a secret is in the answer that made it and nowhere else; a token that is removed is worth nothing when the answer
//          comes; what the table of http/ knows is what is stored.
// Threads: as all handlers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/result.hpp"
#include "server/api/json.hpp"
#include "server/http/tokens.hpp"
#include "server/store/store.hpp"

namespace colony::server::api {

inline constexpr std::size_t kTokenNameBytesMax = 64;
inline constexpr double kTokenLifeMin_h = 0.001;     // 3.6 s: less is a slip of the unit
inline constexpr double kTokenLifeMax_h = 87'600.0;  // ten years
inline constexpr std::int64_t kSpareAdminLife_h = 1;  // an admin's token counts as another one where the last is revoked if it lasts so long

struct TokenWish {
  std::string name;
  std::string scope;
  double expires_h = 0.0;  // from now
};

struct CreatedToken {
  TokenRow row;
  std::string secret;
  std::vector<TokenRow> removed;  // expired ones that gave way to it
};

/// Checks, makes and stores. Errors: kInvalid with fields /name, /scope, /expires_h; kLimit; kStorage.
Result<CreatedToken> create_token(TokenStore& store, const TokenWish& wish, const std::string& created_by);

/// What the log says of a token that gave way.
std::string removed_text(const TokenRow& row);

/// All stored tokens into the table, at the start.
Status load_tokens(TokenStore& store, http::TokenTable& table);

Json token_components();

}  // namespace colony::server::api
