// main: gives run() the real process: its streams, its terminal, its Ctrl-C.
#include <csignal>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <sys/ioctl.h>
#include <unistd.h>

#include <curl/curl.h>

#include "client/cli/app.hpp"
#include "client/cli/failure.hpp"

namespace {

colony::client::Interrupt* interrupt_of_process = nullptr;

void on_signal(int) {
  // A second Ctrl-C ends the process the hard way, should the first not be heeded.
  std::signal(SIGINT, SIG_DFL);
  interrupt_of_process->raise();
}

int terminal_width() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

std::optional<std::string> variable(const std::string& name) {
  const char* value = std::getenv(name.c_str());
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace colony::client;
  curl_global_init(CURL_GLOBAL_DEFAULT);
  Interrupt interrupt;
  interrupt_of_process = &interrupt;
  std::signal(SIGINT, on_signal);
  std::signal(SIGPIPE, SIG_IGN);  // a write error tells the same, without ending a TLS connection's process
  std::ios::sync_with_stdio(false);
  Environment env{std::cin, std::cout, std::cerr, interrupt, variable, terminal_width, ::isatty(STDOUT_FILENO) == 1};
  try {
    return run({argv + 1, argv + argc}, env);
  } catch (const OutputClosed&) {
    std::signal(SIGPIPE, SIG_DFL);
    return std::raise(SIGPIPE);  // ends as any filter whose reader has gone
  } catch (const std::exception& failure) {
    std::cerr << "error: " << failure.what() << '\n';
    return static_cast<int>(ExitCode::kUsage);
  }
}
