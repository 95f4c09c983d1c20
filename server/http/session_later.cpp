// The part of a session that waits for an answer which is not there yet. It holds a worker only while the answer is asked for.
#include <algorithm>
#include <exception>
#include <utility>

#include "server/http/session_waker.hpp"

namespace colony::server::http {

// On a worker.
void Session::ask_later(bool is_first, bool is_last) {
  std::string what = "a later answer threw what is not a std::exception";
  try {
    if (is_first) response_.later->on_ready([waker = waker_] { waker->wake(); });
    late_ = response_.later->ask(is_last);
    if (late_) shared_.router.report_if_failed(request_, *late_);
    if (late_ || !is_last) return;
    what = "a later answer gave none in the end";
  } catch (const std::exception& error) {
    what = error.what();
  } catch (...) {
  }
  shared_.router.report_failure(request_, what);
  late_ = std::make_unique<Response>(problem(500, "internal", "The server made a mistake",
                                             "the server's log has more under this request_id", head_.request_id));
}

// It also ends with the token that asked: settle_answer tells.
Awaitable<void> Session::wait_for_later() {
  const TokenTable& tokens = shared_.admission.tokens();
  const std::string& token_id = request_.principal.token_id;
  const auto until = Connection::Clock::now() + response_.later->wait_max();
  waker_ = std::make_shared<Waker>(this);
  // Before the token is looked at: a removal in between is seen then.
  const bool ends_with_token = is_question() && !token_id.empty();
  const auto watch = ends_with_token ? tokens.watch(token_id, [waker = waker_] { waker->wake(); }) : nullptr;
  bool is_first = true;
  bool is_last = is_abandoned_;
  while (!has_lost_its_token()) {
    woken_ = false;  // before asking: a wake that comes meanwhile must lead to another question
    // Of what was done the log has the answer, also if nobody waits for it any more.
    const bool is_for_log = is_abandoned_ && !is_question();
    auto task = as_worker_task([this, is_first, is_last] { ask_later(is_first, is_last); }, is_for_log);
    shared_.workers.submit_pull(std::move(task));
    co_await wait_for_worker();
    is_first = false;
    if (late_ || closing_) break;
    auto look_at = until;
    if (ends_with_token) {
      const std::chrono::milliseconds left(std::max<std::int64_t>(1, tokens.expires_unix_ms(token_id) - unix_time_ms()));
      look_at = std::min(look_at, Connection::Clock::now() + left);
    }
    connection_->watch_peer();
    while (!woken_ && !closing_ && !draining_ && !peer_is_over() && Connection::Clock::now() < look_at) {
      co_await connection_->wait(look_at);
    }
    is_abandoned_ = peer_is_over() && !closing_;
    if (is_abandoned_) close();
    if (closing_ && (!is_abandoned_ || is_question())) break;
    is_last = is_abandoned_ || draining_ || Connection::Clock::now() >= until;
  }
  connection_->unwatch_peer();
  worker_is_done_ = false;
  shared_.workers.submit_pull([self = shared_from_this()] {
    self->response_.later.reset();
    self->on_strand([self] {
      self->worker_is_done_ = true;
      self->connection_->notify();
    });
  });
  co_await wait_for_worker();
  waker_->detach();
  waker_.reset();
  if (late_) {
    response_ = std::move(*late_);
    has_answer_ = !response_.gave_up;
  }
  late_.reset();
}

}  // namespace colony::server::http
