// colonyd: wires store, jobs, api and http together, and ends them in the opposite order.
// Exit: 0 after SIGTERM or SIGINT; 1 if it cannot start (data locked, port taken); 2 if the configuration is wrong.
#include <fcntl.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>
#include <thread>

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include "server/api/api.hpp"
#include "server/api/codec_fork.hpp"
#include "server/api/handlers_tokens.hpp"
#include "server/config.hpp"
#include "server/http/server.hpp"
#include "server/http/tls.hpp"
#include "server/log.hpp"
#include "server/log_sink.hpp"
#include "server/store/identity.hpp"
#include "server/token_command.hpp"

extern char** environ;

namespace colony::server {
namespace {

constexpr int kWrongConfiguration = 2;  // to exit with
constexpr std::size_t kLogLinesMax = 8192;
constexpr std::chrono::seconds kLogEnd{2};
constexpr std::int64_t kGrace_ms = 5'000;  // for answers under way; with the runners' end well within the 10 s promised

Environment environment() {
  Environment out;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    if (const std::size_t equals = text.find('='); equals != std::string::npos) {
      out.emplace_back(text.substr(0, equals), text.substr(equals + 1));
    }
  }
  return out;
}

// Those this process may run on, which can be fewer than the machine has.
std::uint64_t usable_cores() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return static_cast<std::uint64_t>(CPU_COUNT(&set));
  return std::max(1U, std::thread::hardware_concurrency());
}

std::string text_of(const Error& error, const char* separator) {
  std::string text = error.message;
  for (const FieldError& field : error.fields) text += separator + field.pointer + ": " + field.message;
  return text;
}

// A file opened while one of them is closed would get its number, and then what is said to it.
void open_standard_descriptors() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) >= 0) continue;
    const int null = open("/dev/null", O_RDWR);  // the lowest number that is free: this one
    if (null >= 0 && null != descriptor) close(null);
  }
}

// Blocked in every thread (those made later inherit it) and fetched by wait_for_signal: no code of ours runs in a
// signal handler, and a second signal while the server ends simply stays pending.
sigset_t block_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  return set;
}

// A connection is a descriptor, and the usual soft limit of 1,024 is less than limits of ours allow.
void allow_descriptors() {
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0) return;
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
}

int wait_for_signal(const sigset_t& set) {
  int signal = 0;
  while (sigwait(&set, &signal) != 0) {
  }
  return signal;
}

// The library only carries finished lines to standard error: in JSON they stand alone, as text behind time and level.
class Log {
 public:
  explicit Log(LogFormat format) : format_(format) {
    if (format_ == LogFormat::kJson) spdlog::set_pattern("%v");
  }
  void info(const std::string& text) const { write(log_event(format_, wall_time_text(), "info", text)); }
  void warn(const std::string& text) const { write(log_event(format_, wall_time_text(), "warning", text)); }
  int fail(const std::string& what, const Error& error) const {
    write(log_event(format_, wall_time_text(), "error", what + ": " + text_of(error, "; ")));
    return 1;
  }
  void access(const http::AccessRecord& record) const { write(log_access(format_, wall_time_text(), record)); }
  void failure(const http::Request& request, std::string_view what) const {
    write(log_failure(format_, wall_time_text(), request, what));
  }

 private:
  static void write(const LogLine& line) {
    const auto level = line.level == "error"     ? spdlog::level::err
                       : line.level == "warning" ? spdlog::level::warn
                                                 : spdlog::level::info;
    spdlog::log(level, "{}", line.text);
  }
  const LogFormat format_;
};

void warn_of_settings(const Log& log, const Config& config, const http::TokenTable& tokens) {
  const std::uint64_t threads = config.jobs.concurrent_max * static_cast<std::uint64_t>(config.jobs.threads_per_job);
  log.info(std::to_string(config.jobs.concurrent_max) + " jobs at a time, " +
           std::to_string(config.jobs.threads_per_job) + " threads a job");
  if (threads > usable_cores()) {
    log.warn(std::to_string(threads) + " threads are to share " + std::to_string(usable_cores()) + " cores");
  }
  if (!config.http.tls_key.empty()) {
    if (const auto exposed = http::exposure_of_key(config.http.tls_key)) log.warn(*exposed);
  }
  if (config.http.tokens_required && tokens.count_alive(http::Scope::kAdmin, http::unix_time_ms()) == 0) {
    log.warn("no valid token has scope admin: stop the server and make one with `colonyd token create`");
  }
}

int serve(const Config& config, const sigset_t& signals) {
  const Log log(config.log_format);
  allow_descriptors();
  auto store = Store::open(config.store);
  if (!store) return log.fail("cannot open the data folder " + config.store.data_dir, store.error());
  http::TokenTable tokens;
  if (const Status loaded = api::load_tokens((*store)->tokens(), tokens); !loaded) {
    return log.fail("cannot read the tokens", loaded.error());
  }
  JobsConfig jobs_config = config.jobs;
  jobs_config.log = [&log](const std::string& line) { log.info(line); };
  const auto jobs = JobService::create(**store, jobs_config, api::decode_stored_spec, api::verify_codec());

  api::ApiConfig api_config;
  api_config.version = COLONY_VERSION;
  api_config.tokens_required = config.http.tokens_required;
  api_config.is_encrypted = !config.http.tls_certificate.empty();
  api_config.is_behind_proxy = config.http.behind_proxy;
  api_config.jobs = jobs_config;
  api_config.body_bytes_max = config.http.body_bytes_max;
  api_config.header_bytes_max = config.http.header_bytes_max;
  api_config.connections_max = config.http.connections_max;
  api_config.base_path = config.http.base_path;
  api_config.disk_free_bytes_min = config.disk_free_bytes_min;
  api_config.image_bytes_max = config.http.large_body_bytes_max;
  api_config.stored_image_bytes_max = config.stored_image_bytes_max;
  api_config.analyses_waiting_max = config.analyses_waiting_max;
  api::Api api(*jobs, tokens, api_config);
  http::Router router;
  api.add_routes(router);
  router.on_failure([&log](const http::Request& request, std::string_view what) { log.failure(request, what); });

  http::ServerConfig http_config = config.http;
  http_config.large_body_path = "/v1/analyses";
  auto server = http::Server::create(http_config, router, tokens,
                                     [&log](const http::AccessRecord& record) { log.access(record); });
  if (!server) {
    const int status = log.fail("cannot serve", server.error());
    return server.error().code == ErrorCode::kInvalid ? kWrongConfiguration : status;
  }
  // Only now: a process that cannot serve must not take up jobs.
  if (const Status started = jobs->start(); !started) return log.fail("cannot take up the jobs", started.error());
  if (const Status started = api.start(); !started) return log.fail("cannot take up the analyses", started.error());
  (*server)->run();
  const bool is_v6 = config.http.address.find(':') != std::string::npos;
  const std::string host = is_v6 ? "[" + config.http.address + "]" : config.http.address;
  std::printf("listening on %s://%s:%u%s\n", config.http.tls_certificate.empty() ? "http" : "https", host.c_str(), static_cast<unsigned>((*server)->port()),
              config.http.base_path.c_str());
  std::fflush(stdout);
  log.info("data in " + config.store.data_dir);
  warn_of_settings(log, config, tokens);

  const int signal = wait_for_signal(signals);
  log.info("ending on signal " + std::to_string(signal));
  api.drain();
  jobs->drain();  // first: a request that folds a long history ends with it, and stop() joins the handlers
  (*server)->stop(kGrace_ms);
  log.info("ended");
  return 0;
}

void set_logger(std::shared_ptr<spdlog::logger> logger) {
  spdlog::set_default_logger(std::move(logger));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %v", spdlog::pattern_time_type::utc);
}

int run(int argc, char** argv) {
  open_standard_descriptors();
  set_logger(spdlog::stderr_logger_mt("colonyd"));
  const auto invocation = configure(std::vector<std::string>(argv + 1, argv + argc), environment(), COLONY_VERSION,
                                    usable_cores());
  if (!invocation) {
    spdlog::error("{}", text_of(invocation.error(), "\n  "));
    return kWrongConfiguration;
  }
  if (!invocation->print.empty()) {
    std::fputs(invocation->print.c_str(), stdout);
    return 0;
  }
  if (invocation->token) return run_token_create(invocation->config, *invocation->token);
  const sigset_t signals = block_signals();  // before any thread
  const auto tell_lost = [format = invocation->config.log_format](std::size_t lines) {
    const std::string told = std::to_string(lines) + " lines of the log are lost since the start: nobody took them";
    return log_event(format, wall_time_text(), "warning", told).text;
  };
  const auto lines = std::make_shared<LogSink>(STDERR_FILENO, kLogLinesMax, tell_lost);
  set_logger(std::make_shared<spdlog::logger>("colonyd serving", lines));
  const int status = serve(invocation->config, signals);
  if (!lines->end(kLogEnd)) std::_Exit(status);  // nobody takes them
  return status;
}

}  // namespace
}  // namespace colony::server

int main(int argc, char** argv) {
  try {
    return colony::server::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "colonyd: %s\n", error.what());
    return 1;
  }
}
