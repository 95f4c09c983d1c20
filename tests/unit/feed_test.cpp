// Feeds: whoever watches gets every event once and in order, wherever store and feed meet; nobody waits for a slow reader.
#include "server/api/feed.hpp"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/streams.hpp"
#include "server/jobs/live.hpp"
#include "tests/support/scale.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using Pull = http::BodySource::Pull;

/// A job of many events, of which ever more are visible; for many threads at once.
class GrowingJobs : public FakeJobs {
 public:
  explicit GrowingJobs(std::size_t count) {
    row.state = JobState::kRunning;
    row.reason.clear();
    const std::vector<Event> samples = history;
    history.clear();
    for (std::size_t i = 0; i < count; ++i) {
      history.push_back(samples[i % samples.size()]);
      history.back().seq = i + 1;
    }
    stored = 0;
  }
  /// All of the same kind and short.
  void make_short() {
    for (Event& event : history) event.body = Senesced{};
  }
  void grow(std::size_t visible, bool is_end = false) {
    {
      const std::lock_guard lock(mutex_);
      stored = visible;
      if (is_end) row.state = JobState::kSucceeded;
    }
    hub_->announce({row.job_key, JobNews::Kind::kCommit});
  }
  using FakeJobs::show;
  Result<JobView> show(const std::string& id) override {
    const std::lock_guard lock(mutex_);
    return FakeJobs::show(id);
  }
  Result<std::vector<Event>> events(const std::string& id, const EventFilter& filter, std::size_t limit) override {
    ++read_count;
    if (reads_until_failure > 0 && --reads_until_failure == 0) return Error{ErrorCode::kStorage, "the disk is sick"};
    const std::lock_guard lock(mutex_);
    if (!filter.kinds.empty() || filter.cell_id) return FakeJobs::events(id, filter, limit);
    const std::size_t end = std::min(stored, history.size());
    const std::size_t begin = std::min<std::size_t>(filter.after, end);
    return std::vector<Event>(history.begin() + static_cast<std::ptrdiff_t>(begin),
                              history.begin() + static_cast<std::ptrdiff_t>(std::min(end, begin + limit)));
  }
  std::unique_ptr<Subscription> subscribe(std::int64_t job_key, std::function<void()> wake) override {
    return hub_->follow(job_key, [wake = std::move(wake)](const JobNews&) { wake(); });
  }
  std::atomic<int> read_count{0};
  int reads_until_failure = 0;  // of one thread

 private:
  std::mutex mutex_;  // guards stored and row
  const std::shared_ptr<Hub> hub_ = std::make_shared<Hub>();
};

/// What a watcher of `wish` must have got in the end, but for what is not an event.
std::string expected_text(const GrowingJobs& jobs, const api::StreamWish& wish) {
  std::string out;
  for (const Event& event : jobs.history) {
    const auto& kinds = wish.filter.kinds;
    const bool fits = kinds.empty() || std::find(kinds.begin(), kinds.end(), event.kind()) != kinds.end();
    if (wish.events && fits && event.seq > wish.filter.after) api::append_event_message(out, event);
  }
  return out;
}

/// The events of a stream's text, as they came.
std::string events_of(const std::string& text) {
  std::string out;
  for (const std::string& message : split_lines(text, "\n\n")) {
    if (message.starts_with("event: ") && message.find("\nid: ") != std::string::npos) out += message + "\n\n";
  }
  return out;
}

/// Pulls as a session does: first what is ready, then a worker's pull.
Pull pull(http::BodySource& stream, bool is_first, std::string& out) {
  if (!is_first) {
    std::string own;
    if (auto ready = stream.pull_now(own)) {
      if (ready->shared) out += *ready->shared;
      out += own;
      return ready->pull;
    }
    EXPECT_EQ(own, "") << "nothing may be appended by a pull that did not happen";
  }
  return stream.pull(out);
}

struct Reader {
  api::StreamWish wish;
  std::unique_ptr<api::EventStream> stream;
  std::string text;
  bool is_first = true, has_ended = false;
};

api::StreamWish wish_of(std::uint64_t after, std::vector<EventKind> kinds = {}) {
  api::StreamWish wish;
  wish.filter.after = after;
  wish.filter.kinds = std::move(kinds);
  return wish;
}

TEST(Feed, GivesEveryEventOnceWhereverItMeetsTheStore) {
  std::mt19937 random(7);
  const auto up_to = [&random](std::size_t end) { return random() % (end + 1); };
  const int rounds = colony::testing::scaled(4, 40);
  for (int round = 0; round < rounds; ++round) {
    GrowingJobs jobs(1500);
    api::Feeds feeds(jobs, api::Feeds::Mode::kByHand);
    std::vector<Reader> readers;
    std::size_t visible = 0;
    const auto step = [&](Reader& reader) {
      if (!reader.has_ended)
        reader.has_ended = pull(*reader.stream, std::exchange(reader.is_first, false), reader.text) == Pull::kEnd;
    };
    while (visible < jobs.history.size()) {
      visible = std::min(jobs.history.size(), visible + up_to(up_to(2) == 0 ? 600 : 20));
      jobs.grow(visible, visible == jobs.history.size());
      if (up_to(1) == 0) feeds.refresh_stale();
      if (readers.size() < 12 && up_to(2) == 0) {
        Reader reader;
        reader.wish = up_to(3) == 0 ? wish_of(0, {EventKind::kDivided}) : wish_of(up_to(visible + 50));
        reader.wish.progress = up_to(1) == 0;
        reader.stream = std::make_unique<api::EventStream>(jobs, feeds, jobs.view(), reader.wish);
        reader.stream->on_ready([] {});
        readers.push_back(std::move(reader));
      }
      for (Reader& reader : readers) {
        for (std::size_t pulls = up_to(3); pulls > 0; --pulls) step(reader);
      }
    }
    feeds.refresh_stale();
    for (Reader& reader : readers) {
      for (int pulls = 0; pulls < 1000 && !reader.has_ended; ++pulls) step(reader);
      ASSERT_TRUE(reader.has_ended);
      EXPECT_THAT(reader.text, HasSubstr("event: end\n"));
      ASSERT_EQ(events_of(reader.text), expected_text(jobs, reader.wish)) << "round " << round;
    }
  }
}

TEST(Feed, IsReadAndEncodedOnceForAll) {
  GrowingJobs jobs(400);
  api::Feeds feeds(jobs, api::Feeds::Mode::kByHand);
  std::vector<Reader> readers(100);
  for (Reader& reader : readers) {
    reader.stream = std::make_unique<api::EventStream>(jobs, feeds, jobs.view(), reader.wish);
    reader.stream->on_ready([] {});
    ASSERT_EQ(pull(*reader.stream, true, reader.text), Pull::kWait);
  }
  feeds.refresh_stale();
  jobs.read_count = 0;
  for (std::size_t visible = 10; visible <= 400; visible += 10) {
    jobs.grow(visible);
    feeds.refresh_stale();
    const std::string* shared = nullptr;
    for (Reader& reader : readers) {
      std::string own;
      const auto ready = reader.stream->pull_now(own);
      ASSERT_TRUE(ready && ready->shared) << "one that is in step gets what all get";
      if (shared == nullptr) shared = ready->shared.get();
      EXPECT_EQ(ready->shared.get(), shared);
    }
  }
  EXPECT_EQ(jobs.read_count, 40) << "a reading a growth, whoever watches";
}

TEST(Feed, WakesItsWatchersAfterItWasRead) {
  GrowingJobs jobs(20);
  api::Feeds feeds(jobs, api::Feeds::Mode::kByHand);
  int wakes = 0;
  Reader reader;
  reader.stream = std::make_unique<api::EventStream>(jobs, feeds, jobs.view(), reader.wish);
  reader.stream->on_ready([&wakes] { ++wakes; });
  pull(*reader.stream, true, reader.text);
  feeds.refresh_stale();
  EXPECT_EQ(wakes, 1) << "who began before the feed may have missed a commit";
  jobs.grow(5);
  EXPECT_EQ(wakes, 1) << "there is nothing to be had yet";
  feeds.refresh_stale();
  EXPECT_EQ(wakes, 2);
  feeds.refresh_stale();
  EXPECT_EQ(wakes, 2) << "no news";
}

TEST(Feed, OneThatFallsOutOfItReadsTheStoreAndMissesNothing) {
  GrowingJobs jobs(api::kLagSeqsMax);
  jobs.make_short();
  api::Feeds feeds(jobs, api::Feeds::Mode::kByHand);
  Reader quick, slow;
  for (Reader* reader : {&quick, &slow}) {
    reader->stream = std::make_unique<api::EventStream>(jobs, feeds, jobs.view(), reader->wish);
    reader->stream->on_ready([] {});
    pull(*reader->stream, true, reader->text);
  }
  feeds.refresh_stale();
  for (Reader* reader : {&quick, &slow}) ASSERT_EQ(pull(*reader->stream, false, reader->text), Pull::kWait);
  for (std::size_t visible = 1000; visible <= jobs.history.size(); visible += 1000) {
    jobs.grow(visible, visible == jobs.history.size());
    feeds.refresh_stale();
    while (pull(*quick.stream, false, quick.text) == Pull::kMore) {
    }
  }
  std::string own;
  EXPECT_FALSE(slow.stream->pull_now(own)) << "the feed has dropped what this one needs";
  while (pull(*slow.stream, false, slow.text) != Pull::kEnd) {
  }
  EXPECT_EQ(events_of(quick.text), expected_text(jobs, quick.wish));
  EXPECT_EQ(events_of(slow.text), expected_text(jobs, slow.wish));
}

TEST(Feed, OneThatIsTooSlowIsCutAndGetsTheRestByReconnecting) {
  GrowingJobs jobs(api::kLagSeqsMax + 2000);
  jobs.make_short();
  api::Feeds feeds(jobs, api::Feeds::Mode::kByHand);
  jobs.grow(10);
  Reader slow;
  slow.stream = std::make_unique<api::EventStream>(jobs, feeds, jobs.view(), slow.wish);
  slow.stream->on_ready([] {});
  pull(*slow.stream, true, slow.text);
  feeds.refresh_stale();
  ASSERT_EQ(pull(*slow.stream, false, slow.text), Pull::kWait);
  jobs.grow(jobs.history.size(), true);
  feeds.refresh_stale();
  ASSERT_EQ(pull(*slow.stream, false, slow.text), Pull::kEnd);
  EXPECT_THAT(slow.text, EndsWith("event: lagged\ndata: {\"sent_seq\":10,\"last_seq\":52000}\n\n"));
  EXPECT_THAT(slow.text, Not(HasSubstr("event: end")));
  // A stream that begins far back has not been slow.
  Reader again;
  again.wish = wish_of(10);
  again.stream = std::make_unique<api::EventStream>(jobs, feeds, jobs.view(), again.wish);
  again.stream->on_ready([] {});
  for (bool is_first = true; pull(*again.stream, is_first, again.text) != Pull::kEnd; is_first = false) {
  }
  EXPECT_THAT(again.text, HasSubstr("event: end\n"));
  EXPECT_EQ(events_of(slow.text) + events_of(again.text), expected_text(jobs, slow.wish));
}

TEST(Feed, OfADeletedJobEndsItsStreamsWithoutEnd) {
  GrowingJobs jobs(20);
  api::Feeds feeds(jobs, api::Feeds::Mode::kByHand);
  jobs.grow(20);
  Reader reader;
  reader.stream = std::make_unique<api::EventStream>(jobs, feeds, jobs.view(), reader.wish);
  reader.stream->on_ready([] {});
  pull(*reader.stream, true, reader.text);
  feeds.refresh_stale();
  jobs.row.id = "deleted meanwhile";
  jobs.grow(20);
  feeds.refresh_stale();
  EXPECT_EQ(pull(*reader.stream, false, reader.text), Pull::kEnd);
  EXPECT_THAT(reader.text, Not(HasSubstr("event: end")));
}

TEST(Feed, ReadingsThatFailHalfWayLeaveNothing) {
  GrowingJobs jobs(1000);
  api::Feeds feeds(jobs, api::Feeds::Mode::kByHand);
  Reader reader;
  reader.stream = std::make_unique<api::EventStream>(jobs, feeds, jobs.view(), reader.wish);
  reader.stream->on_ready([] {});
  pull(*reader.stream, true, reader.text);
  feeds.refresh_stale();
  for (int failures = 0; failures < 40; ++failures) {
    jobs.grow(1000);
    jobs.reads_until_failure = 3;  // two pages, and with them whole pieces, were read: 5 MiB in all
    feeds.refresh_stale();
    ASSERT_EQ(jobs.reads_until_failure, 0);
  }
  // Before this watcher has looked, all is well again: nobody tells it that anything was not.
  jobs.grow(1000, true);
  feeds.refresh_stale();
  std::string own;
  const auto ready = reader.stream->pull_now(own);
  ASSERT_TRUE(ready && ready->shared) << "what was kept twice would have pushed out what this one needs";
  reader.text += *ready->shared + own;
  while (pull(*reader.stream, false, reader.text) != Pull::kEnd) {
  }
  EXPECT_EQ(events_of(reader.text), expected_text(jobs, reader.wish));
}

TEST(Feed, LivesAsLongAsItIsWatched) {
  GrowingJobs jobs(20);
  api::Feeds feeds(jobs, api::Feeds::Mode::kByHand);
  const api::Feed::Wish wish{kJobId, 1, true, {}};
  auto first = feeds.find(wish);
  EXPECT_EQ(feeds.find(wish), first);
  api::Feed::Wish other = wish;
  other.filter.kinds = {EventKind::kMoved, EventKind::kDivided};
  auto second = feeds.find(other);
  EXPECT_NE(second, first);
  std::swap(other.filter.kinds[0], other.filter.kinds[1]);
  other.filter.after = 7;
  EXPECT_EQ(feeds.find(other), second) << "the same kinds in another order, from another place";
  const std::weak_ptr<api::Feed> gone = first;
  first.reset();
  EXPECT_TRUE(gone.expired());
  jobs.grow(5);  // nobody is called
  EXPECT_NE(feeds.find(wish), nullptr);
}

/// A watcher on a thread of its own, with the waiting of a session.
class Watching {
 public:
  Watching(GrowingJobs& jobs, api::Feeds& feeds, api::StreamWish wish)
      : wish_(std::move(wish)),
        stream_(std::make_unique<api::EventStream>(jobs, feeds, *jobs.show(kJobId), wish_)),
        thread_([this] { run(); }) {}
  ~Watching() { thread_.join(); }
  const api::StreamWish& wish() const { return wish_; }
  const std::string& text() const { return text_; }
  void join() {
    thread_.join();
    thread_ = std::thread([] {});
  }

 private:
  void run() {
    stream_->on_ready([this] {
      {
        const std::lock_guard lock(mutex_);
        woken_ = true;
      }
      changed_.notify_one();
    });
    bool is_first = true;
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        woken_ = false;
      }
      const Pull pulled = pull(*stream_, std::exchange(is_first, false), text_);
      if (pulled == Pull::kEnd) break;
      if (pulled == Pull::kMore) continue;
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return woken_; });
    }
    stream_.reset();
  }

  const api::StreamWish wish_;
  std::unique_ptr<api::EventStream> stream_;
  std::string text_;
  std::mutex mutex_;  // guards woken_
  std::condition_variable changed_;
  bool woken_ = false;
  std::thread thread_;
};

TEST(Feed, ManyWatchersAtOnceEachGetAll) {
  GrowingJobs jobs(3000);
  jobs.make_short();
  api::Feeds feeds(jobs);
  std::vector<std::unique_ptr<Watching>> watching;
  for (std::size_t visible = 0; visible <= 3000; visible += 10) {
    if (visible % 100 == 0 && watching.size() < 24) {
      api::StreamWish wish = wish_of(visible % 300 == 0 ? visible / 2 : 0);
      if (watching.size() % 4 == 3) wish.filter.kinds = {EventKind::kSenesced};
      watching.push_back(std::make_unique<Watching>(jobs, feeds, wish));
    }
    jobs.grow(visible, visible == 3000);
  }
  for (const auto& one : watching) {
    one->join();
    EXPECT_THAT(one->text(), HasSubstr("event: end\n"));
    EXPECT_EQ(events_of(one->text()), expected_text(jobs, one->wish()));
  }
}

}  // namespace
}  // namespace colony::server::testing
