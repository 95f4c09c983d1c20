// session: the requests of one connection, one after the other: gate, admission, body, router, answer.
// Promises that nothing of a handler or a stream runs on an I/O thread but what is in memory already (pull_now); that every
//          request is answered in order, or the connection is closed; that a stream holds a worker only while it is
//          pulled, and is never pulled while its last piece is still being sent; that it ends soon after close(); and that
//          nothing is begun for a peer that has left, and what was begun is asked to give up; and that nothing is begun for a
//          token that has ended, however long the body was under way or the request waited.
// Does not keep a connection after a refusal: where the next request begins is then a matter of trust.
// Threads: start, drain and close from any thread; everything else on the connection's strand, but for the tasks of
//          workers, which touch request_, refusal_, response_, has_answer_ and piece_ while the session waits for them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "server/http/admission.hpp"
#include "server/http/connection.hpp"
#include "server/http/gate.hpp"
#include "server/http/router.hpp"
#include "server/http/server.hpp"
#include "server/http/wire.hpp"
#include "server/http/worker_pool.hpp"

namespace colony::server::http {

/// Random and never the same twice in a server: 32 hexadecimal digits.
class RequestIds {
 public:
  RequestIds();
  std::string next();

 private:
  const std::uint64_t seed_high_;
  const std::uint64_t seed_low_;
  std::atomic<std::uint64_t> count_{0};
};

/// What the sessions of a server share; it outlives them.
struct SessionShared {
  const ServerConfig& config;
  const GatePolicy& policy;
  const Router& router;
  Admission& admission;
  WorkerPool& workers;
  RequestIds& request_ids;
  std::function<void(const AccessRecord&)> log;  // may be empty
  std::function<void(std::uint64_t session_id)> on_end;
  boost::asio::ssl::context* tls = nullptr;  // null: plain
  std::atomic<std::size_t> large_bodies{0};  // held now; at most config.large_bodies_max
};

class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(boost::asio::ip::tcp::socket socket, SessionShared& shared, std::uint64_t id, std::string remote,
          ClientAddress peer);

  void start();
  /// Ends at once if no request is under way; else after its answer, a stream after its farewell.
  void drain();
  void close();

 private:
  enum class Phase { kReadingHead, kAnswering, kLingering };
  class Waker;

  static Awaitable<void> run(std::shared_ptr<Session> self);
  Awaitable<bool> serve_one();  // false: the connection is over
  Awaitable<bool> read_head();  // false: nothing is left to answer, here and below
  Awaitable<bool> read_body();
  Awaitable<void> handle();  // session_handle.cpp, with all that waits for a handler
  Awaitable<bool> answer();
  Awaitable<bool> send_plain(const std::string& head);
  Awaitable<bool> send_stream(Framing framing);
  Awaitable<bool> send_piece(Framing framing, std::string_view shared, std::string_view own);
  Awaitable<void> wait_for_stream(std::string_view farewell, Connection::Clock::time_point until);
  Awaitable<void> wait_for_worker();
  Awaitable<void> wait_for_handler(WorkerPool::Ticket ticket);
  void abandon(WorkerPool::Ticket ticket);
  bool peer_is_over() const { return connection_->peer_has_closed() || connection_->peer_sends_too_much(); }  // for who only waits
  Awaitable<void> wait_for_later();  // session_later.cpp
  void ask_later(bool is_first, bool is_last);

  std::optional<Refusal> admit();
  std::optional<Refusal> take_large_body();
  void give_back_large_body();
  bool fill_request();
  bool is_question() const { return head_.method == "GET" || head_.method == "HEAD"; }
  bool token_is_over() const;  // the one that was let in has been removed, or has expired
  bool has_lost_its_token() const { return is_question() && token_is_over(); }  // will not be answered any more
  void dispatch();
  void settle_answer();
  void answer_preflight();
  /// Of a closed session only what it `must` do: nobody waits for the rest.
  WorkerPool::Task as_worker_task(std::function<void()> work, bool must = false);
  void prepare_response();
  void pull_stream(bool is_first);
  bool pull_what_is_ready();
  void let_go_of_stream();
  void write_log() const;
  void on_strand(std::function<void()> task);

  const std::shared_ptr<Connection> connection_;
  SessionShared& shared_;
  const std::uint64_t id_;
  const std::string remote_;
  const ClientAddress peer_;
  std::atomic<bool> closing_{false};  // read by workers, to skip what nobody waits for
  bool draining_ = false;
  Phase phase_ = Phase::kReadingHead;
  bool served_before_ = false;

  // The request under way.
  Connection::Clock::time_point begin_;
  RequestHead head_;
  std::optional<Refusal> refusal_;
  bool is_inside_ = false;    // under base_path
  Router::Destination destination_;
  bool is_admitted_ = false;  // request_.principal is who asks
  std::string forwarded_;   // the client's address, if a trusted proxy says it
  Request request_;
  std::shared_ptr<std::atomic<bool>> gives_up_;  // of request_, once a worker has it
  bool is_abandoned_ = false;                    // its peer left before the answer
  bool has_answer_ = false;                      // a handler went to its end, whoever takes what it said
  Response response_;
  bool keep_alive_ = false;
  bool holds_large_body_ = false;
  std::uint64_t sent_bytes_ = 0;  // of the body

  bool worker_is_done_ = false;
  std::shared_ptr<Waker> waker_;
  bool woken_ = false;
  std::unique_ptr<Response> late_;  // what a later answer gave
  std::string piece_;
  std::shared_ptr<const std::string> shared_piece_;  // goes before it
  std::optional<BodySource::Pull> pulled_;  // empty: the pull threw
  std::optional<std::chrono::milliseconds> wake_after_;  // what the source asked for with it
};

}  // namespace colony::server::http
