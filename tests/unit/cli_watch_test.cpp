// Live streams: the progress of a job and its events as they happen, over connections that break.
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/unit/cli_fixture.hpp"

namespace colony::client {
namespace {

using test::FakeConnection;
using test::FakeRequest;
using test::FakeServer;
using test::json_answer;
using test::stream_head;
using testing::HasSubstr;
using testing::StartsWith;

/// A server whose job is `running` for its first answer and `state` afterwards, with `stream` answering each event
/// stream.
class WatchedJob {
 public:
  using Stream = std::function<void(int, const FakeConnection&)>;
  WatchedJob(std::string state, Stream stream)
      : server_([this, state, stream](const FakeRequest& request, const FakeConnection& to) {
          if (request.line().find("/events") != std::string::npos) return stream(stream_count_++, to);
          to.send(json_answer(200, job_json(job_count_++ == 0 ? "running" : state)));
        }) {}
  const FakeServer& server() const { return server_; }

 private:
  int stream_count_ = 0, job_count_ = 0;  // of the server's thread
  FakeServer server_;
};

const std::string kProgress =
    "event: progress\ndata: {\"time_h\":10.5,\"cells\":7,\"fraction\":0.04,\"cells_per_s\":90.0,\"eta_s\":2}\n\n";

TEST_F(Cli, WatchEndsAsTheJobDoes) {
  for (const auto& [state, code] : std::map<std::string, int>{{"succeeded", 0}, {"failed", 1}, {"cancelled", 5}}) {
    WatchedJob job(state, [](int, const FakeConnection& to) {
      to.send(stream_head() + "retry: 1\n\n" + kProgress + "event: end\nid: 400\ndata: {}\n\n");
      to.wait_for_close();  // a proxy may keep the connection: `end` alone must do
    });
    use(job.server());
    EXPECT_EQ(run({"watch", kId}), code);
    EXPECT_THAT(out(), StartsWith("running: 100 %, 180 cells, 172.3 h\n"));  // the job as it was found
    EXPECT_THAT(out(), testing::EndsWith(state + " (cells): 180 cells at 172.30 h, digest abc123\n"));
    EXPECT_EQ(job.server().requests().at(1).header("Accept"), "text/event-stream");
  }
}

TEST_F(Cli, WatchConnectsAgainAndMissesNothing) {
  WatchedJob job("succeeded", [](int index, const FakeConnection& to) {
    if (index == 0) return to.send(stream_head() + "retry: 1\n\nid: 17\n" + kProgress + "event: bye\ndata: {}\n\n");
    if (index == 1) return to.send(json_answer(503, "{}", "Retry-After: 0\r\n"));
    if (index == 2) return;  // closed without a word
    to.send("HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n");
  });
  use(job.server());
  EXPECT_EQ(run({"watch", kId}), 0);
  EXPECT_THAT(err(), HasSubstr("connecting again"));
  EXPECT_EQ(job.server().requests().at(2).header("Last-Event-ID"), "17");
}

TEST_F(Cli, WatchGivesUpOnAServerThatStaysAway) {
  WatchedJob job("succeeded", [](int, const FakeConnection&) {});
  use(job.server());
  EXPECT_EQ(run({"watch", kId}), 3);
  EXPECT_THAT(err(), HasSubstr("gave up after 3 attempts"));
}

TEST_F(Cli, CtrlCLeavesTheJobRunning) {
  WatchedJob job("succeeded", [this](int, const FakeConnection& to) {
    to.send(stream_head() + kProgress);
    interrupt_.raise();
    to.wait_for_close();
  });
  use(job.server());
  EXPECT_EQ(run({"watch", kId}), 130);
  EXPECT_THAT(err(), HasSubstr("the job goes on"));
  for (const FakeRequest& request : job.server().requests()) EXPECT_THAT(request.line(), StartsWith("GET "));
}

TEST_F(Cli, WatchDrawsABarOnATerminal) {
  out_is_terminal_ = true;
  WatchedJob job("succeeded", [](int, const FakeConnection& to) {
    to.send(stream_head() + kProgress + "event: end\ndata: {}\n\n");
  });
  use(job.server());
  EXPECT_EQ(run({"watch", kId}), 0);
  EXPECT_THAT(out(), HasSubstr("\r[..............]  4 %  7 cells  ETA 2 s  10.5 h  90 cells/s\x1b[K"));
}

TEST_F(Cli, SubmitAndWatchAsJsonLines) {
  WatchedJob job("succeeded", [](int, const FakeConnection& to) {
    to.send(stream_head() + kProgress + "event: end\ndata: {}\n\n");
  });
  use(job.server());
  EXPECT_EQ(run({"submit", "--preset", "paper", "--watch", "--json"}), 0);
  std::istringstream lines(out());
  std::string line;
  int count = 0;
  for (; std::getline(lines, line); ++count) EXPECT_TRUE(nlohmann::json::accept(line)) << line;
  EXPECT_EQ(count, 2);  // the job was submitted (its first answer), had ended by the next look, so: the job, the job
}

TEST_F(Cli, FollowGoesOnAfterTheLastEventItWrote) {
  FakeServer server([](const FakeRequest& request, const FakeConnection& to) {
    if (request.header("Last-Event-ID").empty()) {
      return to.send(stream_head() +
                     "retry: 1\n\nevent: founded\nid: 1\ndata: {\"seq\":1}\n\nevent: divided\nid: 2\ndata: {\"se");
    }
    to.send(stream_head() +
            "event: divided\nid: 2\ndata: {\"seq\":2}\n\nevent: end\nid: 2\ndata: {\"state\":\"failed\"}\n\n");
  });
  use(server);
  EXPECT_EQ(run({"events", kId, "--follow", "--ndjson"}), 0);
  EXPECT_EQ(out(), "{\"seq\":1}\n{\"seq\":2}\n");
  EXPECT_EQ(server.requests().at(1).header("Last-Event-ID"), "1");
  EXPECT_THAT(err(), HasSubstr("the job has ended: failed"));
}

}  // namespace
}  // namespace colony::client
