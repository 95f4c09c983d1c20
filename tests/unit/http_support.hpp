// http_support: a client that sends exactly the bytes it is given, and a server that tests can shape.
// Every wait of the client ends after kPatienceMs: a test then fails instead of hanging.
#pragma once

#include <mutex>
#include <condition_variable>
#include <algorithm>
#include <arpa/inet.h>
#include <cstdint>
#include <functional>
#include <memory>
#include <netinet/in.h>
#include <optional>
#include <poll.h>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

#include <gtest/gtest.h>

#include "server/http/server.hpp"

namespace colony::server::http {

/// A door that handlers wait at until the test opens it.
class Door {
 public:
  void pass() {
    std::unique_lock lock(mutex_);
    ++arrived_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return open_; });
  }
  void wait_for_arrivals(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this, count] { return arrived_ >= count; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int arrived_ = 0;
  bool open_ = false;
};

inline constexpr int kPatienceMs = 20'000;

struct Reply {
  int status = 0;
  Headers headers;
  std::string body;
  bool is_complete = false;  // the body ended as its framing says
  std::string header(std::string_view name) const { return std::string(headers.get(name).value_or("(absent)")); }
};

class RawClient {
 public:
  explicit RawClient(std::uint16_t port, int receive_buffer_bytes = 0) {
    fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (receive_buffer_bytes > 0)
      setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("connect");
  }
  ~RawClient() { close(); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  void end_sending() { ::shutdown(fd_, SHUT_WR); }
  /// Goes without a goodbye: the server sees a reset.
  void reset() {
    const linger at_once{1, 0};
    setsockopt(fd_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    close();
  }

  /// False: the server does not take it any more.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t count = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (count <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(count));
    }
    return true;
  }

  bool is_readable(int timeout_ms) {
    pollfd item{fd_, POLLIN, 0};
    return ::poll(&item, 1, timeout_ms) > 0;
  }

  /// Whether something came; false at the end of the connection or a reset.
  bool receive() {
    if (!is_readable(kPatienceMs)) throw std::runtime_error("the server keeps silent");
    char bytes[16 * 1024];
    const ssize_t count = ::recv(fd_, bytes, sizeof bytes, 0);
    if (count <= 0) return false;
    input_.append(bytes, static_cast<std::size_t>(count));
    return true;
  }

  /// Everything up to the end of the connection.
  std::string read_to_end() {
    while (receive()) {
    }
    return std::exchange(input_, {});
  }

  /// Reads until `text` has come; false if the connection ended before.
  bool read_until(std::string_view text) {
    while (input_.find(text) == std::string::npos) {
      if (!receive()) return false;
    }
    input_.erase(0, input_.find(text) + text.size());
    return true;
  }

  /// One response; status 0 if the connection ended before it.
  Reply read_reply(bool is_head = false) {
    Reply reply;
    std::size_t end = 0;
    while ((end = input_.find("\r\n\r\n")) == std::string::npos) {
      if (!receive()) return reply;
    }
    read_head(input_.substr(0, end + 2), reply);
    input_.erase(0, end + 4);
    if (is_head || reply.status == 204 || reply.status == 304 || reply.status == 100) {
      reply.is_complete = true;
    } else if (const auto length = reply.headers.get("Content-Length")) {
      const std::size_t size = std::stoul(std::string(*length));
      while (input_.size() < size && receive()) {
      }
      reply.is_complete = input_.size() >= size;
      take(reply, size);
    } else if (reply.headers.get("Transfer-Encoding")) {
      while (read_chunk(reply)) {
      }
    } else {
      reply.body = read_to_end();
      reply.is_complete = true;
    }
    return reply;
  }

  /// The next that is none of those which only say that it will come.
  Reply read_last_reply() {
    Reply reply = read_reply();
    while (reply.status == 100) reply = read_reply();
    return reply;
  }

  Reply ask(std::string_view bytes) {
    send(bytes);
    return read_reply();
  }

 private:
  static void read_head(const std::string& head, Reply& reply) {
    reply.status = std::stoi(head.substr(9, 3));
    for (std::size_t at = head.find("\r\n") + 2; at < head.size();) {
      const std::size_t line_end = head.find("\r\n", at);
      const std::string line = head.substr(at, line_end - at);
      reply.headers.add(line.substr(0, line.find(": ")), line.substr(line.find(": ") + 2));
      at = line_end + 2;
    }
  }

  void take(Reply& reply, std::size_t size) {
    reply.body += input_.substr(0, size);
    input_.erase(0, std::min(size, input_.size()));
  }

  bool read_chunk(Reply& reply) {
    std::size_t end = 0;
    while ((end = input_.find("\r\n")) == std::string::npos) {
      if (!receive()) return false;
    }
    const std::size_t size = std::stoul(input_.substr(0, end), nullptr, 16);
    while (input_.size() < end + 2 + size + 2) {
      if (!receive()) return false;
    }
    input_.erase(0, end + 2);
    take(reply, size);
    input_.erase(0, 2);
    reply.is_complete = size == 0;
    return size != 0;
  }

  int fd_ = -1;
  std::string input_;
};

inline const std::string kHost = "Host: localhost\r\n";
inline const std::string kGet = "GET /hello HTTP/1.1\r\nHost: localhost\r\n\r\n";

inline std::string post(const std::string& fields, const std::string& body = "") {
  return "POST /echo HTTP/1.1\r\n" + kHost + fields + "\r\n" + body;
}
inline std::string get(const std::string& target, const std::string& fields = kHost) {
  return "GET " + target + " HTTP/1.1\r\n" + fields + "\r\n";
}

inline Response text(std::string body) {
  Response response;
  response.headers.set("Content-Type", "text/plain");
  response.body = std::move(body);
  return response;
}

inline Response streamed(std::unique_ptr<BodySource> source) {
  Response response;
  response.headers.set("Content-Type", "text/plain");
  response.stream = std::move(source);
  return response;
}

/// A server on a free port; routes are added in `shape`, then it runs.
class TestServer {
 public:
  explicit TestServer(const std::function<void(Router&)>& shape = {}, ServerConfig config = {}) {
    router_.add("GET", "/hello", [](const Request&) { return text("hello"); });
    router_.add("POST", "/echo", [](const Request& request) { return text(request.body); });
    if (shape) shape(router_);
    config.port = 0;
    auto server = Server::create(std::move(config), router_, tokens, [this](const AccessRecord& record) {
      if (on_access) on_access(record);
    });
    if (!server) throw std::runtime_error(server.error().message);
    server_ = std::move(*server);
  }

  TokenTable tokens;
  /// Before run().
  std::function<void(const AccessRecord&)> on_access;

  TestServer& run() {
    server_->run();
    return *this;
  }
  std::uint16_t port() const { return server_->port(); }
  void stop(std::int64_t grace_ms) { server_->stop(grace_ms); }

 private:
  Router router_;
  std::unique_ptr<Server> server_;
};

}  // namespace colony::server::http
