#include "tests/bench/colonyd_process.hpp"

#include <arpa/inet.h>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <netinet/in.h>
#include <signal.h>
#include <sstream>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace colony::bench {
namespace {

constexpr std::size_t kReadBytes = 256 * 1024;

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(what + ": " + std::strerror(errno)); }

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> out;
  for (std::string& text : texts) out.push_back(text.data());
  out.push_back(nullptr);
  return out;
}

// Nothing of the surroundings may configure the server.
std::vector<std::string> clean_environment() {
  std::vector<std::string> out;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    if (!std::string_view(*entry).starts_with("COLONY_")) out.emplace_back(*entry);
  }
  return out;
}

void send_all(int socket, std::string_view text) {
  while (!text.empty()) {
    const ssize_t sent = send(socket, text.data(), text.size(), MSG_NOSIGNAL);
    if (sent < 0) fail("send");
    text.remove_prefix(static_cast<std::size_t>(sent));
  }
}

}  // namespace

ColonydProcess::ColonydProcess(const std::string& program, std::vector<std::string> arguments, const std::string& data)
    : data_(data.empty() ? own_.path() : data) {
  arguments.insert(arguments.begin(), {program, "--listen", "127.0.0.1:0", "--data", data_});
  std::vector<std::string> environment = clean_environment();
  const std::vector<char*> argv = pointers(arguments), envp = pointers(environment);
  const std::string log = data_ + "/stderr.txt";
  int out[2];
  if (pipe2(out, O_CLOEXEC) != 0) fail("pipe");
  pid_ = fork();
  if (pid_ < 0) fail("fork");
  if (pid_ == 0) {
    const int err = open(log.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    dup2(out[1], STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    execve(argv[0], argv.data(), envp.data());
    _exit(127);
  }
  close(out[1]);
  out_ = out[0];
  std::string line;
  for (char c = 0; read(out_, &c, 1) == 1 && c != '\n';) line += c;
  const std::size_t colon = line.rfind(':');
  if (!line.starts_with("listening on http://127.0.0.1:"))
    throw std::runtime_error(program + " does not listen: " + line);
  port_ = static_cast<std::uint16_t>(std::stoul(line.substr(colon + 1)));
}

ColonydProcess::~ColonydProcess() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  if (out_ >= 0) close(out_);
}

int ColonydProcess::connect() const {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket < 0) fail("socket");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port_);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) fail("connect");
  return socket;
}

std::string ColonydProcess::request(const std::string& method, const std::string& path, const std::string& body) const {
  const int socket = connect();
  send_all(socket,
           method + " " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nAccept: application/json\r\n" +
               "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  std::string answer;
  std::vector<char> buffer(kReadBytes);
  for (ssize_t got = 0; (got = recv(socket, buffer.data(), buffer.size(), 0)) > 0;) {
    answer.append(buffer.data(), static_cast<std::size_t>(got));
  }
  close(socket);
  const std::size_t head = answer.find("\r\n\r\n");
  if (head == std::string::npos) throw std::runtime_error(method + " " + path + ": no answer");
  return answer.substr(head + 4);
}

void ColonydProcess::follow(const std::string& path, const std::function<void(std::string_view)>& take) const {
  const int socket = connect();
  // 1.0: the body comes without chunks, and ends with the connection.
  send_all(socket, "GET " + path + " HTTP/1.0\r\nHost: 127.0.0.1\r\nAccept: text/event-stream\r\n\r\n");
  std::vector<char> buffer(kReadBytes);
  std::string head;
  bool in_body = false;
  for (ssize_t got = 0; (got = recv(socket, buffer.data(), buffer.size(), 0)) > 0;) {
    const std::string_view piece(buffer.data(), static_cast<std::size_t>(got));
    if (in_body) {
      take(piece);
      continue;
    }
    head += piece;
    if (const std::size_t end = head.find("\r\n\r\n"); end != std::string::npos) {
      if (head.find(" 200 ") == std::string::npos) throw std::runtime_error("the stream is refused: " + head);
      in_body = true;
      take(std::string_view(head).substr(end + 4));
    }
  }
  close(socket);
}

std::map<std::string, double> ColonydProcess::thread_cpu_s() const {
  std::map<std::string, double> out;
  const auto ticks_per_s = static_cast<double>(sysconf(_SC_CLK_TCK));
  for (const auto& entry : std::filesystem::directory_iterator("/proc/" + std::to_string(pid_) + "/task")) {
    std::ifstream file(entry.path() / "stat");
    const std::string text(std::istreambuf_iterator<char>(file), {});
    const std::size_t open = text.find('('), end = text.rfind(')');
    if (open == std::string::npos || end == std::string::npos) continue;
    std::istringstream fields(text.substr(end + 1));
    std::string skipped;
    for (int i = 0; i < 11; ++i) fields >> skipped;  // up to cmajflt
    double user = 0.0, system = 0.0;
    fields >> user >> system;
    out[text.substr(open + 1, end - open - 1)] += (user + system) / ticks_per_s;
  }
  return out;
}

std::uint64_t ColonydProcess::database_bytes() const { return std::filesystem::file_size(data_ + "/colony.db"); }

std::uint64_t ColonydProcess::resident_bytes() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/statm");
  std::uint64_t pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::uint64_t ColonydProcess::peak_memory_bytes() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/status");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("VmHWM:")) return 1024 * std::stoull(line.substr(6));
  }
  throw std::runtime_error("the process has no peak of memory");
}

double ColonydProcess::finish() {
  kill(pid_, SIGTERM);
  int status = 0;
  rusage usage{};
  if (wait4(pid_, &status, 0, &usage) != pid_) fail("wait4");
  pid_ = -1;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw std::runtime_error("colonyd did not end well");
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace colony::bench
