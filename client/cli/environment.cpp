#include "client/cli/environment.hpp"

#include <algorithm>
#include <cctype>
#include <fcntl.h>
#include <poll.h>
#include <random>
#include <system_error>
#include <unistd.h>

namespace colony::client {

Interrupt::Interrupt() {
  if (::pipe2(pipe_, O_CLOEXEC | O_NONBLOCK) != 0) {
    throw std::system_error(errno, std::generic_category(), "pipe");
  }
}

Interrupt::~Interrupt() {
  ::close(pipe_[0]);
  ::close(pipe_[1]);
}

void Interrupt::raise() noexcept {
  // A full pipe (errno EAGAIN) is as readable as one byte: nothing to handle. errno belongs to the interrupted code.
  const int saved = errno;
  const char byte = 0;
  [[maybe_unused]] const ssize_t written = ::write(pipe_[1], &byte, 1);
  errno = saved;
}

bool Interrupt::raised() const noexcept {
  pollfd entry{pipe_[0], POLLIN, 0};
  return ::poll(&entry, 1, 0) == 1;
}

void Interrupt::wait(std::chrono::milliseconds duration) const {
  const auto end = std::chrono::steady_clock::now() + duration;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return;
    pollfd entry{pipe_[0], POLLIN, 0};
    if (::poll(&entry, 1, static_cast<int>(std::min<std::int64_t>(left.count(), 60'000))) == 1) return;
  }
}

std::chrono::milliseconds retry_delay(const RetryPolicy& policy, int index) {
  const std::int64_t doubled = policy.first.count() << std::min(index, 20);
  const std::int64_t full = std::min<std::int64_t>(doubled, policy.max.count());
  std::random_device device;
  return std::chrono::milliseconds(full - static_cast<std::int64_t>(device() % static_cast<unsigned>(full / 4 + 1)));
}

bool locale_is_utf8(const Environment& env) {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    auto value = env.variable(name);
    if (!value || value->empty()) continue;
    std::transform(value->begin(), value->end(), value->begin(), [](unsigned char c) { return std::tolower(c); });
    return value->find("utf-8") != std::string::npos || value->find("utf8") != std::string::npos;
  }
  return false;
}

}  // namespace colony::client
