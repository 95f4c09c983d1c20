#include "server/http/session.hpp"

#include <random>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>

#include "server/http/body_reader.hpp"

namespace colony::server::http {
namespace asio = boost::asio;
namespace {

using Io = Connection::Io;

constexpr std::size_t kHeadReadBytes = 4 * 1024;
constexpr std::size_t kBodyReadBytes = 64 * 1024;
constexpr std::size_t kIdleInputBytesMax = 16 * 1024;   // an idle connection keeps no larger buffer
constexpr std::size_t kJoinedBodyBytesMax = 32 * 1024;  // up to here head and body are sent in one write

std::uint64_t random_64() {
  std::random_device device;
  return (static_cast<std::uint64_t>(device()) << 32) | device();
}

// The finaliser of splitmix64: a bijection, so that different counts give different ids.
std::uint64_t mix(std::uint64_t value) {
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
  return value ^ (value >> 31);
}

void append_hex(std::string& out, std::uint64_t value) {
  for (int shift = 60; shift >= 0; shift -= 4) out += "0123456789abcdef"[(value >> shift) & 0xf];
}

Refusal timed_out(std::string_view what, std::int64_t timeout_ms) {
  return {408, "request-timeout", "The request took too long",
          "the " + std::string(what) + " must be complete within " + std::to_string(timeout_ms) + " ms"};
}

}  // namespace

RequestIds::RequestIds() : seed_high_(random_64()), seed_low_(random_64()) {}

std::string RequestIds::next() {
  const std::uint64_t count = ++count_;
  std::string id;
  append_hex(id, mix(seed_high_ ^ count));
  append_hex(id, mix(seed_low_ + count));
  return id;
}

Session::Session(asio::ip::tcp::socket socket, SessionShared& shared, std::uint64_t id, std::string remote,
                 ClientAddress peer)
    : connection_(std::make_shared<Connection>(std::move(socket), shared.tls)),
      shared_(shared),
      id_(id),
      remote_(std::move(remote)),
      peer_(std::move(peer)) {}

void Session::start() { asio::co_spawn(connection_->executor(), run(shared_from_this()), asio::detached); }

void Session::on_strand(std::function<void()> task) { asio::post(connection_->executor(), std::move(task)); }

void Session::drain() {
  on_strand([self = shared_from_this()] {
    self->draining_ = true;
    if (self->gives_up_) *self->gives_up_ = true;
    // A request whose header is incomplete has not begun: its sender may safely repeat it elsewhere.
    if (self->phase_ != Phase::kAnswering) self->connection_->close();
    self->connection_->notify();
  });
}

void Session::close() {
  closing_ = true;
  on_strand([self = shared_from_this()] {
    if (self->gives_up_) *self->gives_up_ = true;
    self->connection_->close();
  });
}

Awaitable<void> Session::run(std::shared_ptr<Session> self) {
  try {
    const Io io = co_await self->connection_->handshake(self->shared_.config.handshake_timeout_ms);
    bool goes_on = io == Io::kDone;
    while (goes_on) goes_on = co_await self->serve_one();
  } catch (const std::exception& error) {
    // Only a lack of memory can come here; the connection ends, the server goes on.
    self->shared_.router.report_failure(self->request_, error.what());
  }
  self->let_go_of_stream();
  self->give_back_large_body();
  self->connection_->close();
  self->shared_.on_end(self->id_);
}

Awaitable<bool> Session::serve_one() {
  give_back_large_body();
  head_ = RequestHead();
  request_ = Request();
  response_ = Response();
  refusal_.reset();
  gives_up_.reset();
  is_inside_ = false;
  is_admitted_ = false;
  forwarded_.clear();
  sent_bytes_ = 0;
  has_answer_ = false;
  bool goes_on = co_await read_head();
  if (!goes_on) co_return false;
  served_before_ = true;
  if (!refusal_) {
    is_inside_ = fill_request();
    if (is_inside_) destination_ = shared_.router.find(request_.method, request_.path);
    refusal_ = admit();
  }
  if (!refusal_) {
    goes_on = co_await read_body();
    if (!goes_on) co_return false;
    if (!refusal_ && token_is_over()) refusal_ = token_has_ended();
  }
  if (head_.request_id.empty()) head_.request_id = shared_.request_ids.next();
  request_.request_id = head_.request_id;
  if (!refusal_) {
    if (is_inside_) {
      co_await handle();
      settle_answer();
    } else {
      response_ = problem(404, "not-found", "There is nothing here", "no resource has the path " + request_.path,
                          request_.request_id);
    }
  }
  co_return co_await answer();
}

Awaitable<bool> Session::read_head() {
  phase_ = Phase::kReadingHead;
  std::string& input = connection_->input();
  if (input.empty() && input.capacity() > kIdleInputBytesMax) input.shrink_to_fit();
  HeadScanner scanner;
  bool has_begun = false;
  bool has_skipped_line = false;
  connection_->arm(served_before_ ? shared_.config.idle_timeout_ms : shared_.config.header_timeout_ms);
  for (;;) {
    if (draining_) co_return false;
    if (!has_begun) {
      // One empty line before a request is let pass (RFC 9112, 2.2): old clients end a body with it.
      if (!has_skipped_line && input.compare(0, 2, "\r\n") == 0) {
        input.erase(0, 2);
        has_skipped_line = true;
      }
      if (!input.empty() && input != "\r") {
        has_begun = true;
        begin_ = Connection::Clock::now();
        connection_->arm(shared_.config.header_timeout_ms);
      }
    }
    if (has_begun) {
      const auto state = scanner.scan(input, shared_.policy);
      if (state == HeadScanner::State::kRefused) refusal_ = scanner.refusal();
      if (state == HeadScanner::State::kComplete) {
        refusal_ = examine(std::string_view(input).substr(0, scanner.head_size()), shared_.policy, head_);
        input.erase(0, scanner.head_size());
      }
      if (state != HeadScanner::State::kNeedMore) break;
    }
    const Io io = co_await connection_->read(kHeadReadBytes);
    if (io == Io::kDone) continue;
    if (io == Io::kClosed || !has_begun) co_return false;
    refusal_ = timed_out("header", shared_.config.header_timeout_ms);
    break;
  }
  connection_->disarm();
  phase_ = Phase::kAnswering;
  co_return true;
}

std::optional<Refusal> Session::admit() {
  const bool is_forwarded = shared_.admission.config().trusts_forwarded_for;
  const ClientAddress client = is_forwarded ? forwarded_address(head_.headers, peer_) : peer_;
  if (is_forwarded) forwarded_ = client.text;
  // What lies outside the base path is nowhere.
  const Access access = is_inside_ ? Router::access_of(request_.method, destination_) : Access::kRead;
  auto refusal =
      shared_.admission.admit(head_.headers, access, client, Admission::Moment::now(), request_.principal);
  if (refusal) return refusal;
  is_admitted_ = true;
  return take_large_body();
}

// Bodies beyond the common limit are counted: thirty megabytes a connection would be more than the machine has.
std::optional<Refusal> Session::take_large_body() {
  if (!head_.may_be_large) return std::nullopt;
  if (shared_.large_bodies.fetch_add(1) >= shared_.config.large_bodies_max) {
    shared_.large_bodies.fetch_sub(1);
    return Refusal{503, "overloaded", "The server is busy",
                   "too many large bodies are being received already; try again in a second"};
  }
  holds_large_body_ = true;
  return std::nullopt;
}

void Session::give_back_large_body() {
  if (std::exchange(holds_large_body_, false)) shared_.large_bodies.fetch_sub(1);
}

Awaitable<bool> Session::read_body() {
  std::string& input = connection_->input();
  if (head_.expects_continue && input.empty()) {
    const Io io = co_await connection_->write(kContinue, shared_.config.write_timeout_ms);
    if (io != Io::kDone) co_return false;
  }
  BodyReader reader(head_, head_.body_bytes_max);
  connection_->arm(shared_.config.body_timeout_ms);
  for (;;) {
    const auto state = reader.feed(input);
    if (state == BodyReader::State::kRefused) refusal_ = reader.refusal();
    if (state == BodyReader::State::kComplete) request_.body = reader.take_body();
    if (state != BodyReader::State::kNeedMore) break;
    const Io io = co_await connection_->read(kBodyReadBytes);
    if (io == Io::kDone) continue;
    if (io == Io::kClosed) co_return false;
    refusal_ = timed_out("body", shared_.config.body_timeout_ms);
    break;
  }
  connection_->disarm();
  co_return true;
}

// False: outside base_path.
bool Session::fill_request() {
  request_.method = head_.method;
  request_.path = head_.target.path;
  request_.query = head_.target.query;
  request_.headers = head_.headers;
  const std::string& base = shared_.config.base_path;
  if (base.empty() || request_.path == kServerTarget) return true;
  const bool is_inside = request_.path.compare(0, base.size(), base) == 0 &&
                         (request_.path.size() == base.size() || request_.path[base.size()] == '/');
  if (!is_inside) return false;
  request_.path.erase(0, base.size());
  if (request_.path.empty()) request_.path = "/";
  return true;
}

void Session::prepare_response() {
  if (refusal_) {
    response_ = answer_of(*refusal_, head_.request_id);
  } else if (const auto fault = fault_of(response_)) {
    let_go_of_stream();
    shared_.router.report_failure(request_, *fault);
    response_ = problem(500, "internal", "The server made a mistake", "the server's log has more under this request_id",
                        head_.request_id);
  }
  keep_alive_ = head_.keep_alive && !refusal_ && !draining_;
}

Awaitable<bool> Session::answer() {
  if (closing_ && !is_abandoned_) co_return false;
  if (is_abandoned_ && !refusal_ && !has_answer_) {
    response_ = Response();
    response_.status = kPeerHasLeft;
  } else {
    prepare_response();
  }
  if (is_abandoned_) {
    let_go_of_stream();
    write_log();
    co_return false;
  }
  WireOptions options;
  options.version_minor = head_.version_minor;
  options.request_id = head_.request_id;
  options.is_encrypted = connection_->is_encrypted();
  options.cors_origin = head_.cors_origin;
  options.varies_by_origin = !shared_.config.cors_origins.empty();
  if (response_.stream) options.framing = head_.version_minor == 0 ? Framing::kUntilClose : Framing::kChunked;
  if (options.framing == Framing::kUntilClose) keep_alive_ = false;
  options.keep_alive = keep_alive_;
  const std::string head = write_head(response_, options);
  bool is_sent = co_await send_plain(head);
  if (is_sent && response_.stream && head_.method != "HEAD") {
    is_sent = co_await send_stream(options.framing);
    connection_->unwatch_peer();
  }
  let_go_of_stream();
  write_log();
  if (!is_sent) co_return false;
  if (keep_alive_) co_return true;
  phase_ = Phase::kLingering;
  if (!draining_) co_await connection_->linger();
  co_return false;
}

Awaitable<bool> Session::send_plain(const std::string& head) {
  const bool with_body = head_.method != "HEAD" && !response_.stream;
  const bool is_joined = with_body && response_.body.size() <= kJoinedBodyBytesMax;
  const std::string first = is_joined ? head + response_.body : head;
  Io io = co_await connection_->write(first, shared_.config.write_timeout_ms);
  if (io == Io::kDone && with_body && !is_joined) {
    io = co_await connection_->write(response_.body, shared_.config.write_timeout_ms);
  }
  if (io == Io::kDone && with_body) sent_bytes_ = response_.body.size();
  co_return io == Io::kDone;
}

void Session::write_log() const {
  if (!shared_.log) return;
  AccessRecord record;
  record.method = head_.method;
  record.path = head_.target.path;
  record.request_id = head_.request_id;
  record.remote = forwarded_.empty() ? remote_ : forwarded_;
  record.status = response_.status;
  record.body_bytes = sent_bytes_;
  record.actor = is_admitted_ || !request_.principal.token_id.empty() ? request_.principal.name : std::string();
  record.token_id = request_.principal.token_id;
  record.peer_left = is_abandoned_;
  const auto duration = Connection::Clock::now() - begin_;
  record.duration_us = std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
  shared_.log(record);
}

}  // namespace colony::server::http
