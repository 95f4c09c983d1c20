#include "server/http/server.hpp"

#include <algorithm>
#include <array>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/strand.hpp>

#include "engine/base/check.hpp"
#include "server/http/session.hpp"
#include "server/http/text.hpp"
#include "server/http/tls.hpp"

namespace colony::server::http {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
namespace {

constexpr int kConnectionsInBacklogMax = 512;  // not yet accepted; the kernel holds them
constexpr int kRefusedLingeringMax = 64;
constexpr std::chrono::milliseconds kRefusedLinger{500};
constexpr std::chrono::milliseconds kAcceptPause{100};

Error config_error(std::string field, std::string message) {
  return {ErrorCode::kInvalid, "the configuration cannot be used", {{std::move(field), std::move(message)}}};
}

/// What would make a server that never answers, or a rule that never matches.
Status check_config(const ServerConfig& config) {
  const std::pair<const char*, std::size_t> counts[] = {
      {"io_threads", config.io_threads},
      {"worker_threads", config.worker_threads},
      {"connections_max", config.connections_max},
      {"requests_waiting_max", config.requests_waiting_max},
      {"header_bytes_max", config.header_bytes_max},
      {"header_fields_max", config.header_fields_max},
      {"target_bytes_max", config.target_bytes_max},
      {"connections_per_address_max", config.connections_per_address_max},
      {"handshake_timeout_ms", config.handshake_timeout_ms > 0},
      {"header_timeout_ms", config.header_timeout_ms > 0},
      {"body_timeout_ms", config.body_timeout_ms > 0},
      {"idle_timeout_ms", config.idle_timeout_ms > 0},
      {"write_timeout_ms", config.write_timeout_ms > 0},
      {"stream_keep_alive_ms", config.stream_keep_alive_ms > 0},
  };
  for (const auto& [name, value] : counts) {
    if (value == 0) return config_error(std::string("server.") + name, "must be greater than 0");
  }
  for (const auto& host : config.allowed_hosts) {
    const auto authority = parse_authority(host);
    if (!authority || authority->port)
      return config_error("server.allowed_hosts", "'" + host + "' is not a host without port");
  }
  const std::string& base = config.base_path;
  if (!base.empty() && (base.front() != '/' || base.back() == '/')) {
    return config_error("server.base_path", "must begin with '/' and not end with one");
  }
  return Ok{};
}

AdmissionConfig admission_config(const ServerConfig& config) {
  AdmissionConfig out;
  out.tokens_required = config.tokens_required;
  out.trusts_forwarded_for = config.trusts_forwarded_for;
  out.limits_loopback = config.limits_loopback;
  out.requests = {config.requests_per_s, config.requests_burst};
  out.failed_tokens_per_min = config.failed_tokens_per_min;
  return out;
}

std::string to_text(const tcp::endpoint& endpoint) {
  return endpoint.address().to_string() + ":" + std::to_string(endpoint.port());
}

Error listen_error(std::string message) { return config_error("server.listen", std::move(message)); }

// A connection beyond the limit: it gets its answer unread, without a session. It is kept for a moment, as a close with
// unread bytes would take the answer away again.
class RefusedConnection : public std::enable_shared_from_this<RefusedConnection> {
 public:
  RefusedConnection(tcp::socket socket, std::atomic<int>& count)
      : socket_(std::move(socket)), timer_(socket_.get_executor()), count_(count) {
    ++count_;
  }
  ~RefusedConnection() { --count_; }

  void linger() {
    timer_.expires_after(kRefusedLinger);
    timer_.async_wait([self = shared_from_this()](error_code error) {
      error_code ignored;
      if (!error) self->socket_.close(ignored);
    });
    read();
  }

 private:
  void read() {
    socket_.async_read_some(asio::buffer(bytes_), [self = shared_from_this()](error_code error, std::size_t) {
      if (error) {
        self->timer_.cancel();
      } else {
        self->read();
      }
    });
  }

  tcp::socket socket_;
  asio::steady_timer timer_;
  std::atomic<int>& count_;
  std::array<char, 1024> bytes_;
};

class BeastServer final : public Server {
 public:
  BeastServer(ServerConfig config, const Router& router, const TokenTable& tokens,
              std::function<void(const AccessRecord&)> log)
      : config_(std::move(config)),
        admission_(admission_config(config_), tokens),
        workers_(config_.worker_threads, config_.requests_waiting_max),
        shared_{config_,    policy_,  router,       admission_,
                workers_,   request_ids_, std::move(log), [this](std::uint64_t id) { on_end(id); }},
        acceptor_(asio::make_strand(io_)),
        pause_(acceptor_.get_executor()),
        work_(asio::make_work_guard(io_)) {}

  ~BeastServer() override { BeastServer::stop(0); }

  Status listen() {
    error_code error;
    const auto address = asio::ip::make_address(config_.address, error);
    if (error) return listen_error("'" + config_.address + "' is not an IP address");
    const bool has_tls = !config_.tls_certificate.empty();
    if (!address.is_loopback() && !(config_.tokens_required && (has_tls || config_.behind_proxy))) {
      return listen_error("'" + config_.address +
                          "' is not a loopback address: it needs tokens, and TLS or a proxy that does it");
    }
    if (has_tls) {
      auto made = make_tls_context(config_.tls_certificate, config_.tls_key);
      if (!made) return made.error();
      tls_ = std::move(*made);
      shared_.tls = tls_.get();
    }
    const tcp::endpoint endpoint(address, config_.port);
    acceptor_.open(endpoint.protocol(), error);
    // Without it a restarted server waits for the connections of the one before it.
    if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(kConnectionsInBacklogMax, error);
    if (error) return Error{ErrorCode::kUnavailable, "cannot listen on " + to_text(endpoint) + ": " + error.message()};
    policy_.port = acceptor_.local_endpoint().port();
    for (const auto& host : config_.allowed_hosts) {
      std::string lower(host.size(), '\0');
      std::transform(host.begin(), host.end(), lower.begin(), to_lower);
      policy_.allowed_hosts.push_back(std::move(lower));
    }
    policy_.cors_origins = config_.cors_origins;
    policy_.header_bytes_max = config_.header_bytes_max;
    policy_.header_fields_max = config_.header_fields_max;
    policy_.target_bytes_max = config_.target_bytes_max;
    policy_.body_bytes_max = config_.body_bytes_max;
    if (!config_.large_body_path.empty()) policy_.large_body_path = config_.base_path + config_.large_body_path;
    policy_.large_body_bytes_max = config_.large_body_bytes_max;
    return Ok{};
  }

  std::uint16_t port() const override { return policy_.port; }

  void run() override {
    workers_.start();
    accept();
    for (std::size_t i = 0; i < config_.io_threads; ++i) threads_.emplace_back([this] { io_.run(); });
  }

  void stop(std::int64_t grace_ms) override {
    const std::lock_guard once(stop_mutex_);
    if (stopped_) return;
    stopped_ = true;
    asio::post(acceptor_.get_executor(), [this] {
      error_code ignored;
      acceptor_.close(ignored);
      pause_.cancel();
    });
    {
      std::unique_lock lock(mutex_);
      draining_ = true;
      for (const auto& [id, entry] : sessions_) entry.session->drain();
      ended_.wait_for(lock, std::chrono::milliseconds(grace_ms), [this] { return sessions_.empty(); });
      for (const auto& [id, entry] : sessions_) entry.session->close();
      // What still keeps a session now is a handler or a pull that runs.
      ended_.wait(lock, [this] { return sessions_.empty(); });
    }
    workers_.stop();
    work_.reset();
    io_.stop();
    for (auto& thread : threads_) thread.join();
  }

 private:
  void accept() {
    acceptor_.async_accept(asio::make_strand(io_), [this](error_code error, tcp::socket socket) {
      if (!acceptor_.is_open()) return;
      if (!error) {
        on_connection(std::move(socket));
      } else if (error != asio::error::connection_aborted) {
        // Out of descriptors or memory: at once again would only burn the time of those who could give some back.
        pause_.expires_after(kAcceptPause);
        pause_.async_wait([this](error_code) {
          if (acceptor_.is_open()) accept();
        });
        return;
      }
      accept();
    });
  }

  void on_connection(tcp::socket socket) {
    error_code error;
    const auto remote = socket.remote_endpoint(error);
    if (error) return;  // gone already
    const auto client = client_address(remote.address().to_string());
    CHECK(client.has_value());
    const bool is_counted = !client->is_loopback || config_.limits_loopback;
    std::shared_ptr<Session> session;
    bool is_too_many_of_one = false;
    {
      const std::lock_guard lock(mutex_);
      if (draining_) return;
      is_too_many_of_one = is_counted && of_address_[client->key] >= config_.connections_per_address_max;
      if (sessions_.size() < config_.connections_max && !is_too_many_of_one) {
        const std::uint64_t id = ++session_count_;
        session = std::make_shared<Session>(std::move(socket), shared_, id, to_text(remote), *client);
        sessions_.emplace(id, Entry{session, is_counted ? client->key : std::string()});
        if (is_counted) ++of_address_[client->key];
      } else if (is_counted && of_address_[client->key] == 0) {
        of_address_.erase(client->key);
      }
    }
    if (session) {
      session->start();
    } else {
      refuse(std::move(socket), is_too_many_of_one ? "too many connections come from your address; close some"
                                                   : "too many connections are open; try again in a second");
    }
  }

  void refuse(tcp::socket socket, std::string_view why) {
    if (tls_) return;  // what is said before a handshake would be noise; a close is understood
    const std::string id = request_ids_.next();
    Response response = problem(503, "too-many-connections", "The server has too many connections", why, id);
    response.headers.set("Retry-After", "1");
    WireOptions options;
    options.keep_alive = false;
    options.request_id = id;
    const std::string bytes = write_head(response, options) + response.body;
    error_code error;
    socket.non_blocking(true, error);
    // One write without waiting: the buffer of a new socket takes it whole.
    if (!error) socket.write_some(asio::buffer(bytes), error);
    if (!error) socket.shutdown(tcp::socket::shutdown_send, error);
    if (!error && refused_count_ < kRefusedLingeringMax) {
      std::make_shared<RefusedConnection>(std::move(socket), refused_count_)->linger();
    }
  }

  void on_end(std::uint64_t id) {
    const std::lock_guard lock(mutex_);
    const auto ended = sessions_.find(id);
    if (const auto of = of_address_.find(ended->second.address_key); of != of_address_.end() && --of->second == 0) {
      of_address_.erase(of);
    }
    sessions_.erase(ended);
    ended_.notify_all();
  }

  struct Entry {
    std::shared_ptr<Session> session;
    std::string address_key;  // empty: not counted
  };

  const ServerConfig config_;  // fixed after construction, as is all down to shared_ (policy_: after listen)
  GatePolicy policy_;
  std::atomic<int> refused_count_{0};
  std::unique_ptr<asio::ssl::context> tls_;  // null: plain
  Admission admission_;     // synchronises itself, as all down to workers_
  RequestIds request_ids_;
  asio::io_context io_;
  WorkerPool workers_;
  SessionShared shared_;

  tcp::acceptor acceptor_;  // on its own strand, with pause_
  asio::steady_timer pause_;
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  std::vector<std::thread> threads_;  // run and stop

  std::mutex stop_mutex_;  // guards stopped_
  bool stopped_ = false;
  std::mutex mutex_;  // guards everything below
  std::condition_variable ended_;
  bool draining_ = false;
  std::uint64_t session_count_ = 0;
  std::map<std::uint64_t, Entry> sessions_;  // at most config_.connections_max
  std::map<std::string, std::size_t> of_address_;  // open connections that are counted
};

}  // namespace

Result<std::unique_ptr<Server>> Server::create(ServerConfig config, const Router& router, const TokenTable& tokens,
                                               std::function<void(const AccessRecord&)> log) {
  if (const auto status = check_config(config); !status) return status.error();
  auto server = std::make_unique<BeastServer>(std::move(config), router, tokens, std::move(log));
  const auto status = server->listen();
  if (!status) return status.error();
  return std::unique_ptr<Server>(std::move(server));
}

}  // namespace colony::server::http
