// sqlite_tokens: the TokenStore over the writer and the readers of the one database. Not for use outside this folder.
#pragma once

#include <string>
#include <vector>

#include "server/store/reader_pool.hpp"
#include "server/store/tokens.hpp"
#include "server/store/writer.hpp"

namespace colony::server {

class SqliteTokens final : public TokenStore {
 public:
  /// Both outlive it.
  SqliteTokens(Writer& writer, ReaderPool& readers) : writer_(writer), readers_(readers) {}

  Result<StoredToken> create(const NewToken& token) override;
  Result<std::vector<TokenRow>> list() override;
  Status remove(const std::string& id) override;

 private:
  Writer& writer_;       // synchronises itself
  ReaderPool& readers_;  // synchronises itself
};

}  // namespace colony::server
