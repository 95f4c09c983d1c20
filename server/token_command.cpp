#include "server/token_command.hpp"

#include <cstdio>

#include "server/api/handlers_tokens.hpp"
#include "server/store/store.hpp"

namespace colony::server {
namespace {

int fail(int code, const std::string& what, const Error& error) {
  std::fprintf(stderr, "colonyd: %s: %s\n", what.c_str(), error.message.c_str());
  for (const FieldError& field : error.fields) {
    std::string flag = "--" + field.pointer.substr(field.pointer.find_first_not_of('/'));
    if (flag == "--expires_h") flag = "--expires-h";
    std::fprintf(stderr, "  %s: %s\n", flag.c_str(), field.message.c_str());
  }
  return code;
}

}  // namespace

int run_token_create(const Config& config, const TokenRequest& request) {
  auto store = Store::open(config.store);
  if (!store) {
    const bool is_held = store.error().code == ErrorCode::kConflict;
    return fail(1,
                is_held ? "a server holds the data folder; stop it, or make the token with POST /v1/tokens"
                        : "cannot open the data folder " + config.store.data_dir,
                store.error());
  }
  const auto created =
      api::create_token((*store)->tokens(), {request.name, request.scope, request.expires_h}, "local");
  if (!created) return fail(created.error().code == ErrorCode::kInvalid ? 2 : 1, "no token was made", created.error());
  std::printf("%s\n", created->secret.c_str());
  if (std::fflush(stdout) != 0) return 1;
  for (const TokenRow& old : created->removed) std::fprintf(stderr, "%s\n", api::removed_text(old).c_str());
  std::fprintf(stderr, "token %s for %s, scope %s, valid until %s; it is shown this once\n", created->row.id.c_str(),
               created->row.name.c_str(), created->row.scope.c_str(), created->row.expires_at.c_str());
  return 0;
}

}  // namespace colony::server
