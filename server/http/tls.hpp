// tls: the server's side of TLS: certificate, key, and what is spoken: 1.2 and 1.3, no compression, no renegotiation, our order
// of ciphers.
// Errors:  kInvalid "tls.certificate" or "tls.key", with the file and the reason; never a byte of the key.
// Threads: made once; then any thread.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <boost/asio/ssl/context.hpp>

#include "engine/base/result.hpp"

namespace colony::server::http {

/// Paths of PEM files: the certificate with its chain, and its key without a passphrase.
Result<std::unique_ptr<boost::asio::ssl::context>> make_tls_context(const std::string& certificate,
                                                                    const std::string& key);

/// What to warn of if others than its owner and group may read the file, or others than its owner may change it; nullopt: all is well, or it is
/// not there.
std::optional<std::string> exposure_of_key(const std::string& key);

}  // namespace colony::server::http
