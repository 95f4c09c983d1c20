#include "tests/bench/load_watch.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <ctime>
#include <memory>
#include <string_view>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>

namespace colony::bench {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kReadBytes = 64 * 1024;
constexpr std::size_t kConnectingMax = 64;  // at a time: the backlog of a listener is finite

struct Seen {
  std::size_t hash = 0, count = 0;
  Clock::time_point first, last;
};

/// What all watchers share.
struct Ledger {
  std::vector<Seen> events;  // by seq - 1
  WatchReport report;
  std::vector<std::uint64_t> ends;  // the last seq of each that has ended
  std::size_t open = 0;
  std::array<char, kReadBytes> bytes;  // one thread reads: one buffer
};

class Watcher {
 public:
  Watcher(asio::io_context& io, Ledger& ledger) : socket_(io), ledger_(ledger) {}

  void start(std::uint16_t port, const std::string& request, const std::function<void()>& on_open) {
    on_open_ = on_open;
    socket_.async_connect(tcp::endpoint(asio::ip::address_v4::loopback(), port), [this, &request](error_code error) {
      if (error) return end();
      asio::async_write(socket_, asio::buffer(request), [this](error_code failed, std::size_t) {
        if (failed)
          end();
        else
          wait();
      });
    });
  }

 private:
  // The buffer is shared, so it is read only when there is something.
  void wait() {
    socket_.async_wait(tcp::socket::wait_read, [this](error_code error) {
      if (error) return end();
      error_code failed;
      const std::size_t count = socket_.read_some(asio::buffer(ledger_.bytes), failed);
      if (failed) return end();
      ledger_.report.bytes += count;
      feed(std::string_view(ledger_.bytes.data(), count));
      if (has_finished_) return end();
      wait();
    });
  }

  void feed(std::string_view input) {
    if (!in_body_) {
      head_ += input;
      const std::size_t end = head_.find("\r\n\r\n");
      if (end == std::string::npos) return;
      is_stream_ = head_.starts_with("HTTP/1.1 200 ") && head_.find("text/event-stream") != std::string::npos;
      in_body_ = true;
      const std::string rest = head_.substr(end + 4);
      std::string().swap(head_);
      chunks(rest);
    } else {
      chunks(input);
    }
  }

  void chunks(std::string_view input) {
    while (!input.empty() && !has_finished_) {
      if (left_ > 0) {
        const std::size_t count = std::min<std::size_t>(left_, input.size());
        left_ -= count;
        text(input.substr(0, count));
        input.remove_prefix(count);
        continue;
      }
      // A size line, with the line end of the chunk before it.
      const char c = input.front();
      input.remove_prefix(1);
      if (c != '\n') {
        if (c != '\r') size_line_ += c;
        continue;
      }
      if (size_line_.empty()) continue;
      std::from_chars(size_line_.data(), size_line_.data() + size_line_.size(), left_, 16);
      size_line_.clear();
      if (left_ == 0) has_finished_ = true;
    }
  }

  void text(std::string_view piece) {
    if (!kept_.empty()) {
      kept_ += piece;
      piece = kept_;
    }
    std::size_t end = 0;
    while ((end = piece.find("\n\n")) != std::string_view::npos) {
      message(piece.substr(0, end));
      piece.remove_prefix(end + 2);
    }
    std::string rest(piece);
    kept_.swap(rest);
  }

  void message(std::string_view text) {
    ++ledger_.report.messages;
    if (!is_open_) {
      is_open_ = true;
      on_open_();
    }
    if (text.starts_with("event: end\n")) has_end_ = true;
    if (text.starts_with("event: lagged\n")) is_lagged_ = true;
    const std::size_t at = text.find("\nid: ");
    if (at == std::string_view::npos) return;
    std::uint64_t seq = 0;
    std::from_chars(text.data() + at + 5, text.data() + text.size(), seq);
    if (seq != last_seq_ + 1) has_gap_ = true;
    last_seq_ = seq;
    if (seq == 0) return;
    if (ledger_.events.size() < seq) ledger_.events.resize(seq);
    Seen& seen = ledger_.events[seq - 1];
    const std::size_t hash = std::hash<std::string_view>()(text);
    seen.last = Clock::now();
    if (seen.count++ == 0) {
      seen.hash = hash;
      seen.first = seen.last;
    }
    if (seen.hash != hash) has_other_bytes_ = true;
  }

  void end() {
    error_code ignored;
    socket_.close(ignored);
    WatchReport& report = ledger_.report;
    report.refused += !is_stream_;
    report.cut += is_stream_ && !(has_end_ && has_finished_);
    report.with_gap += has_gap_;
    report.with_other_bytes += has_other_bytes_;
    report.lagged += is_lagged_;
    ledger_.ends.push_back(last_seq_);
    if (!is_open_) {
      is_open_ = true;
      on_open_();
    }
  }

  tcp::socket socket_;
  Ledger& ledger_;
  std::function<void()> on_open_;
  std::string head_, size_line_, kept_;
  std::size_t left_ = 0;  // of the chunk under way
  std::uint64_t last_seq_ = 0;
  bool in_body_ = false, is_stream_ = false, is_open_ = false, has_finished_ = false, has_end_ = false;
  bool has_gap_ = false, has_other_bytes_ = false, is_lagged_ = false;
};

double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

WatchReport watch(std::uint16_t port, const std::string& path, std::size_t count,
                  const std::function<void()>& when_open) {
  asio::io_context io(1);
  Ledger ledger;
  ledger.report.watchers = count;
  const std::string request = "GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\nAccept: text/event-stream\r\n\r\n";
  std::vector<std::unique_ptr<Watcher>> watchers;
  std::thread opened;
  const double cpu_before_s = thread_cpu_s();
  std::size_t started = 0;
  Clock::time_point all_open;
  std::function<void()> on_open = [&] {
    ++ledger.open;
    if (started < count) watchers[started++]->start(port, request, on_open);
    if (ledger.open < count) return;
    all_open = Clock::now();
    opened = std::thread(when_open);
  };
  for (std::size_t i = 0; i < count; ++i) watchers.push_back(std::make_unique<Watcher>(io, ledger));
  while (started < std::min(count, kConnectingMax)) watchers[started++]->start(port, request, on_open);
  io.run();
  if (opened.joinable()) opened.join();
  WatchReport& report = ledger.report;
  report.last_seq = ledger.events.size();
  for (const std::uint64_t last : ledger.ends) report.with_gap += last != report.last_seq;
  for (const Seen& seen : ledger.events) {
    if (seen.count == count && seen.first > all_open) {
      report.spread_ms.push_back(std::chrono::duration<double, std::milli>(seen.last - seen.first).count());
    }
  }
  report.cpu_s = thread_cpu_s() - cpu_before_s;
  return report;
}

}  // namespace colony::bench
