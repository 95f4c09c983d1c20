#include "server/http/buckets.hpp"

#include <algorithm>
#include <cmath>

namespace colony::server::http {
namespace {
constexpr std::chrono::seconds kBetweenSweeps{1};  // looking through all keys is not for every request
}  // namespace

void Buckets::refill(Bucket& bucket, Clock::time_point now) const {
  const double passed_s = std::max(0.0, std::chrono::duration<double>(now - bucket.at).count());
  bucket.level = std::min(rate_.burst, bucket.level + passed_s * rate_.per_s);
  bucket.at = std::max(bucket.at, now);
}

Buckets::Bucket& Buckets::bucket_of(const std::string& key, Clock::time_point now) {
  if (const auto found = buckets_.find(key); found != buckets_.end()) return found->second;
  if (buckets_.size() >= keys_max_ && now - swept_at_ >= kBetweenSweeps) {
    swept_at_ = now;
    // A full bucket says no more than none.
    for (auto it = buckets_.begin(); it != buckets_.end();) {
      refill(it->second, now);
      it = it->second.level >= rate_.burst ? buckets_.erase(it) : std::next(it);
    }
  }
  if (buckets_.size() < keys_max_) return buckets_.emplace(key, Bucket{rate_.burst, now}).first->second;
  if (shared_.level < 0.0) shared_ = {rate_.burst, now};
  return shared_;
}

std::int64_t Buckets::take(const std::string& key, Clock::time_point now) {
  if (rate_.per_s <= 0.0) return 0;
  const std::lock_guard lock(mutex_);
  Bucket& bucket = bucket_of(key, now);
  refill(bucket, now);
  if (bucket.level >= 1.0) {
    bucket.level -= 1.0;
    return 0;
  }
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil((1.0 - bucket.level) / rate_.per_s)));
}

std::size_t Buckets::key_count() const {
  const std::lock_guard lock(mutex_);
  return buckets_.size();
}

}  // namespace colony::server::http
