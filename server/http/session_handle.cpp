// The part of a session that has a request handled: by what is in memory, or by a worker, while the peer is watched.
#include <utility>

#include "server/http/guarded_source.hpp"
#include "server/http/session.hpp"

namespace colony::server::http {
namespace {

// Who is answered within it is not watched: watching costs more than most answers.
constexpr std::chrono::milliseconds kUnwatched{50};
// What pages of listed sites may send beyond what any page may.
constexpr std::string_view kCorsRequestHeaders =
    "Authorization, Content-Type, Idempotency-Key, If-Match, If-None-Match, Last-Event-ID, Prefer, X-Request-Id";

}  // namespace

WorkerPool::Task Session::as_worker_task(std::function<void()> work, bool must) {
  worker_is_done_ = false;
  return [self = shared_from_this(), work = std::move(work), must] {
    if (must || !self->closing_) work();
    self->on_strand([self] {
      self->worker_is_done_ = true;
      self->connection_->notify();
    });
  };
}

// Also a closed session waits: the worker still uses request_, response_ or piece_.
Awaitable<void> Session::wait_for_worker() {
  while (!worker_is_done_) co_await connection_->wait(Connection::Clock::time_point::max());
}

Awaitable<void> Session::handle() {
  if (auto ready = shared_.router.dispatch_ready(request_, destination_)) {
    response_ = std::move(*ready);
    co_return;
  }
  gives_up_ = std::make_shared<std::atomic<bool>>(draining_);
  request_.gives_up = gives_up_;
  auto task = as_worker_task([this] { dispatch(); });
  const WorkerPool::Ticket ticket = shared_.workers.submit_request(std::move(task), Router::is_heavy(destination_));
  if (ticket != 0) {
    co_await wait_for_handler(ticket);
    if (response_.later) co_await wait_for_later();
  } else {
    refusal_ =
        Refusal{503, "overloaded", "The server is busy", "too many requests wait already; try again in a second"};
  }
}

// On a worker. The request may have waited for it longer than its token lived.
void Session::dispatch() {
  if (token_is_over()) {
    refusal_ = token_has_ended();
    return;
  }
  response_ = shared_.router.dispatch(request_, destination_);
  has_answer_ = !response_.gave_up && !response_.later;
}

// The end of its input alone does not say that the peer has left: it may have asked all that it wants to ask. So it is sent a 100, which any
// client of HTTP/1.1 passes over (RFC 9110, 15.2), and which is answered with a reset if nobody is there.
Awaitable<void> Session::wait_for_handler(WorkerPool::Ticket ticket) {
  const auto unwatched_until = Connection::Clock::now() + kUnwatched;
  while (!worker_is_done_ && Connection::Clock::now() < unwatched_until) co_await connection_->wait(unwatched_until);
  bool was_asked = head_.version_minor == 0;  // knows no 100
  while (!worker_is_done_) {
    connection_->watch_peer();
    // Behind too much of what it sends its end could not be seen, so that sending so much ends the request, too.
    bool has_left = connection_->peer_has_left() || connection_->peer_sends_too_much();
    if (connection_->peer_has_closed() && !has_left && !was_asked && !closing_) {
      was_asked = true;
      const Connection::Io io = co_await connection_->write(kContinue, shared_.config.write_timeout_ms);
      has_left = io != Connection::Io::kDone;
    }
    if (has_left && !closing_) abandon(ticket);
    if (!worker_is_done_) co_await connection_->wait(Connection::Clock::time_point::max());
  }
  connection_->unwatch_peer();
}

void Session::abandon(WorkerPool::Ticket ticket) {
  is_abandoned_ = true;
  *gives_up_ = true;
  close();
  if (shared_.workers.withdraw(ticket)) worker_is_done_ = true;
}

bool Session::token_is_over() const {
  const std::string& token_id = request_.principal.token_id;
  return !token_id.empty() && !shared_.admission.tokens().is_alive(token_id, unix_time_ms());
}

// A token may have ended while the answer was made. What was done was done by right; what was found is not told any more.
void Session::settle_answer() {
  if (has_lost_its_token()) {
    let_go_of_stream();
    refusal_ = token_has_ended();
    return;
  }
  if (response_.stream) {
    response_.stream = guarded(std::move(response_.stream), shared_.admission.tokens(), request_.principal);
  }
  answer_preflight();
}

// A browser asks so before it lets a page of a listed site ask. The router's answer to OPTIONS says the methods.
void Session::answer_preflight() {
  const bool is_preflight = head_.method == "OPTIONS" && !head_.cors_origin.empty() &&
                            head_.headers.count("Access-Control-Request-Method") != 0;
  if (!is_preflight || response_.status != 204) return;
  response_.headers.set("Access-Control-Allow-Methods", response_.headers.get("Allow").value_or(""));
  response_.headers.set("Access-Control-Allow-Headers", kCorsRequestHeaders);
  response_.headers.set("Access-Control-Max-Age", "600");
}

}  // namespace colony::server::http
