// The half of a session that sends a BodySource.
#include <algorithm>
#include <exception>
#include <utility>

#include "server/http/session_waker.hpp"

namespace colony::server::http {

using Io = Connection::Io;

constexpr std::string_view kNothing;

// On a worker. What the source throws ends the connection without the last chunk, so that the client sees that
// the body is truncated.
void Session::pull_stream(bool is_first) {
  pulled_.reset();
  std::string what = "a stream threw what is not a std::exception";
  try {
    if (is_first) response_.stream->on_ready([waker = waker_] { waker->wake(); });
    const BodySource::Pull pulled = response_.stream->pull(piece_);
    wake_after_ = pulled == BodySource::Pull::kWait ? response_.stream->wake_after() : std::nullopt;
    pulled_ = pulled;
    return;
  } catch (const std::exception& error) {
    what = error.what();
  } catch (...) {
  }
  shared_.router.report_failure(request_, what);
}

// On the strand. False: nothing was pulled; ask a worker.
bool Session::pull_what_is_ready() {
  pulled_.reset();
  try {
    auto ready = response_.stream->pull_now(piece_);
    if (!ready) return false;
    wake_after_ = ready->pull == BodySource::Pull::kWait ? response_.stream->wake_after() : std::nullopt;
    shared_piece_ = std::move(ready->shared);
    pulled_ = ready->pull;
  } catch (const std::exception& error) {
    shared_.router.report_failure(request_, error.what());
  }
  return true;
}

Awaitable<bool> Session::send_stream(Framing framing) {
  waker_ = std::make_shared<Waker>(this);
  bool is_first = true;
  // Since the last byte, not since the last pull: one that finds nothing is no sign of life to the reader.
  const std::chrono::milliseconds silence_max(shared_.config.stream_keep_alive_ms);
  auto silent_since = Connection::Clock::now();
  for (;;) {
    // Before the pull: a wake that comes while it runs must lead to another one.
    woken_ = false;
    if (is_first || !pull_what_is_ready()) {
      auto task = as_worker_task([this, is_first] { pull_stream(is_first); });
      shared_.workers.submit_pull(std::move(task));
      co_await wait_for_worker();
    }
    is_first = false;
    if (closing_) co_return false;
    if (!pulled_) {
      if (framing == Framing::kUntilClose) connection_->abort();
      co_return false;
    }

    const bool is_silent_pull = piece_.empty() && !shared_piece_;
    const std::string_view shared = shared_piece_ ? std::string_view(*shared_piece_) : kNothing;
    bool is_sent = co_await send_piece(framing, shared, piece_);
    shared_piece_.reset();
    std::string().swap(piece_);  // a thousand streams that wait hold a thousand of what stays here
    if (!is_sent) co_return false;
    if (*pulled_ == BodySource::Pull::kEnd) break;
    if (!is_silent_pull) silent_since = Connection::Clock::now();
    // A stream with a farewell can be taken up again elsewhere; one without goes on to its end, as
    // long as the server waits for it.
    const std::string_view farewell = response_.stream->farewell();
    if (*pulled_ == BodySource::Pull::kWait) {
      auto until = silent_since + silence_max;
      if (wake_after_) until = std::min(until, Connection::Clock::now() + *wake_after_);
      co_await wait_for_stream(farewell, until);
      if (closing_ || peer_is_over()) co_return false;
      const bool is_silent = !woken_ && !(draining_ && !farewell.empty());
      if (is_silent && Connection::Clock::now() >= silent_since + silence_max) {
        is_sent = co_await send_piece(framing, kNothing, response_.stream->keep_alive());
        if (!is_sent) co_return false;
        silent_since = Connection::Clock::now();
      }
    }
    if (draining_ && !farewell.empty()) {
      is_sent = co_await send_piece(framing, kNothing, farewell);
      if (!is_sent) co_return false;
      keep_alive_ = false;
      break;
    }
  }
  if (framing == Framing::kChunked) {
    const Io io = co_await connection_->write(kLastChunk, shared_.config.write_timeout_ms);
    co_return io == Io::kDone;
  }
  co_return true;
}

// One chunk of both, in one write and uncopied.
Awaitable<bool> Session::send_piece(Framing framing, std::string_view shared, std::string_view own) {
  const std::size_t size = shared.size() + own.size();
  if (size == 0) co_return true;
  const bool is_chunk = framing == Framing::kChunked;
  const std::string size_line = is_chunk ? write_chunk_size(size) : std::string();
  const Connection::Pieces pieces = {size_line, shared, own, is_chunk ? std::string_view("\r\n") : std::string_view()};
  const Io io = co_await connection_->write(pieces, shared_.config.write_timeout_ms);
  if (io == Io::kDone) sent_bytes_ += size;
  co_return io == Io::kDone;
}

// Until the source wakes, the peer goes, the server drains or it is time for another pull or a sign of life.
Awaitable<void> Session::wait_for_stream(std::string_view farewell, Connection::Clock::time_point until) {
  connection_->watch_peer();
  while (!woken_ && !closing_ && !peer_is_over() && !(draining_ && !farewell.empty()) &&
         Connection::Clock::now() < until) {
    co_await connection_->wait(until);
  }
}

// The source is destroyed on a worker: it may hold what takes time to give back.
void Session::let_go_of_stream() {
  if (waker_) waker_->detach();
  waker_.reset();
  if (!response_.stream) return;
  shared_.workers.submit_pull(
      [stream = std::shared_ptr<BodySource>(std::move(response_.stream))]() mutable { stream.reset(); });
}

}  // namespace colony::server::http
