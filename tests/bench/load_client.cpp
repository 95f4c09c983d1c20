#include "tests/bench/load_client.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>
#include <optional>
#include <stdexcept>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>

namespace colony::bench {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kAnswerBytesMax = 256 * 1024 * 1024;
constexpr std::size_t kOpenConnectionsMax = 400;

double milliseconds(Clock::duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(what); }

/// One connection; `on_answer` may ask again.
class Client {
 public:
  Client(asio::io_context& io, std::uint16_t port) : socket_(io) {
    socket_.connect(tcp::endpoint(asio::ip::address_v4::loopback(), port));
    socket_.set_option(tcp::no_delay(true));
  }

  void ask(const std::string& request, std::function<void()> on_answer) {
    on_answer_ = std::move(on_answer);
    asio::async_write(socket_, asio::buffer(request), [this](error_code error, std::size_t) {
      if (error) fail("a request could not be sent: " + error.message());
    });
    parser_.emplace();
    parser_->body_limit(kAnswerBytesMax);
    beast::http::async_read(socket_, buffer_, *parser_, [this](error_code error, std::size_t) {
      if (error) fail("no answer: " + error.message());
      was_refused_ = parser_->get().result_int() == 503;
      if (parser_->get().result_int() != 200 && !was_refused_) {
        fail("the answer is " + std::to_string(parser_->get().result_int()) + ": " + parser_->get().body());
      }
      on_answer_();
    });
  }
  bool was_refused() const { return was_refused_; }

 private:
  tcp::socket socket_;
  beast::flat_buffer buffer_;
  std::optional<beast::http::response_parser<beast::http::string_body>> parser_;
  std::function<void()> on_answer_;
  bool was_refused_ = false;
};

}  // namespace

double Latencies::quantile_ms(double share) const {
  if (all_ms.empty()) return 0.0;
  std::vector<double> sorted = all_ms;
  std::sort(sorted.begin(), sorted.end());
  const double rank = std::ceil(share * static_cast<double>(sorted.size()));
  return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(std::max(1.0, rank)) - 1)];
}

std::string get_text(const std::string& path, const std::string& headers) {
  return "GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\n" + headers + "\r\n";
}

Latencies closed_loop(std::uint16_t port, const std::string& request, std::size_t connections, double seconds) {
  asio::io_context io(1);
  Latencies out;
  std::vector<std::unique_ptr<Client>> clients;
  const double cpu_before_s = thread_cpu_s();
  const auto begin = Clock::now();
  const auto end = begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  std::vector<std::function<void()>> again(connections);
  std::vector<Clock::time_point> asked(connections);
  for (std::size_t i = 0; i < connections; ++i) {
    clients.push_back(std::make_unique<Client>(io, port));
    again[i] = [&, i] {
      const auto now = Clock::now();
      if (clients[i]->was_refused()) fail("the server is busy");
      out.all_ms.push_back(milliseconds(now - asked[i]));
      if (now >= end) return;
      asked[i] = now;
      clients[i]->ask(request, again[i]);
    };
    asked[i] = Clock::now();
    clients[i]->ask(request, again[i]);
  }
  io.run();
  out.wall_s = std::chrono::duration<double>(Clock::now() - begin).count();
  out.cpu_s = thread_cpu_s() - cpu_before_s;
  return out;
}

Latencies open_loop(std::uint16_t port, const std::function<const std::string&(std::size_t index)>& next,
                    double rate_per_s, double seconds) {
  asio::io_context io(1);
  Latencies out;
  std::vector<std::unique_ptr<Client>> clients;
  std::vector<Client*> idle;
  asio::steady_timer timer(io);
  const auto count = static_cast<std::size_t>(rate_per_s * seconds);
  const double cpu_before_s = thread_cpu_s();
  const auto begin = Clock::now();
  std::size_t sent = 0;
  const auto due = [&](std::size_t index) {
    return begin + std::chrono::duration_cast<Clock::duration>(
                       std::chrono::duration<double>(static_cast<double>(index) / rate_per_s));
  };
  std::function<void(error_code)> tick = [&](error_code) {
    for (; sent < count && due(sent) <= Clock::now(); ++sent) {
      if (idle.empty()) {
        if (clients.size() - out.refused >= kOpenConnectionsMax) {
          ++out.refused;
          continue;
        }
        clients.push_back(std::make_unique<Client>(io, port));
        idle.push_back(clients.back().get());
      }
      Client* const client = idle.back();
      idle.pop_back();
      client->ask(next(sent), [&, client, at = due(sent)] {
        out.all_ms.push_back(milliseconds(Clock::now() - at));
        if (client->was_refused()) {
          ++out.refused;  // and the server has closed the connection
        } else {
          idle.push_back(client);
        }
      });
    }
    if (sent == count) return;
    timer.expires_at(due(sent));
    timer.async_wait(tick);
  };
  tick({});
  io.run();
  out.wall_s = std::chrono::duration<double>(Clock::now() - begin).count();
  out.cpu_s = thread_cpu_s() - cpu_before_s;
  return out;
}

namespace {

class BareSession : public std::enable_shared_from_this<BareSession> {
 public:
  BareSession(tcp::socket socket, const std::string& body) : socket_(std::move(socket)), body_(body) {
    socket_.set_option(tcp::no_delay(true));
  }

  void read() {
    request_ = {};
    beast::http::async_read(socket_, buffer_, request_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->answer();
    });
  }

 private:
  void answer() {
    response_ = {beast::http::status::ok, request_.version()};
    response_.set(beast::http::field::content_type, "application/json");
    response_.keep_alive(request_.keep_alive());
    response_.body() = body_;
    response_.prepare_payload();
    beast::http::async_write(socket_, response_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->read();
    });
  }

  tcp::socket socket_;
  const std::string& body_;
  beast::flat_buffer buffer_;
  beast::http::request<beast::http::string_body> request_;
  beast::http::response<beast::http::string_body> response_;
};

}  // namespace

int serve_bare(std::size_t bytes) {
  asio::io_context io(1);
  const std::string body(bytes, 'x');
  tcp::acceptor acceptor(io, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  asio::signal_set signals(io, SIGTERM);
  signals.async_wait([&](error_code, int) { io.stop(); });
  std::function<void()> accept = [&] {
    acceptor.async_accept([&](error_code error, tcp::socket socket) {
      if (error) return;
      std::make_shared<BareSession>(std::move(socket), body)->read();
      accept();
    });
  };
  accept();
  std::printf("listening on http://127.0.0.1:%u\n", static_cast<unsigned>(acceptor.local_endpoint().port()));
  std::fflush(stdout);
  io.run();
  return 0;
}

}  // namespace colony::bench
