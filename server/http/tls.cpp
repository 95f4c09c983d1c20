#include "server/http/tls.hpp"

#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include <openssl/x509err.h>

namespace colony::server::http {
namespace {
namespace ssl = boost::asio::ssl;

Error tls_error(const char* field, const std::string& path, const std::string& why) {
  return {ErrorCode::kInvalid, "the configuration cannot be used", {{field, "cannot use '" + path + "': " + why}}};
}

bool is_mismatch(const boost::system::error_code& error) {
  const int reason = ERR_GET_REASON(static_cast<unsigned long>(error.value()));
  return reason == X509_R_KEY_VALUES_MISMATCH || reason == X509_R_KEY_TYPE_MISMATCH;
}

// OpenSSL tells a file that cannot be opened from one that holds nothing of use only in words of its own.
std::optional<std::string> why_unreadable(const std::string& path) {
  std::FILE* const file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) return std::generic_category().message(errno);
  const int first = std::fgetc(file);
  const int error = std::ferror(file) != 0 ? errno : 0;
  std::fclose(file);
  if (error != 0) return std::generic_category().message(error);
  if (first == EOF) return "the file is empty";
  return std::nullopt;
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
  if (const auto why = why_unreadable(certificate)) return tls_error("tls.certificate", certificate, *why);
  if (const auto why = why_unreadable(key)) return tls_error("tls.key", key, *why);
  boost::system::error_code error;
  context->use_certificate_chain_file(certificate, error);
  if (error) return tls_error("tls.certificate", certificate, "not a certificate in PEM (" + error.message() + ")");
  context->use_private_key_file(key, ssl::context::pem, error);  // also compares it with the certificate
  // A key of another kind than the certificate's is only found to be alone.
  if (error ? is_mismatch(error) : SSL_CTX_check_private_key(raw) != 1) {
    return tls_error("tls.key", key, "it is not the key of tls.certificate '" + certificate + "'");
  }
  if (error) return tls_error("tls.key", key, "not a key in PEM without a passphrase (" + error.message() + ")");
  return context;
}

std::optional<std::string> exposure_of_key(const std::string& key) {
  struct stat facts{};
  if (stat(key.c_str(), &facts) != 0) return std::nullopt;
  if ((facts.st_mode & (S_IRWXO | S_IWGRP)) == 0) return std::nullopt;
  std::array<char, 8> mode{};
  std::snprintf(mode.data(), mode.size(), "%04o", static_cast<unsigned>(facts.st_mode & 07777));
  return "tls.key: others than its owner can get at '" + key + "' (mode " + mode.data() +
         "): chmod 600 or 640, and think of a new key";
}

}  // namespace colony::server::http
