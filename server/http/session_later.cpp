// The part of a session that waits for an answer which is not there yet. It holds a worker only while the answer is asked for.
#include <exception>
#include <utility>

#include "server/http/session.hpp"

namespace colony::server::http {

// On a worker.
void Session::ask_later(bool is_first, bool is_last) {
  std::string what = "a later answer threw what is not a std::exception";
  try {
    if (is_first) {
      // No wake comes after the answer is destroyed, and this session's coroutine outlives it.
      response_.later->on_ready([this] {
        on_strand([self = shared_from_this()] {
          self->woken_ = true;
          self->connection_->notify();
        });
      });
    }
    late_ = response_.later->ask(is_last);
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

Awaitable<void> Session::wait_for_later() {
  const auto until = Connection::Clock::now() + response_.later->wait_max();
  bool is_first = true;
  bool is_last = false;
  for (;;) {
    woken_ = false;  // before asking: a wake that comes meanwhile must lead to another question
    auto task = as_worker_task([this, is_first, is_last] { ask_later(is_first, is_last); });
    shared_.workers.submit_pull(std::move(task));
    co_await wait_for_worker();
    is_first = false;
    if (late_ || closing_) break;
    connection_->watch_peer();
    while (!woken_ && !closing_ && !draining_ && !connection_->peer_has_closed() && Connection::Clock::now() < until) {
      co_await connection_->wait(until);
    }
    if (connection_->peer_has_closed()) close();
    if (closing_) break;
    is_last = draining_ || Connection::Clock::now() >= until;
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
  if (late_) response_ = std::move(*late_);
  late_.reset();
}

}  // namespace colony::server::http
