// buckets: token buckets by key: how often something may be done.
// Promises that each key gets `burst` at once and `per_s` in the long run, that nothing is refused which the rate allows, and
//          that memory is bounded: with keys_max keys in use, all others share one bucket (so that inventing addresses
//          earns nobody a fresh one, and known keys keep theirs).
// Threads: every function from any thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>

namespace colony::server::http {

struct Rate {
  double per_s = 0.0;  // 0: no limit
  double burst = 0.0;  // at least 1 if there is a limit
};

class Buckets {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Buckets(Rate rate, std::size_t keys_max = 10'000) : rate_(rate), keys_max_(keys_max) {}

  /// Takes one. 0 if it was there; else nothing is taken, and the answer is after how many seconds (at least 1) it will be.
  std::int64_t take(const std::string& key, Clock::time_point now);
  std::size_t key_count() const;

 private:
  struct Bucket {
    double level = 0.0;
    Clock::time_point at;
  };
  void refill(Bucket& bucket, Clock::time_point now) const;
  Bucket& bucket_of(const std::string& key, Clock::time_point now);

  const Rate rate_;             // fixed after construction
  const std::size_t keys_max_;
  mutable std::mutex mutex_;    // guards everything below
  std::unordered_map<std::string, Bucket> buckets_;
  Bucket shared_{-1.0, {}};     // of those who came when all were in use; below 0: not yet used
  Clock::time_point swept_at_{};
};

}  // namespace colony::server::http
