// Server-sent events: their text, their resumption and their end; the clock is the test's.
#include <chrono>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/codec_event.hpp"
#include "server/api/streams.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(EventStream, HasTheTextFormAndEnds) {
  ApiFixture fixture;
  auto response = fixture.get(kJob + "/events", {{"Accept", "text/event-stream"}});
  EXPECT_EQ(header(response, "Content-Type"), "text/event-stream");
  ASSERT_NE(response.stream, nullptr);
  EXPECT_EQ(response.stream->keep_alive(), ": keep-alive\n\n");
  EXPECT_EQ(response.stream->farewell(), "event: bye\ndata: {}\n\n");
  const std::string text = body_of(response);
  const auto messages = split_lines(text, "\n\n");
  EXPECT_EQ(messages.front(), "retry: 2000");
  const Event& first = fixture.jobs.history.front();
  EXPECT_EQ(messages[1], "event: founded\nid: 1\ndata: " + api::to_text(api::encode_event(first)));
  const std::string last_seq = std::to_string(fixture.jobs.row.last_seq);
  EXPECT_EQ(messages[messages.size() - 2], "id: " + last_seq);
  EXPECT_EQ(messages.back(),
            "event: end\ndata: {\"state\":\"succeeded\",\"reason\":\"cells\",\"last_seq\":" + last_seq + "}");
  std::uint64_t seq = 0;
  for (const std::string& message : messages) {
    if (message.find("\nid: ") == std::string::npos) continue;
    EXPECT_THAT(message, HasSubstr("\nid: " + std::to_string(++seq) + "\n"));
  }
  EXPECT_EQ(seq, fixture.jobs.row.last_seq);
}

TEST(EventStream, TheGreaterOfLastEventIdAndAfterWins) {
  ApiFixture fixture;
  const auto first_id = [&](const std::string& query, const std::string& id) {
    auto response = fixture.get(kJob + "/events" + query, {{"Accept", "text/event-stream"}, {"Last-Event-ID", id}});
    const std::string text = body_of(response);
    const std::size_t at = text.find("id: ") + 4;
    return text.substr(at, text.find('\n', at) - at);
  };
  EXPECT_EQ(first_id("", "3"), "4");
  EXPECT_EQ(first_id("?after=5", "3"), "6");
  EXPECT_EQ(first_id("?after=2", "3"), "4");
  for (const char* id : {"x", "-1", "", "1.5", "99999999999999999999999"}) {
    auto response = fixture.get(kJob + "/events", {{"Accept", "text/event-stream"}, {"Last-Event-ID", id}});
    EXPECT_EQ(response.status, 422) << id;
    EXPECT_THAT(faults(response), ElementsAre("Last-Event-ID"));
  }
  auto limited = fixture.get(kJob + "/events?limit=5", {{"Accept", "text/event-stream"}});
  EXPECT_THAT(faults(limited), ElementsAre("limit"));
}

TEST(EventStream, AReconnectWithNothingLeftIs204) {
  ApiFixture fixture;
  const std::string last = std::to_string(fixture.jobs.row.last_seq);
  const auto status = [&](const std::string& query, std::vector<std::pair<std::string, std::string>> headers) {
    headers.emplace_back("Accept", "text/event-stream");
    return fixture.get(kJob + "/events" + query, headers).status;
  };
  EXPECT_EQ(status("", {{"Last-Event-ID", last}}), 204);
  EXPECT_EQ(status("?after=" + last, {}), 204);
  EXPECT_EQ(status("?kind=founded", {{"Last-Event-ID", "1"}}), 204) << "nothing of its kinds is left";
  EXPECT_EQ(status("?kind=progress", {{"Last-Event-ID", last}}), 204);
  EXPECT_EQ(status("", {}), 200) << "a first visit gets the whole";
  EXPECT_EQ(status("", {{"Last-Event-ID", "1"}}), 200);
  fixture.jobs.row.state = JobState::kRunning;
  EXPECT_EQ(status("", {{"Last-Event-ID", last}}), 200) << "a live job may go on";
}

// A stream under a clock of the test.
class LiveStream : public ::testing::Test {
 protected:
  void SetUp() override {
    jobs.row.state = JobState::kRunning;
    jobs.row.reason.clear();
    jobs.stored = 2;
  }
  http::BodySource& open(const std::string& kinds = "") {
    api::StreamWish wish;
    if (kinds == "progress") wish.events = false;
    stream = std::make_unique<api::EventStream>(jobs, feeds, jobs.view(), wish, [this] { return now; });
    stream->on_ready([] {});
    return *stream;
  }
  std::string pull_until(http::BodySource::Pull wanted) {
    announce();
    std::string out;
    for (int i = 0; i < 1000; ++i) {
      if (stream->pull(out) == wanted) return out;
    }
    ADD_FAILURE() << "the stream did not come to this";
    return out;
  }
  void announce() {
    jobs.waker();
    feeds.refresh_stale();
  }
  FakeJobs jobs;
  api::Feeds feeds{jobs, api::Feeds::Mode::kByHand};
  std::chrono::steady_clock::time_point now{std::chrono::hours(1)};
  std::unique_ptr<api::EventStream> stream;
};

TEST_F(LiveStream, WaitsForWhatIsStoredNextWithoutGapOrRepetition) {
  open();
  EXPECT_TRUE(jobs.waker) << "it listens before it looks";
  const std::string first = pull_until(http::BodySource::Pull::kWait);
  EXPECT_THAT(first, HasSubstr("id: 2\n"));
  EXPECT_THAT(first, Not(HasSubstr("id: 3\n")));
  EXPECT_EQ(pull_until(http::BodySource::Pull::kWait), "") << "a spurious wake says nothing twice";
  jobs.stored = 3;
  EXPECT_THAT(pull_until(http::BodySource::Pull::kWait),
              StartsWith("event: " + std::string(name_of(jobs.history[2].kind())) + "\nid: 3\n"));
  jobs.stored = jobs.history.size();
  jobs.row.state = JobState::kCancelled;
  jobs.row.reason = "cancelled";
  const std::string rest = pull_until(http::BodySource::Pull::kEnd);
  EXPECT_THAT(rest, StartsWith("event: "));
  EXPECT_THAT(rest, HasSubstr("id: 4\n"));
  EXPECT_THAT(rest, HasSubstr("event: end\n"));
}

TEST_F(LiveStream, ProgressComesAtMostFiveTimesASecond) {
  open("progress");
  int messages = 0;
  for (int step = 0; step < 1000; ++step) {  // 10 s in steps of 10 ms, news at every one
    ++jobs.progress.cells;
    announce();
    std::string out;
    ASSERT_EQ(stream->pull(out), http::BodySource::Pull::kWait);
    EXPECT_THAT(out, Not(HasSubstr("id: ")));
    messages += out.find("event: progress\n") != std::string::npos;
    now += std::chrono::milliseconds(10);
  }
  EXPECT_EQ(messages, 50);
  now += std::chrono::seconds(1);
  pull_until(http::BodySource::Pull::kWait);
  now += std::chrono::seconds(1);
  EXPECT_EQ(pull_until(http::BodySource::Pull::kWait), "") << "no news, no message";
}

TEST_F(LiveStream, AChangeOfStateIsSaidAtOnce) {
  open("progress");
  pull_until(http::BodySource::Pull::kWait);
  now += std::chrono::milliseconds(1);
  jobs.row.state = JobState::kPaused;
  const std::string paused = pull_until(http::BodySource::Pull::kWait);
  EXPECT_THAT(paused, StartsWith("event: progress\ndata: {\"state\":\"paused\""));
  EXPECT_EQ(stream->wake_after(), std::nullopt);
  EXPECT_EQ(pull_until(http::BodySource::Pull::kWait), "") << "and once";
}

TEST_F(LiveStream, ProgressThatHadToWaitComesWithoutAnotherWake) {
  open("progress");
  pull_until(http::BodySource::Pull::kWait);
  EXPECT_EQ(stream->wake_after(), std::nullopt) << "nothing is left to say";
  now += std::chrono::microseconds(50'500);
  ++jobs.progress.cells;
  EXPECT_EQ(pull_until(http::BodySource::Pull::kWait), "");
  EXPECT_EQ(stream->wake_after(), std::chrono::milliseconds(150)) << "149.5 ms, rounded up";
  now += *stream->wake_after();
  EXPECT_THAT(pull_until(http::BodySource::Pull::kWait), StartsWith("event: progress\n"));
  EXPECT_EQ(stream->wake_after(), std::nullopt);
}

TEST_F(LiveStream, APieceIsOfItsSizeHoweverManyEventsWait) {
  jobs.stored = SIZE_MAX;
  const Event sample = jobs.history.front();
  jobs.history.assign(1000, sample);
  for (std::size_t i = 0; i < jobs.history.size(); ++i) jobs.history[i].seq = i + 1;
  open();
  std::uint64_t seq = 0;
  for (auto result = http::BodySource::Pull::kMore; result == http::BodySource::Pull::kMore;) {
    std::string piece;
    result = stream->pull(piece);
    EXPECT_LT(piece.size(), api::kPieceBytes + 8 * 1024);
    for (const std::string& message : split_lines(piece, "\n\n")) {
      if (message.find("\nid: ") == std::string::npos) continue;
      EXPECT_THAT(message, HasSubstr("\nid: " + std::to_string(++seq) + "\n"));
    }
  }
  EXPECT_EQ(seq, 1000u);
}

// The rest of a page is sent in a later pull, when more may be stored and the job ended: "terminal, and nothing left" is true only of a
// page that was read after the state.
TEST_F(LiveStream, WhatIsStoredWhileThePieceBeforeWasSentIsNotLostAtTheEnd) {
  const Event sample = jobs.history.front();
  jobs.history.assign(1000, sample);
  for (std::size_t i = 0; i < jobs.history.size(); ++i) jobs.history[i].seq = i + 1;
  for (const std::size_t before : {300U, 600U, 999U}) {
    jobs.stored = before;
    jobs.row.state = JobState::kRunning;
    open();
    std::string out;
    ASSERT_EQ(stream->pull(out), http::BodySource::Pull::kMore) << "the piece is full";
    jobs.stored = jobs.history.size();
    jobs.row.state = JobState::kCancelled;
    jobs.row.reason = "cancelled";
    for (auto result = http::BodySource::Pull::kMore; result != http::BodySource::Pull::kEnd;) {
      std::string piece;
      result = stream->pull(piece);
      ASSERT_NE(result, http::BodySource::Pull::kWait);
      out += piece;
    }
    std::uint64_t seq = 0;
    for (const std::string& message : split_lines(out, "\n\n")) {
      if (message.find("\ndata: ") == std::string::npos || message.find("\nid: ") == std::string::npos) continue;
      if (message.starts_with("event: end") || message.starts_with("id: ")) continue;
      EXPECT_THAT(message, HasSubstr("\nid: " + std::to_string(++seq) + "\n"));
    }
    EXPECT_EQ(seq, 1000U) << before;
  }
}

TEST_F(LiveStream, AJobDeletedUnderItEndsItWithoutEnd) {
  open();
  pull_until(http::BodySource::Pull::kWait);
  jobs.row.id = "deleted meanwhile";
  EXPECT_EQ(pull_until(http::BodySource::Pull::kEnd), "");
}

}  // namespace
}  // namespace colony::server::testing
