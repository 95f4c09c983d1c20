// token_command: `colonyd token create`, for the first token, and for an administrator who has none left: while the server is
// stopped, whoever may write DATA may make one.
// Exit: 0, the secret alone on standard output; 1 if the data folder cannot be opened (a server holds it) or written; 2 usage.
#pragma once

#include "server/config.hpp"

namespace colony::server {

int run_token_create(const Config& config, const TokenRequest& request);

}  // namespace colony::server
