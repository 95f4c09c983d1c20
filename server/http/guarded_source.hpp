// guarded_source: a stream that ends when the token that opened it does.
// Promises that after a revocation or an expiry nothing more of the source is sent: a stream that can be taken up again gets its
//          farewell (the reconnect is then told 401), a download is cut, so that it is not taken for complete.
// Threads: as of a BodySource.
#pragma once

#include <memory>
#include <string>

#include "server/http/message.hpp"
#include "server/http/tokens.hpp"

namespace colony::server::http {

/// `source` as it is if no token was needed. `tokens` outlives the stream.
std::unique_ptr<BodySource> guarded(std::unique_ptr<BodySource> source, const TokenTable& tokens,
                                    const Principal& principal);

}  // namespace colony::server::http
