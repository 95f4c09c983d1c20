// The stream of a page: state first, then changes; progress in turn and bounded; the clock is the test's.
#include <atomic>
#include <future>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/page_stream.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Kind = JobNews::Kind;
using Pull = http::BodySource::Pull;

/// Many jobs of one row's likeness; only what a page asks for.
class ManyJobs : public FakeJobs {
 public:
  using FakeJobs::show;
  std::map<std::int64_t, JobRow> rows;
  int shows = 0;
  int progress_reads = 0;
  int pages = 0;
  std::function<void()> during_show;

  JobRow& add(std::int64_t key, JobState state) {
    JobRow& one = rows[key] = row;
    one.job_key = key;
    one.id = "id-" + std::to_string(key);
    one.state = state;
    return one;
  }
  Result<JobView> show(std::int64_t key) override {
    ++shows;
    if (during_show) std::exchange(during_show, nullptr)();
    const auto found = rows.find(key);
    if (found == rows.end()) return Error{ErrorCode::kNotFound, "gone"};
    return JobView{found->second, progress};
  }
  std::optional<Progress> live_progress(std::int64_t key) override {
    ++progress_reads;
    Progress now = progress;
    now.last_seq = static_cast<std::uint64_t>(1000 + key);
    return rows.contains(key) && rows[key].state == JobState::kRunning ? std::optional(now) : std::nullopt;
  }
  Result<Page> list(const JobFilter& filter, std::size_t limit, const std::string& cursor) override {
    ++pages;
    Page page;
    const std::int64_t before = cursor.empty() ? 1'000'000 : std::stoll(cursor);
    for (auto one = rows.rbegin(); one != rows.rend(); ++one) {
      if (one->first >= before || one->second.state != filter.state) continue;
      if (page.items.size() == limit) {
        page.next = std::to_string(page.items.back().job.job_key);
        break;
      }
      page.items.push_back({one->second, progress});
    }
    return page;
  }
};

class PageStreamTest : public ::testing::Test {
 protected:
  api::PageStream& open(api::PageWish wish) {
    stream_ = std::make_unique<api::PageStream>(jobs_, pages_, std::move(wish), [this] { return now_; });
    stream_->on_ready([this] { ++wakes_; });
    return *stream_;
  }
  api::PageStream& open_all() {
    api::PageWish wish;
    wish.is_all = true;
    return open(std::move(wish));
  }
  /// "kind id" of every message until the stream waits.
  std::vector<std::string> drawn() {
    text_.clear();
    do {
      std::string piece;  // empty for each pull, as the session has it
      ended_ = stream_->pull(piece);
      text_ += piece;
    } while (ended_ == Pull::kMore);
    std::vector<std::string> out;
    for (const std::string& message : split_lines(text_, "\n\n")) {
      const std::size_t data = message.find("\ndata: ");
      if (data == std::string::npos) continue;
      const Json body = Json::parse(message.substr(data + 7));
      std::string line = message.substr(7, data - 7);
      if (body.contains("id")) line += " " + body["id"].get<std::string>();
      out.push_back(line);
    }
    return out;
  }
  void announce(std::int64_t key, Kind kind) {
    jobs_.hearer({key, kind, kind == Kind::kRemoved ? "id-" + std::to_string(key) : ""});
  }
  void hear(std::int64_t key, Kind kind) {
    announce(key, kind);
    pages_.distribute();
  }

  ManyJobs jobs_;
  api::Pages pages_{jobs_, "/base", api::Pages::Mode::kByHand};
  std::chrono::steady_clock::time_point now_{std::chrono::hours(1)};
  std::unique_ptr<api::PageStream> stream_;
  int wakes_ = 0;
  std::string text_;
  Pull ended_ = Pull::kMore;
};

TEST_F(PageStreamTest, BeginsWithWhatHasNotEnded) {
  jobs_.add(1, JobState::kSucceeded);
  jobs_.add(2, JobState::kQueued);
  jobs_.add(3, JobState::kRunning);
  jobs_.add(4, JobState::kPaused);
  jobs_.add(5, JobState::kFailed);
  open_all();
  EXPECT_THAT(drawn(), ElementsAre("job id-3", "job id-2", "job id-4", "ready"));
  EXPECT_EQ(ended_, Pull::kWait);
  EXPECT_THAT(text_, ::testing::StartsWith("retry: 2000\n\n"));
  EXPECT_THAT(text_, HasSubstr("\"self\":\"/base/v1/jobs/id-3\""));
  EXPECT_THAT(text_, HasSubstr("event: ready\ndata: {\"jobs\":3}"));
  EXPECT_EQ(stream_->farewell(), "event: bye\ndata: {}\n\n");
  EXPECT_THAT(drawn(), ElementsAre());
}

TEST_F(PageStreamTest, TellsEachChangeOnceAndNothingElse) {
  jobs_.add(2, JobState::kRunning);
  open_all();
  drawn();
  hear(2, Kind::kChange);
  EXPECT_EQ(wakes_, 1);
  EXPECT_THAT(drawn(), ElementsAre()) << "news without a change";
  jobs_.rows[2].revision = 9;
  hear(2, Kind::kChange);
  hear(2, Kind::kChange);
  EXPECT_EQ(wakes_, 2) << "what waits already wakes nobody again";
  EXPECT_THAT(drawn(), ElementsAre("job id-2"));
  jobs_.add(7, JobState::kQueued);
  hear(7, Kind::kChange);
  EXPECT_THAT(drawn(), ElementsAre("job id-7"));
  jobs_.rows[2].state = JobState::kSucceeded;
  hear(2, Kind::kChange);
  EXPECT_THAT(drawn(), ElementsAre("job id-2"));
  jobs_.rows.erase(2);
  hear(2, Kind::kChange);
  hear(2, Kind::kRemoved);
  EXPECT_THAT(drawn(), ElementsAre("deleted id-2"));
}

TEST_F(PageStreamTest, WhatChangesWhileTheStateIsToldIsNotLost) {
  for (std::int64_t key = 1; key <= 100; ++key) jobs_.add(key, JobState::kQueued);
  open_all();
  std::string piece;
  ASSERT_EQ(stream_->pull(piece), Pull::kMore) << "in pieces";
  EXPECT_LT(piece.size(), 300u * 1024);
  EXPECT_THAT(piece, HasSubstr("id-100"));
  jobs_.rows[100].state = JobState::kRunning;  // from a page still to come to one that is past
  jobs_.rows[100].revision = 2;
  hear(100, Kind::kChange);
  const auto rest = drawn();
  EXPECT_EQ(std::count(rest.begin(), rest.end(), "job id-100"), 1);
  EXPECT_EQ(std::count(rest.begin(), rest.end(), "job id-1"), 1);
  EXPECT_GT(std::find(rest.begin(), rest.end(), "job id-100"), std::find(rest.begin(), rest.end(), "ready"));
}

TEST_F(PageStreamTest, OfNamedJobsTellsThoseAlone) {
  jobs_.add(1, JobState::kSucceeded);
  jobs_.add(2, JobState::kRunning);
  jobs_.add(3, JobState::kRunning);
  api::PageWish wish;
  wish.jobs = {{1, "id-1"}, {2, "id-2"}, {4, "id-4"}};
  wish.missing = {"id-9"};
  open(std::move(wish));
  EXPECT_THAT(drawn(), ElementsAre("job id-1", "job id-2", "deleted id-4", "deleted id-9", "ready"));
  hear(3, Kind::kChange);
  hear(3, Kind::kCommit);
  EXPECT_EQ(wakes_, 0);
  jobs_.rows[1].revision = 4;
  hear(1, Kind::kChange);
  EXPECT_THAT(drawn(), ElementsAre("job id-1")) << "an ended job can be renamed";
}

TEST_F(PageStreamTest, ProgressOfAJobComesAtMostFiveTimesASecond) {
  jobs_.add(1, JobState::kRunning);
  open_all();
  drawn();
  const auto from = now_;
  int told = 0;
  for (; now_ < from + std::chrono::seconds(2); now_ += std::chrono::milliseconds(1)) {
    hear(1, Kind::kCommit);
    told += static_cast<int>(drawn().size());
  }
  EXPECT_EQ(told, 10);
  EXPECT_EQ(jobs_.shows, 0) << "progress is read from memory";
  hear(1, Kind::kCommit);
  EXPECT_THAT(drawn(), ElementsAre("progress id-1"));
  hear(1, Kind::kCommit);
  EXPECT_THAT(drawn(), ElementsAre());
  ASSERT_EQ(stream_->wake_after(), api::kPageTick) << "what is held back comes by itself";
  const int before = wakes_;
  for (int i = 0; i < 100; ++i) hear(1, Kind::kCommit);
  EXPECT_EQ(wakes_, before) << "more of it wakes nobody";
  now_ += *stream_->wake_after();
  EXPECT_THAT(drawn(), ElementsAre("progress id-1"));
  EXPECT_THAT(text_, HasSubstr("\"last_seq\":1001"));
}

TEST_F(PageStreamTest, ProgressOfManyIsBoundedAndEachHasItsTurn) {
  for (std::int64_t key = 1; key <= 64; ++key) jobs_.add(key, JobState::kRunning);
  open_all();
  drawn();
  std::map<std::string, int> told;
  std::size_t in_all = 0;
  const auto from = now_;
  for (; now_ < from + std::chrono::seconds(7); now_ += std::chrono::milliseconds(50)) {
    for (std::int64_t key = 1; key <= 64; ++key) hear(key, Kind::kCommit);
    for (const std::string& line : drawn()) {
      ++told[line];
      ++in_all;
    }
  }
  EXPECT_LE(in_all, 7u * 5 * api::kProgressPerTickMax);
  EXPECT_EQ(told.size(), 64u);
  for (const auto& [line, count] : told) EXPECT_NEAR(count, 7.0 * 50 / 64, 1.0) << line;
}

TEST_F(PageStreamTest, CostsWhatChangesNotWhatIsStored) {
  for (std::int64_t key = 1; key <= 10'000; ++key) jobs_.add(key, JobState::kSucceeded);
  jobs_.add(10'001, JobState::kRunning);
  open_all();
  EXPECT_THAT(drawn(), ElementsAre("job id-10001", "ready"));
  EXPECT_EQ(jobs_.pages, 3) << "one page of each state";
  jobs_.rows[5].revision = 2;
  hear(5, Kind::kChange);
  EXPECT_THAT(drawn(), ElementsAre("job id-5"));
  EXPECT_EQ(jobs_.shows, 1);
}

TEST_F(PageStreamTest, AReaderThatIsTooFarBehindIsSentAway) {
  open_all();
  drawn();
  for (std::int64_t key = 0; key <= static_cast<std::int64_t>(api::kNewsMax); ++key) {
    announce(key, Kind::kChange);
    if (key == 1000) pages_.distribute();
  }
  pages_.distribute();
  EXPECT_THAT(drawn(), ElementsAre("lagged"));
  EXPECT_EQ(ended_, Pull::kEnd);
}

TEST_F(PageStreamTest, AThousandPagesCostOneReadingAndOneEncoding) {
  jobs_.add(1, JobState::kRunning);
  jobs_.add(2, JobState::kQueued);
  std::vector<std::unique_ptr<api::PageStream>> streams;
  const auto pull_all = [&] {
    std::set<std::string> texts;
    for (const auto& stream : streams) {
      std::string text;
      while (true) {
        std::string piece;
        const Pull pulled = stream->pull(piece);
        text += piece;
        if (pulled != Pull::kMore) break;
      }
      texts.insert(text);
    }
    return texts;
  };
  for (int i = 0; i < 1000; ++i) {
    api::PageWish wish;
    wish.is_all = true;
    streams.push_back(std::make_unique<api::PageStream>(jobs_, pages_, wish, [this] { return now_; }));
    streams.back()->on_ready([this] { ++wakes_; });
  }
  EXPECT_EQ(pull_all().size(), 1u);
  const JobView queued{jobs_.rows[2], jobs_.progress};
  EXPECT_EQ(pages_.message_of(queued), pages_.message_of(queued)) << "what each page reads for itself is encoded once, too";
  jobs_.rows[1].revision = 5;
  announce(1, Kind::kChange);
  EXPECT_EQ(wakes_, 0) << "who announces does not wake a thousand";
  pages_.distribute();
  EXPECT_EQ(wakes_, 1000);
  EXPECT_THAT(*pull_all().begin(), HasSubstr("\"revision\":5"));
  EXPECT_EQ(jobs_.shows, 1);
  hear(1, Kind::kCommit);
  const auto progress = pull_all();
  EXPECT_EQ(progress.size(), 1u);
  EXPECT_THAT(*progress.begin(), ::testing::StartsWith("event: progress\n"));
  EXPECT_EQ(jobs_.progress_reads, 1);
  EXPECT_EQ(jobs_.shows, 1);
}

TEST_F(PageStreamTest, ATextThatWasReadBeforeNewsIsNotGivenAfterThem) {
  jobs_.add(1, JobState::kRunning);
  open_all();
  drawn();
  jobs_.rows[1].revision = 2;
  jobs_.during_show = [this] { announce(1, Kind::kChange); };  // while it is read it changes again
  hear(1, Kind::kChange);
  EXPECT_THAT(drawn(), ElementsAre("job id-1"));
  jobs_.rows[1].revision = 3;
  pages_.distribute();
  EXPECT_THAT(drawn(), ElementsAre("job id-1"));
  EXPECT_THAT(text_, HasSubstr("\"revision\":3"));
  // Progress likewise, and it says the state that this page was told.
  hear(1, Kind::kCommit);
  EXPECT_THAT(drawn(), ElementsAre("progress id-1"));
  EXPECT_EQ(pages_.progress_of(1, "id-1", JobState::kRunning), pages_.progress_of(1, "id-1", JobState::kRunning));
  EXPECT_THAT(*pages_.progress_of(1, "id-1", JobState::kPaused), HasSubstr("\"state\":\"paused\""));
  // When nobody looks, nothing is heard: what was kept counts no more.
  stream_.reset();
  jobs_.rows[1].revision = 4;
  announce(1, Kind::kChange);
  open_all();
  EXPECT_EQ((*pages_.message_of(1))->revision, 4u);
}

TEST_F(PageStreamTest, WhatIsOlderThanWhatWasToldIsNotTold) {
  jobs_.add(1, JobState::kRunning).revision = 3;
  open_all();
  ASSERT_TRUE(pages_.message_of(1));
  jobs_.rows[1].revision = 4;  // committed, and its news are on their way
  EXPECT_THAT(drawn(), ElementsAre("job id-1", "ready"));
  jobs_.rows[1].revision = 3;
  hear(1, Kind::kChange);
  EXPECT_THAT(drawn(), ElementsAre());
}

TEST(Pages, TellFromAThreadOfTheirOwn) {
  ManyJobs jobs;
  api::Pages pages(jobs, "");
  std::promise<std::pair<std::thread::id, std::set<std::int64_t>>> heard;
  std::atomic<bool> is_first{true};
  const auto subscription = pages.subscribe([&](const api::Pages::News& news) {
    if (is_first.exchange(false)) heard.set_value({std::this_thread::get_id(), news.changed});
  });
  jobs.hearer({7, Kind::kChange, {}});
  const auto [thread, keys] = heard.get_future().get();
  EXPECT_NE(thread, std::this_thread::get_id());
  EXPECT_THAT(keys, ElementsAre(7));
}

TEST(StreamOfAPage, IsAskedForByIdsOrAll) {
  ApiFixture fixture;
  for (const char* target : {"/v1/stream", "/v1/stream?jobs=all"}) {
    auto response = fixture.get(target);
    EXPECT_EQ(response.status, 200);
    EXPECT_EQ(header(response, "Content-Type"), "text/event-stream");
    EXPECT_EQ(header(response, "Cache-Control"), "no-store");
    ASSERT_NE(response.stream, nullptr);
  }
  const std::string other = "01890000-0000-7000-8000-00000000ffff";
  auto named = fixture.get(std::string("/v1/stream?jobs=") + kJobId + "," + other);
  ASSERT_NE(named.stream, nullptr);
  std::string text;
  while (named.stream->pull(text) == Pull::kMore) {
  }
  EXPECT_THAT(text, HasSubstr("event: job\n"));
  EXPECT_THAT(text, HasSubstr("event: deleted\ndata: {\"id\":\"" + other + "\"}"));
  std::string many = kJobId;
  for (int i = 0; i < 100; ++i) many += "," + other;
  for (const std::string& wrong : {std::string(), std::string("all,all"), std::string("x"), std::string(kJobId) + ",", many}) {
    auto response = fixture.get("/v1/stream?jobs=" + wrong);
    EXPECT_EQ(response.status, 422) << wrong;
    EXPECT_THAT(faults(response), ElementsAre("jobs"));
  }
  EXPECT_EQ(fixture.get("/v1/stream", {{"Accept", "application/json"}}).status, 406);
}

}  // namespace
}  // namespace colony::server::testing
