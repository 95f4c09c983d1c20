// cli_fake_server: an HTTP server of a few lines on 127.0.0.1, port 0, that answers as a test says, one connection at a
// time. It exists to send what a real server would not: cut streams, busy answers, garbage. Threads: the handler runs
// on the server's thread; `requests()` is for after the client has its answer.
#pragma once

#include <arpa/inet.h>
#include <functional>
#include <mutex>
#include <netinet/in.h>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

namespace colony::test {

struct FakeRequest {
  std::string head;  // request line and headers, CRLF
  std::string body;
  std::string line() const { return head.substr(0, head.find("\r\n")); }
  /// The value of a header as sent, "" if absent. `name` as the client writes it.
  std::string header(const std::string& name) const {
    const std::size_t at = head.find("\r\n" + name + ": ");
    if (at == std::string::npos) return {};
    const std::size_t start = at + name.size() + 4;
    return head.substr(start, head.find("\r\n", start) - start);
  }
};

/// The open connection of one request; closed when the handler returns.
class FakeConnection {
 public:
  explicit FakeConnection(int fd) : fd_(fd) {}
  void send(const std::string& bytes) const {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t count = ::send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return;  // the client has gone: its own result is what the test looks at
      sent += static_cast<std::size_t>(count);
    }
  }
  void wait_for_close() const {
    char byte = 0;
    while (::recv(fd_, &byte, 1, 0) > 0) {
    }
  }

 private:
  int fd_;
};

inline std::string answer(int status, const std::string& type, const std::string& body,
                          const std::string& headers = {}) {
  return "HTTP/1.1 " + std::to_string(status) + " X\r\nContent-Type: " + type + "\r\n" + headers +
         "Content-Length: " + std::to_string(body.size()) + "\r\nConnection: close\r\n\r\n" + body;
}

inline std::string json_answer(int status, const std::string& body, const std::string& headers = {}) {
  return answer(status, status < 400 ? "application/json" : "application/problem+json", body, headers);
}

/// The head of an event stream that ends with the connection.
inline std::string stream_head() {
  return "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nConnection: close\r\n\r\n";
}

class FakeServer {
 public:
  using Handler = std::function<void(const FakeRequest&, const FakeConnection&)>;

  explicit FakeServer(Handler handler) : handler_(std::move(handler)) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_, 16) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      throw std::runtime_error("cannot listen on 127.0.0.1");
    }
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
  }
  ~FakeServer() {
    ::shutdown(listener_, SHUT_RDWR);  // wakes accept
    thread_.join();
    ::close(listener_);
  }

  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }
  std::vector<FakeRequest> requests() const {
    const std::lock_guard lock(mutex_);
    return requests_;
  }

 private:
  void serve() {
    for (;;) {
      const int fd = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      if (fd < 0) return;
      FakeRequest request = read(fd);
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(request);
      }
      handler_(request, FakeConnection(fd));
      ::close(fd);
    }
  }

  static FakeRequest read(int fd) {
    FakeRequest request;
    std::string bytes;
    char buffer[4096];
    std::size_t end = std::string::npos;
    std::size_t wanted = 0;
    while (end == std::string::npos || bytes.size() < wanted) {
      const ssize_t count = ::recv(fd, buffer, sizeof buffer, 0);
      if (count <= 0) break;
      bytes.append(buffer, static_cast<std::size_t>(count));
      end = bytes.find("\r\n\r\n");
      if (end == std::string::npos) continue;
      request.head = bytes.substr(0, end + 2);
      const std::string length = request.header("Content-Length");
      wanted = end + 4 + (length.empty() ? 0 : std::stoul(length));
    }
    if (end != std::string::npos) request.body = bytes.substr(end + 4);
    return request;
  }

  const Handler handler_;
  int listener_ = -1;
  int port_ = 0;
  mutable std::mutex mutex_;  // guards requests_
  std::vector<FakeRequest> requests_;
  std::thread thread_;
};

}  // namespace colony::test
