#include "server/http/connection.hpp"

#include <algorithm>
#include <tuple>

#include <boost/asio/buffer.hpp>

namespace colony::server::http {
namespace asio = boost::asio;
using boost::system::error_code;
namespace {

constexpr std::size_t kReadAheadStepBytes = 2 * 1024;
constexpr std::int64_t kLingerMs = 2'000;
constexpr std::size_t kLingerStepBytes = 64 * 1024;
constexpr std::size_t kLingerBytesMax = 32 * 1024 * 1024;

}  // namespace

Connection::Connection(asio::ip::tcp::socket socket, asio::ssl::context* tls)
    : socket_(std::move(socket)), deadline_(socket_.get_executor()), signal_(socket_.get_executor()) {
  error_code ignored;  // a socket that died already fails at its first read
  socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
  socket_.non_blocking(true, ignored);
  if (tls != nullptr) tls_ = std::make_unique<asio::ssl::stream<asio::ip::tcp::socket&>>(socket_, *tls);
}

Awaitable<Connection::Io> Connection::handshake(std::int64_t timeout_ms) {
  if (!tls_) co_return Io::kDone;
  arm(timeout_ms);
  const auto [error] = co_await tls_->async_handshake(asio::ssl::stream_base::server, kAwait);
  const bool is_late = deadline_has_passed_;
  disarm();
  if (!error) co_return Io::kDone;
  co_return is_late ? Io::kTimeout : Io::kClosed;
}

void Connection::arm(std::int64_t timeout_ms) {
  disarm();
  deadline_.expires_after(std::chrono::milliseconds(timeout_ms));
  deadline_.async_wait([self = shared_from_this(), generation = deadline_generation_](error_code error) {
    if (error || generation != self->deadline_generation_) return;
    self->deadline_has_passed_ = true;
    error_code ignored;
    self->socket_.cancel(ignored);
  });
}

void Connection::disarm() {
  ++deadline_generation_;
  deadline_has_passed_ = false;
  deadline_.cancel();
}

Awaitable<Connection::Io> Connection::read(std::size_t bytes_max) {
  // The deadline may have passed while no operation was there to cancel.
  if (deadline_has_passed_) co_return Io::kTimeout;
  if (!socket_.is_open()) co_return Io::kClosed;
  const std::size_t size_before = input_.size();
  input_.resize(size_before + bytes_max);
  const asio::mutable_buffer space(input_.data() + size_before, bytes_max);
  boost::system::error_code error;
  std::size_t count = 0;
  if (tls_) {
    std::tie(error, count) = co_await tls_->async_read_some(space, kAwait);
  } else {
    std::tie(error, count) = co_await socket_.async_read_some(space, kAwait);
  }
  input_.resize(size_before + count);
  if (!error) co_return Io::kDone;
  co_return deadline_has_passed_ ? Io::kTimeout : Io::kClosed;
}

namespace {

// Takes `count` bytes off the front; false: nothing is left.
bool advance(Connection::Pieces& pieces, std::size_t count) {
  bool is_left = false;
  for (std::string_view& piece : pieces) {
    const std::size_t taken = std::min(count, piece.size());
    piece.remove_prefix(taken);
    count -= taken;
    is_left = is_left || !piece.empty();
  }
  return is_left;
}

std::array<asio::const_buffer, 4> buffers_of(const Connection::Pieces& pieces) {
  std::array<asio::const_buffer, 4> buffers;
  for (std::size_t i = 0; i < pieces.size(); ++i) buffers[i] = asio::const_buffer(pieces[i].data(), pieces[i].size());
  return buffers;
}

}  // namespace

Awaitable<Connection::Io> Connection::write(Pieces bytes, std::int64_t timeout_ms) {
  disarm();
  if (!socket_.is_open()) co_return Io::kClosed;
  // Nearly always the socket takes all at once; then no timer is needed, and no turn of the loop.
  // Not under TLS, whose records have to be made first.
  error_code error;
  std::size_t count = tls_ ? 0 : socket_.write_some(buffers_of(bytes), error);  // does not block
  if (error == asio::error::would_block || error == asio::error::try_again) error.clear();
  if (error) co_return Io::kClosed;
  while (advance(bytes, count)) {
    if (!socket_.is_open()) co_return Io::kClosed;
    arm(timeout_ms);
    const auto rest = buffers_of(bytes);
    if (tls_) {
      std::tie(error, count) = co_await tls_->async_write_some(rest, kAwait);
    } else {
      std::tie(error, count) = co_await socket_.async_write_some(rest, kAwait);
    }
    if (error) co_return deadline_has_passed_ ? Io::kTimeout : Io::kClosed;
  }
  disarm();
  co_return Io::kDone;
}

Awaitable<void> Connection::wait(Clock::time_point until) {
  signal_.expires_at(until);
  co_await signal_.async_wait(kAwait);
}

void Connection::notify() { signal_.cancel(); }

void Connection::watch_peer() {
  if (watching_ || peer_has_left_ || !socket_.is_open()) return;
  if (!peer_has_closed_ && peer_sends_too_much()) return;
  watching_ = true;
  // Behind the end of its input an error is all that can come, and that is a reset.
  const bool is_for_reset = peer_has_closed_;
  socket_.async_wait(is_for_reset ? asio::ip::tcp::socket::wait_error : asio::ip::tcp::socket::wait_read,
                     [self = shared_from_this(), generation = watch_generation_, is_for_reset](error_code error) {
                       if (generation != self->watch_generation_) return;
                       self->watching_ = false;
                       if (error) return;
                       if (!is_for_reset) {
                         self->look_at_peer();
                       } else {
                         self->peer_has_left_ = true;
                         self->notify();
                       }
                     });
}

void Connection::unwatch_peer() {
  ++watch_generation_;
  if (!watching_) return;
  watching_ = false;
  error_code ignored;
  socket_.cancel(ignored);
}

void Connection::look_at_peer() {
  if (!socket_.is_open()) return;
  char bytes[kReadAheadStepBytes];
  error_code error;
  // To the end of what is there: under TLS the rest of a record is in memory, and the socket would not tell of it.
  while (!error && !peer_sends_too_much()) {
    // Neither blocks. Under TLS what came may be half a record: then it would block, too.
    const std::size_t count =
        tls_ ? tls_->read_some(asio::buffer(bytes), error) : socket_.read_some(asio::buffer(bytes), error);
    input_.append(bytes, count);
  }
  if (peer_sends_too_much()) {
    notify();
  } else if (error != asio::error::would_block && error != asio::error::try_again) {
    peer_has_closed_ = true;
    peer_has_left_ = tls_ != nullptr || error != asio::error::eof;
    notify();
  }
  watch_peer();
}

// Of the socket itself: what comes after our goodbye is thrown away unread.
Awaitable<Connection::Io> Connection::read_raw(std::size_t bytes_max) {
  if (deadline_has_passed_) co_return Io::kTimeout;
  if (!socket_.is_open()) co_return Io::kClosed;
  input_.resize(bytes_max);
  const asio::mutable_buffer space(input_.data(), bytes_max);
  const auto [error, count] = co_await socket_.async_read_some(space, kAwait);
  input_.resize(count);
  if (!error) co_return Io::kDone;
  co_return deadline_has_passed_ ? Io::kTimeout : Io::kClosed;
}

Awaitable<void> Connection::linger() {
  error_code error;
  // Says that the answer is whole (close_notify). The socket does not block, so the peer's own goodbye is not waited for.
  if (tls_) tls_->shutdown(error);
  error.clear();
  socket_.shutdown(asio::ip::tcp::socket::shutdown_send, error);
  if (!error) {
    arm(kLingerMs);
    std::size_t total = 0;
    while (total < kLingerBytesMax) {
      const Io io = co_await read_raw(kLingerStepBytes);
      if (io != Io::kDone) break;
      total += input_.size();
    }
    disarm();
  }
  close();
}

void Connection::close() {
  disarm();
  error_code ignored;
  socket_.close(ignored);
  notify();
}

void Connection::abort() {
  error_code ignored;
  if (socket_.is_open()) socket_.set_option(asio::socket_base::linger(true, 0), ignored);
  close();
}

}  // namespace colony::server::http
