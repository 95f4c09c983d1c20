// tls: the server's side of TLS: certificate, key, and what is spoken: 1.2 and 1.3, no compression, no renegotiation, our order
// of ciphers.
// Errors:  kInvalid "tls.certificate" or "tls.key", with OpenSSL's reason; never a byte of the key.
// Threads: made once; then any thread.
#pragma once

#include <memory>
#include <string>

#include <boost/asio/ssl/context.hpp>

#include "engine/base/result.hpp"

namespace colony::server::http {

/// Paths of PEM files: the certificate with its chain, and its key without a passphrase.
Result<std::unique_ptr<boost::asio::ssl::context>> make_tls_context(const std::string& certificate,
                                                                    const std::string& key);

}  // namespace colony::server::http
