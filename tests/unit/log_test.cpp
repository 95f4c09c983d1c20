// Lines of the log: one each whatever comes, and no secret.
#include "server/log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/http/tokens.hpp"

namespace colony::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

http::AccessRecord record() {
  http::AccessRecord out;
  out.method = "GET";
  out.path = "/v1/jobs/\"\n\x1b[31m\xff";
  out.request_id = "r-1";
  out.remote = "192.0.2.1:5";
  out.status = 404;
  out.duration_us = 12;
  out.body_bytes = 34;
  out.actor = "ann";
  out.token_id = "t-1";
  return out;
}

TEST(Log, JsonIsOneEscapedLine) {
  const LogLine line = log_access(LogFormat::kJson, "2026-01-02T03:04:05.678Z", record());
  EXPECT_EQ(line.text,
            "{\"time\":\"2026-01-02T03:04:05.678Z\",\"level\":\"info\",\"event\":\"request\",\"request_id\":\"r-1\","
            "\"remote\":\"192.0.2.1:5\",\"method\":\"GET\",\"path\":\"/v1/jobs/\\\"\\n\\u001b[31m\xef\xbf\xbd\","
            "\"status\":404,\"duration_us\":12,\"bytes\":34,\"actor\":\"ann\",\"token_id\":\"t-1\"}");
}

TEST(Log, TextIsOneLineToo) {
  const LogLine line = log_access(LogFormat::kText, "", record());
  EXPECT_THAT(line.text, HasSubstr("/v1/jobs/\"\\x0a\\x1b[31m"));
  EXPECT_THAT(line.text, HasSubstr(" ann 192.0.2.1:5 [r-1]"));
  EXPECT_THAT(line.text, Not(HasSubstr("\n")));
  EXPECT_EQ(log_event(LogFormat::kText, "", "info", "a\nb").text, "a\\x0ab");
}

TEST(Log, AnAnswerThatNobodyTookIsMarked) {
  http::AccessRecord access = record();
  for (const bool left : {false, true}) {
    access.peer_left = left;
    const auto marked = [left](const char* mark) { return left ? ::testing::Matcher<std::string>(HasSubstr(mark)) : Not(HasSubstr("left")); };
    EXPECT_THAT(log_access(LogFormat::kJson, "", access).text, marked(",\"peer_left\":true}"));
    EXPECT_THAT(log_access(LogFormat::kText, "", access).text, marked(" 404 peer left 12 us "));
  }
}

TEST(Log, ATokenInAnUnlikelyPlaceIsHidden) {
  const std::string token = *http::new_token();
  http::AccessRecord access = record();
  access.path = "/v1/tokens/" + token;
  http::Request request;
  request.path = "/" + token;
  for (const LogFormat format : {LogFormat::kText, LogFormat::kJson}) {
    for (const LogLine& line : {log_access(format, "", access), log_failure(format, "", request, "threw " + token),
                                log_event(format, "", "error", token)}) {
      EXPECT_THAT(line.text, Not(HasSubstr(token.substr(0, 20))));
      EXPECT_THAT(line.text, HasSubstr("colony_[hidden]"));
    }
  }
}

TEST(Log, WhatAClientChoseIsSearchedForSecrets) {
  const std::string secret = http::new_token()->substr(7);  // the bare digits
  http::AccessRecord access = record();
  http::Request request;
  request.method = "GET";
  request.path = "/v1/jobs";
  for (std::string* const field : {&access.method, &access.path, &access.request_id, &access.actor}) *field += secret;
  for (std::string* const field : {&request.method, &request.path, &request.request_id, &request.principal.name}) *field += secret;
  for (const LogFormat format : {LogFormat::kText, LogFormat::kJson}) {
    for (const LogLine& line : {log_access(format, "", access), log_failure(format, "", request, "threw")}) {
      EXPECT_THAT(line.text, Not(HasSubstr(secret.substr(0, 12))));
      EXPECT_THAT(line.text, HasSubstr("GET[hidden]"));
    }
  }
}

}  // namespace
}  // namespace colony::server
