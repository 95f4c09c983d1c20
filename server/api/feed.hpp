// feed: what the watchers of one job share: its latest events, each encoded once, and what is to be said of its state.
// Promise: a watcher whose position lies in the feed is told of every event of the filter exactly once and in order; one whose position
//          lies before it is told so, and reads the store until it meets the feed. Nobody waits for a watcher: the feed goes on, and
//          drops its oldest pieces when it is full.
// Why positions: a position says "everything of the filter up to this seq was sent". It also moves over events that the filter does not
//          want, so a feed of one kind meets its watchers as any other does.
// Limits:  kFeedBytesMax of text a feed. Feeds live as long as they are watched.
// Threads: Feeds has one thread of its own, which alone reads the store and encodes. after() from any thread, without waiting for either.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "server/jobs/service.hpp"

namespace colony::server::api {

inline constexpr std::size_t kPieceBytes = 64 * 1024;
inline constexpr std::size_t kEventsPerRead = 256;
inline constexpr std::size_t kFeedBytesMax = 2 * 1024 * 1024;
/// A feed with many watchers is read less often, so that waking them takes no more than about half of a core.
inline constexpr std::chrono::microseconds kPausePerWatcher{50};
inline constexpr std::chrono::milliseconds kPauseMax{250};

/// One event of a history as a server-sent message.
void append_event_message(std::string& out, const Event& event);
/// The data of a message about progress.
std::string progress_text(const JobView& view);

/// What a stream says of its job besides events.
struct WatchedJob {
  JobState state = JobState::kQueued;
  std::string reason;
  std::uint64_t last_seq = 0;
  std::string progress;  // progress_text
};

class Feeds;

class Feed {
 public:
  /// Which events of which job. Progress alone is a feed without events.
  struct Wish {
    std::string id;
    std::int64_t job_key = 0;
    bool events = true;
    EventFilter filter;  // `after` does not count
  };
  /// What there is after a position.
  struct News {
    enum class Kind {
      kBehind,  // the position lies before the feed
      kMore,    // events, and more after them
      kAll,   // events, or none; `job` is of this moment, and there is no other event of the filter up to its last_seq
      kGone,  // the job was deleted, or the store failed
    };
    Kind kind = Kind::kBehind;
    std::shared_ptr<const std::string> piece;  // null: what there is was appended to the text, or is nothing
    std::uint64_t position = 0;                // once it is sent
    std::uint64_t through = 0;                 // how far the feed is
    std::shared_ptr<const WatchedJob> job;     // null if behind or gone
  };

  Feed(Feeds& feeds, Wish wish);
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;
  ~Feed();

  /// Calls `wake` whenever there is news (any thread; it must not block nor come back here), until the subscription is destroyed.
  class Subscription;
  std::unique_ptr<Subscription> subscribe(std::function<void()> wake);
  /// Appends to `out` what is to be copied: the rest of a piece, or several small ones.
  News after(std::uint64_t position, std::string& out) const;

 private:
  friend class Feeds;
  // Every event of the filter with from < seq <= through.
  struct Piece {
    std::uint64_t from = 0, through = 0;
    std::shared_ptr<const std::string> text;
    std::vector<std::pair<std::uint64_t, std::size_t>> marks;  // seq of each event, and where its message begins
  };

  /// On the thread of Feeds: what is new is read, encoded, and announced.
  void refresh(JobService& jobs);
  /// False: the store failed.
  bool read_events(JobService& jobs, std::uint64_t last_seq, std::vector<Piece>& pieces);
  std::chrono::microseconds pause() const;
  void wake_all() const;

  Feeds& feeds_;  // fixed after construction
  const Wish wish_;
  std::unique_ptr<JobService::Subscription> hub_;  // set and let go by Feeds

  // Of the thread of Feeds alone.
  bool has_begun_ = false;
  std::uint64_t read_through_ = 0;

  mutable std::mutex mutex_;           // guards everything down to job_
  std::deque<Piece> pieces_;           // each begins where the one before it ends
  std::size_t bytes_ = 0;              // of their texts
  std::optional<std::uint64_t> from_;  // the least position to go on from; nullopt: nothing was read yet
  std::uint64_t through_ = 0;
  bool is_gone_ = false;
  std::shared_ptr<const WatchedJob> job_;

  mutable std::mutex watchers_mutex_;  // guards everything below; held while wake functions run
  std::set<Subscription*> watchers_;
};

class Feed::Subscription {
 public:
  Subscription(Feed& feed, std::function<void()> wake);
  ~Subscription();
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;
  void wake() const { wake_(); }

 private:
  Feed& feed_;
  const std::function<void()> wake_;
};

class Feeds {
 public:
  enum class Mode { kOwnThread, kByHand };  // by hand: for tests, which call refresh_stale()
  explicit Feeds(JobService& jobs, Mode mode = Mode::kOwnThread) : jobs_(jobs), mode_(mode) {}
  /// All feeds must be gone.
  ~Feeds();

  /// The one that is there, or a new one.
  std::shared_ptr<Feed> find(const Feed::Wish& wish);
  /// Reads every feed of which there is news, now.
  void refresh_stale();

 private:
  friend class Feed;
  using Clock = std::chrono::steady_clock;
  using Key = std::tuple<std::int64_t, bool, std::vector<EventKind>, std::optional<std::uint32_t>>;
  struct Known {
    std::weak_ptr<Feed> feed;
    bool is_stale = false;
    Clock::time_point not_before{};
  };
  static Key key_of(const Feed::Wish& wish);
  void mark_stale(const Key& key);
  void forget(const Feed& feed);
  void loop();

  JobService& jobs_;
  const Mode mode_;
  std::mutex mutex_;  // guards everything below
  std::condition_variable changed_;
  std::map<Key, Known> known_;
  bool ending_ = false;
  std::thread thread_;  // started with the first feed
};

}  // namespace colony::server::api
