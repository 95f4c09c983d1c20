// load_watch: many watchers of one event stream, each held to every event.
// Method:  one thread, Asio; chunks are decoded and messages cut by a few lines here, as a parser for each of a thousand readers
//          would be most of what is measured. An event is the same for all: the bytes of the first to see it are kept as a hash.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace colony::bench {

struct WatchReport {
  std::size_t watchers = 0;
  std::size_t refused = 0;   // without an event stream
  std::size_t cut = 0;       // that ended without `event: end`
  std::size_t with_gap = 0;  // that did not get 1, 2, 3, ... last_seq
  std::size_t with_other_bytes = 0;
  std::size_t lagged = 0;      // that were told `event: lagged`
  std::uint64_t last_seq = 0;  // the greatest seen
  std::uint64_t messages = 0, bytes = 0;
  std::vector<double> spread_ms;  // of every event seen by all while it was live: from the first watcher to the last
  double cpu_s = 0.0;             // of the client
  bool is_right() const { return refused + cut + with_gap + with_other_bytes + lagged == 0 && last_seq > 0; }
};

/// Opens `count` streams of `path`; calls `when_open` (on a thread of its own) once all have their first message, and returns when
/// all streams have ended.
WatchReport watch(std::uint16_t port, const std::string& path, std::size_t count,
                  const std::function<void()>& when_open);

}  // namespace colony::bench
