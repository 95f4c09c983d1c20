// Answers that are kept: the same as those that are made anew, and never older than the last commit.
#include "server/api/job_texts.hpp"

#include <string>

#include <gtest/gtest.h>

#include "server/api/codec_event.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

http::Request get_job(std::vector<std::pair<std::string, std::string>> headers = {}) {
  http::Request request;
  request.method = "GET";
  request.path = kJob;
  for (const auto& [name, value] : headers) request.headers.add(name, value);
  return request;
}

class KeptAnswers : public ::testing::Test {
 protected:
  void SetUp() override {
    jobs.does_commit = false;
    api_.add_routes(router);
  }
  FakeJobs jobs;
  http::Router router;

 private:
  http::TokenTable tokens_;
  api::Api api_{jobs, tokens_, ApiFixture::config()};
};

TEST(JobText, IsThatOfTheValue) {
  FakeJobs jobs;
  jobs.row.name = "\"spec\":null, \\ and ";
  for (const char* detail : {"", "why\n"}) {
    jobs.row.detail = detail;
    std::string text = "before ";
    api::append_job_text(text, jobs.view(), "/base");
    EXPECT_EQ(text, "before " + api::to_text(api::encode_job(jobs.view(), "/base")));
  }
}

TEST_F(KeptAnswers, AreTheSameAsThoseMadeAnew) {
  auto request = get_job();
  EXPECT_FALSE(router.dispatch_ready(request)) << "nothing is kept yet";
  const auto made = router.dispatch(request);
  ASSERT_EQ(made.status, 200);
  for (const char* method : {"GET", "HEAD"}) {
    request.method = method;
    const auto kept = router.dispatch_ready(request);
    ASSERT_TRUE(kept) << method;
    EXPECT_EQ(kept->status, made.status);
    EXPECT_EQ(kept->body, made.body);
    EXPECT_EQ(kept->headers.all(), made.headers.all());
  }
}

TEST_F(KeptAnswers, AreForgottenWithTheNextCommit) {
  auto request = get_job();
  router.dispatch(request);
  jobs.row.name = "another";
  ++jobs.commits;
  EXPECT_FALSE(router.dispatch_ready(request));
  EXPECT_NE(router.dispatch(request).body.find("another"), std::string::npos);
  ASSERT_TRUE(router.dispatch_ready(request));
  EXPECT_NE(router.dispatch_ready(request)->body.find("another"), std::string::npos);
}

// What is committed while the row is read may or may not be in it.
TEST_F(KeptAnswers, AreNotOfAReadingThatACommitOvertook) {
  class Overtaken : public FakeJobs {
   public:
    using FakeJobs::show;
    Result<JobView> show(const std::string& id) override {
      const auto view = FakeJobs::show(id);
      ++commits;
      return view;
    }
  };
  Overtaken overtaken;
  overtaken.does_commit = false;
  api::JobTexts texts(overtaken, "");
  ASSERT_TRUE(texts.read(kJobId));
  EXPECT_EQ(texts.find(kJobId), nullptr);
}

TEST_F(KeptAnswers, AreOnlyForPlainQuestions) {
  auto plain = get_job();
  router.dispatch(plain);
  ASSERT_TRUE(router.dispatch_ready(plain));
  for (const char* name : {"If-None-Match", "If-Match", "Prefer"}) {
    auto request = get_job({{name, "x"}});
    EXPECT_FALSE(router.dispatch_ready(request)) << name;
  }
  auto picture = get_job({{"Accept", "image/png"}});
  EXPECT_FALSE(router.dispatch_ready(picture)) << "its refusal is not a kept answer";
  auto query = get_job();
  query.query.emplace_back("wait", "1");
  EXPECT_FALSE(router.dispatch_ready(query));
  auto removal = get_job();
  removal.method = "DELETE";
  EXPECT_FALSE(router.dispatch_ready(removal));
  auto other = get_job();
  other.path += "/events";
  EXPECT_FALSE(router.dispatch_ready(other));
}

}  // namespace
}  // namespace colony::server::testing
