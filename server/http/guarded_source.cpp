#include "server/http/guarded_source.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace colony::server::http {
namespace {

class GuardedSource final : public BodySource {
 public:
  GuardedSource(std::unique_ptr<BodySource> source, const TokenTable& tokens, const Principal& principal)
      : source_(std::move(source)), tokens_(tokens), token_id_(principal.token_id) {}

  Pull pull(std::string& out) override {
    if (tokens_.is_alive(token_id_, unix_time_ms())) return source_->pull(out);
    if (source_->farewell().empty()) throw std::runtime_error("the token of a download has ended; the rest is not sent");
    out += source_->farewell();
    return Pull::kEnd;
  }
  // One whose token has ended is pulled by a worker, which ends it.
  std::optional<Ready> pull_now(std::string& out) override {
    if (!tokens_.is_alive(token_id_, unix_time_ms())) return std::nullopt;
    return source_->pull_now(out);
  }
  std::optional<std::chrono::milliseconds> wake_after() override {
    const std::chrono::milliseconds left(
        std::max<std::int64_t>(0, tokens_.expires_unix_ms(token_id_) - unix_time_ms()));
    const auto wanted = source_->wake_after();
    return wanted ? std::min(*wanted, left) : left;
  }
  // The watch comes before the first pull: a removal in between is seen by that pull.
  void on_ready(std::function<void()> wake) override {
    watch_ = tokens_.watch(token_id_, wake);
    source_->on_ready(std::move(wake));
  }
  std::string_view keep_alive() const override { return source_->keep_alive(); }
  std::string_view farewell() const override { return source_->farewell(); }

 private:
  const std::unique_ptr<BodySource> source_;
  const TokenTable& tokens_;
  const std::string token_id_;
  std::shared_ptr<TokenTable::Watch> watch_;
};

}  // namespace

std::unique_ptr<BodySource> guarded(std::unique_ptr<BodySource> source, const TokenTable& tokens,
                                    const Principal& principal) {
  if (principal.token_id.empty()) return source;
  return std::make_unique<GuardedSource>(std::move(source), tokens, principal);
}

}  // namespace colony::server::http
