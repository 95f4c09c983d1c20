// connection: one socket with deadlines, plain or under TLS: what a session needs of a socket, and nothing of HTTP.
// Promises that every read and write ends: with bytes, at its deadline, or closed. A deadline leaves the socket open,
//          so that the reason can still be told (Beast's tcp_stream would close it: no 408 could be sent).
// Threads: everything runs on the strand of executor(). At most one of read, write, wait and linger is under way.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace colony::server::http {

// GCC 12.2 destroys twice a temporary lambda with captures, or a temporary aggregate, that stands in a statement with
// co_await. In every coroutine of this folder such values have a name on a line of their own.
template <class T>
using Awaitable = boost::asio::awaitable<T>;

inline constexpr auto kAwait = boost::asio::as_tuple(boost::asio::use_awaitable);

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  enum class Io { kDone, kTimeout, kClosed };
  using Clock = std::chrono::steady_clock;

  static constexpr std::size_t kReadAheadBytesMax = 32 * 1024;

  /// `tls`: what to speak, and outlives the connection; null: nothing, the bytes go as they are.
  explicit Connection(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context* tls = nullptr);

  boost::asio::any_io_executor executor() { return socket_.get_executor(); }
  /// What was read and not yet used; pipelined requests stand here.
  std::string& input() { return input_; }

  bool is_encrypted() const { return tls_ != nullptr; }
  /// Before anything else. Without TLS there is nothing to do.
  Awaitable<Io> handshake(std::int64_t timeout_ms);

  /// One deadline for all reads until disarm or the next arm: a drip of single bytes does not prolong it.
  void arm(std::int64_t timeout_ms);
  void disarm();
  /// Appends at most `bytes_max` to input().
  Awaitable<Io> read(std::size_t bytes_max);
  /// Sends all of `bytes`, which stay where they are until then; `timeout_ms` is for each step forward and replaces the
  /// armed deadline.
  using Pieces = std::array<std::string_view, 4>;  // any of them may be empty
  Awaitable<Io> write(Pieces bytes, std::int64_t timeout_ms);
  Awaitable<Io> write(std::string_view bytes, std::int64_t timeout_ms) { return write(Pieces{bytes}, timeout_ms); }

  /// Until notify() or `until`; may also return for no reason. Check, then wait: both happen on the strand, so that
  /// nothing is lost between them.
  Awaitable<void> wait(Clock::time_point until);
  void notify();

  /// While nothing is read: notify() when the peer closes, when it has left, and when it has sent more than is kept meanwhile in input().
  /// Behind that the socket is not looked at any more: whether the peer is still there cannot be known then.
  void watch_peer();
  void unwatch_peer();
  /// Its input has ended: it is gone, or it has shut down its sending side only. TCP does not tell one from the other before something
  /// is sent: who is gone then answers with a reset.
  bool peer_has_closed() const { return peer_has_closed_; }
  /// Nobody takes what is sent: after a reset, and under TLS after any end (RFC 5246, 7.2.1: who is told close_notify drops what it
  /// would still have written).
  bool peer_has_left() const { return peer_has_left_; }
  /// More stands in input() than anybody needs to ask behind a request that is at work.
  bool peer_sends_too_much() const { return input_.size() > kReadAheadBytesMax; }

  /// Ends our side and reads until the peer ends its own, for a short time: a close with unread bytes would send a
  /// reset, and that can reach the peer before it has read the answer.
  Awaitable<void> linger();
  void close();
  /// Closes with a reset, so that a reader who waits for the end of the connection sees a failure and not an end.
  void abort();

 private:
  void look_at_peer();
  Awaitable<Io> read_raw(std::size_t bytes_max);

  boost::asio::ip::tcp::socket socket_;
  // Over socket_, which deadlines cancel and which is closed: what TLS does above it then ends with an error.
  std::unique_ptr<boost::asio::ssl::stream<boost::asio::ip::tcp::socket&>> tls_;
  boost::asio::steady_timer deadline_;
  boost::asio::steady_timer signal_;
  std::string input_;
  std::uint64_t deadline_generation_ = 0;  // a timer that fired for an older deadline means nothing
  std::uint64_t watch_generation_ = 0;
  bool deadline_has_passed_ = false;
  bool watching_ = false;
  bool peer_has_closed_ = false;
  bool peer_has_left_ = false;
};

}  // namespace colony::server::http
