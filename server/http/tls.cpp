#include "server/http/tls.hpp"

#include <utility>

namespace colony::server::http {
namespace {
namespace ssl = boost::asio::ssl;

Error tls_error(const char* field, const std::string& path, const boost::system::error_code& error) {
  const std::string message = "cannot use '" + path + "': " + error.message();
  return {ErrorCode::kInvalid, std::string(field) + ": " + message, {{field, message}}};
}

}  // namespace

Result<std::unique_ptr<ssl::context>> make_tls_context(const std::string& certificate, const std::string& key) {
  auto context = std::make_unique<ssl::context>(ssl::context::tls_server);
  context->set_options(ssl::context::default_workarounds | ssl::context::no_compression |
                       ssl::context::single_dh_use);
  SSL_CTX* const raw = context->native_handle();
  SSL_CTX_set_options(raw, SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE);
  SSL_CTX_set_min_proto_version(raw, TLS1_2_VERSION);
  SSL_CTX_set_mode(raw, SSL_MODE_RELEASE_BUFFERS);  // an idle connection keeps no buffers
  // No one can be asked for a passphrase: a key that has one is an error, not a prompt on a terminal.
  SSL_CTX_set_default_passwd_cb(raw, [](char*, int, int, void*) { return 0; });
  boost::system::error_code error;
  context->use_certificate_chain_file(certificate, error);
  if (error) return tls_error("tls.certificate", certificate, error);
  context->use_private_key_file(key, ssl::context::pem, error);  // also compares it with the certificate
  if (error) return tls_error("tls.key", key, error);
  return context;
}

}  // namespace colony::server::http
