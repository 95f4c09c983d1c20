// Who may ask, and how often: with a clock that the tests move.
#include "server/http/admission.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/http/guarded_source.hpp"

namespace colony::server::http {
namespace {

using ::testing::HasSubstr;
using std::chrono::milliseconds;
using std::chrono::seconds;

const Buckets::Clock::time_point kStart{std::chrono::hours(1)};
constexpr std::int64_t kNow_unix_ms = 1'800'000'000'000;

TEST(Buckets, GiveTheBurstAtOnceAndTheRateAfterIt) {
  Buckets buckets({2.0, 3.0});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(buckets.take("a", kStart), 0) << i;
  EXPECT_EQ(buckets.take("a", kStart), 1) << "half a second, told in whole ones";
  EXPECT_EQ(buckets.take("b", kStart), 0) << "another key has its own";
  EXPECT_NE(buckets.take("a", kStart + milliseconds(499)), 0);
  EXPECT_EQ(buckets.take("a", kStart + milliseconds(500)), 0);
  EXPECT_NE(buckets.take("a", kStart + milliseconds(500)), 0);
  int taken = 0;
  for (int ms = 500; ms <= 100'500; ms += 10) taken += buckets.take("a", kStart + milliseconds(ms)) == 0;
  EXPECT_EQ(taken, 200) << "two a second for a hundred seconds, however often is asked";
  for (int i = 0; i < 3; ++i) EXPECT_EQ(buckets.take("a", kStart + seconds(1'000'000)), 0);
  EXPECT_NE(buckets.take("a", kStart + seconds(1'000'000)), 0) << "saved up is the burst and no more";
}

TEST(Buckets, SayWhenItIsWorthAskingAgain) {
  Buckets slow({0.1, 1.0});
  EXPECT_EQ(slow.take("a", kStart), 0);
  EXPECT_EQ(slow.take("a", kStart), 10);
  EXPECT_EQ(slow.take("a", kStart + seconds(9)), 1);
  EXPECT_EQ(slow.take("a", kStart + seconds(10)), 0) << "what it said was true";
  Buckets none({0.0, 1.0});
  for (int i = 0; i < 100; ++i) EXPECT_EQ(none.take("a", kStart), 0);
  EXPECT_EQ(none.key_count(), 0u);
}

TEST(Buckets, AreBoundedAndThoseBeyondShareOne) {
  Buckets buckets({1.0, 2.0}, 3);
  for (const char* key : {"a", "b", "c"}) EXPECT_EQ(buckets.take(key, kStart), 0);
  EXPECT_EQ(buckets.take("d", kStart), 0);
  EXPECT_EQ(buckets.take("e", kStart), 0);
  EXPECT_NE(buckets.take("f", kStart), 0) << "a new address is no fresh bucket";
  EXPECT_EQ(buckets.take("a", kStart), 0) << "known ones keep theirs";
  EXPECT_EQ(buckets.key_count(), 3u);
  EXPECT_EQ(buckets.take("f", kStart + seconds(5)), 0) << "full buckets gave their place";
  EXPECT_EQ(buckets.key_count(), 1u);
}

TEST(ClientAddress, CountsWhatOneCustomerHas) {
  EXPECT_EQ(client_address("192.0.2.7")->key, "192.0.2.7");
  EXPECT_EQ(client_address("::ffff:192.0.2.7")->key, "192.0.2.7");
  EXPECT_EQ(client_address("2001:db8:1:2:3:4:5:6")->key, client_address("2001:db8:1:2:ffff::1")->key);
  EXPECT_NE(client_address("2001:db8:1:2::1")->key, client_address("2001:db8:1:3::1")->key);
  EXPECT_EQ(client_address("2001:db8:1:2::1")->text, "2001:db8:1:2::1");
  for (const char* loopback : {"127.0.0.1", "127.9.9.9", "::1", "::ffff:127.0.0.1"}) {
    EXPECT_TRUE(client_address(loopback)->is_loopback) << loopback;
  }
  for (const char* none : {"", "localhost", "1.2.3", "1.2.3.4:5", "[::1]", "1.2.3.4 "}) {
    EXPECT_FALSE(client_address(none)) << none;
  }
}

TEST(ClientAddress, OnlyTheLastForwardedEntryIsTheProxys) {
  const ClientAddress peer = *client_address("127.0.0.1");
  Headers headers;
  EXPECT_EQ(forwarded_address(headers, peer).text, "127.0.0.1");
  headers.add("X-Forwarded-For", "10.0.0.1, 192.0.2.1");
  EXPECT_EQ(forwarded_address(headers, peer).text, "192.0.2.1");
  headers.add("x-forwarded-for", "198.51.100.2");
  EXPECT_EQ(forwarded_address(headers, peer).text, "198.51.100.2");
  headers.add("X-Forwarded-For", "forged");
  EXPECT_EQ(forwarded_address(headers, peer).text, "127.0.0.1");
}

TEST(Tokens, AreRandomHashedAndNeverShown) {
  const std::string a = *new_token();
  const std::string b = *new_token();
  EXPECT_TRUE(is_token_text(a));
  EXPECT_NE(a, b);
  EXPECT_FALSE(is_token_text(a + "0"));
  EXPECT_FALSE(is_token_text(a.substr(1)));
  // FIPS 180-2, B.1: the hash of "abc".
  const TokenHash abc = hash_of_token("abc");
  EXPECT_EQ(abc[0], 0xba);
  EXPECT_EQ(abc[31], 0xad);
  EXPECT_EQ(without_tokens("GET /" + a + "/" + b + " x"), "GET /colony_[hidden]/colony_[hidden] x");
  EXPECT_EQ(without_tokens("cut " + a.substr(0, 40)), "cut colony_[hidden]");
  EXPECT_EQ(without_tokens("/colony_face colony_"), "/colony_face colony_");
  const std::string digits = a.substr(7);
  EXPECT_EQ(without_tokens("id " + digits + "-2"), "id [hidden]-2") << "without its prefix";
  std::string upper = a;
  std::transform(upper.begin(), upper.end(), upper.begin(), [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  EXPECT_EQ(without_tokens(upper), "COLONY_[hidden]");
  EXPECT_EQ(without_tokens(a + a), "colony_[hidden]olony_[hidden]");
  for (const std::size_t count : {33, 48, 63}) EXPECT_EQ(without_tokens("/v1/" + digits.substr(64 - count)), "/v1/[hidden]") << count;
  EXPECT_EQ(without_tokens(digits.substr(0, 32)), digits.substr(0, 32)) << "ids and digests have so many";
}

class AdmissionTest : public ::testing::Test {
 protected:
  std::string add(const std::string& name, Scope scope, std::int64_t expires_unix_ms = kNow_unix_ms + 1000) {
    std::string token = *new_token();
    table.add({"id-" + name, name, scope, hash_of_token(token), expires_unix_ms});
    return token;
  }
  static Headers bearer(const std::string& token) {
    Headers headers;
    headers.add("Authorization", "Bearer " + token);
    return headers;
  }
  static Admission::Moment at(std::int64_t after_ms) {
    return {kStart + milliseconds(after_ms), kNow_unix_ms + after_ms};
  }
  int status(Admission& admission, const Headers& headers, Access access, std::int64_t after_ms = 0) {
    last = admission.admit(headers, access, client, at(after_ms), who);
    return last ? last->status : 200;
  }

  AdmissionConfig config{true, false, false, {10.0, 5.0}, 2.0};
  TokenTable table;
  ClientAddress client = *client_address("192.0.2.1");
  Principal who;
  std::optional<Refusal> last;
};

TEST_F(AdmissionTest, WithoutTokensEverybodyIsTheLocalAdmin) {
  config.tokens_required = false;
  Admission admission(config, table);
  EXPECT_EQ(status(admission, {}, Access::kAdmin), 200);
  EXPECT_EQ(who.name, "local");
  EXPECT_EQ(who.scope, Scope::kAdmin);
}

TEST_F(AdmissionTest, ScopesIncludeThoseBefore) {
  Admission admission(config, table);
  const std::map<Scope, std::string> tokens = {
      {Scope::kRead, add("r", Scope::kRead)}, {Scope::kSubmit, add("s", Scope::kSubmit)}, {Scope::kAdmin, add("a", Scope::kAdmin)}};
  for (const auto& [scope, token] : tokens) {
    EXPECT_EQ(status(admission, bearer(token), Access::kOpen), 200);
    EXPECT_EQ(status(admission, bearer(token), Access::kRead), 200);
    EXPECT_EQ(who.name, std::string(1, name_of(scope)[0]));
    EXPECT_EQ(status(admission, bearer(token), Access::kSubmit), scope >= Scope::kSubmit ? 200 : 403);
    EXPECT_EQ(status(admission, bearer(token), Access::kAdmin), scope >= Scope::kAdmin ? 200 : 403);
  }
  EXPECT_EQ(status(admission, bearer(tokens.at(Scope::kRead)), Access::kAdmin), 403);
  EXPECT_EQ(last->code, "insufficient-scope");
  EXPECT_THAT(last->challenge, HasSubstr("error=\"insufficient_scope\", scope=\"admin\""));
}

TEST_F(AdmissionTest, TwoTokensAtOnceAreATryToo) {
  Admission admission(config, table);
  const std::string token = add("a", Scope::kAdmin);
  Headers headers = bearer(token);
  headers.add("Authorization", "Bearer " + token);
  EXPECT_EQ(status(admission, headers, Access::kRead), 400);
  EXPECT_EQ(status(admission, headers, Access::kRead), 400);
  EXPECT_EQ(status(admission, headers, Access::kRead), 429);
  EXPECT_EQ(status(admission, bearer(*new_token()), Access::kRead), 429) << "of one count with wrong ones";
  EXPECT_EQ(status(admission, bearer(token), Access::kRead), 200);
}

TEST_F(AdmissionTest, WhatIsNoTokenIsRefusedWithAChallenge) {
  config.failed_tokens_per_min = 0.0;
  config.requests = {};
  Admission admission(config, table);
  const std::string token = add("a", Scope::kAdmin);
  EXPECT_EQ(status(admission, {}, Access::kRead), 401);
  EXPECT_EQ(last->challenge, "Bearer realm=\"colony\"") << "RFC 6750, 3.1: no error code where no token was given";
  EXPECT_EQ(status(admission, {}, Access::kOpen), 200);
  EXPECT_EQ(who.name, "anonymous");
  Headers headers;
  for (const std::string& value : {std::string(), std::string("Bearer"), std::string("Bearer "), "Basic " + token, "Bearer" + token,
                                   "Bearer " + token + " x", "Bearer x" + token, "Bearer " + token.substr(0, 70), token,
                                   "Bearer " + *new_token()}) {
    headers.set("Authorization", value);
    EXPECT_EQ(status(admission, headers, Access::kRead), 401) << value.substr(0, 10);
    EXPECT_THAT(last->challenge, HasSubstr("error=\"invalid_token\""));
    EXPECT_THAT(last->challenge + last->detail, ::testing::Not(HasSubstr("colony_")));
  }
  headers.set("Authorization", "bEARER  " + token);
  EXPECT_EQ(status(admission, headers, Access::kAdmin), 200) << "the scheme knows no case (RFC 9110, 11.1)";
  headers.add("Authorization", "Bearer " + token);
  EXPECT_EQ(status(admission, headers, Access::kAdmin), 400);
}

TEST_F(AdmissionTest, AnExpiredOrRemovedTokenIsWorthNothing) {
  Admission admission(config, table);
  const std::string token = add("a", Scope::kAdmin);
  EXPECT_EQ(status(admission, bearer(token), Access::kRead, 999), 200);
  EXPECT_EQ(status(admission, bearer(token), Access::kRead, 1000), 401);
  EXPECT_THAT(last->detail, HasSubstr("expired"));
  const std::string other = add("b", Scope::kAdmin);
  EXPECT_EQ(status(admission, bearer(other), Access::kRead), 200);
  table.remove("id-b");
  EXPECT_EQ(status(admission, bearer(other), Access::kRead), 401);
  EXPECT_EQ(table.count_alive(Scope::kRead, kNow_unix_ms), 1u);
  EXPECT_EQ(table.count_alive(Scope::kRead, kNow_unix_ms + 1000), 0u);
}

TEST_F(AdmissionTest, EachTokenHasItsRateWhereverItComesFrom) {
  Admission admission(config, table);
  const std::string one = add("one", Scope::kRead, kNow_unix_ms + 1'000'000);
  const std::string two = add("two", Scope::kRead, kNow_unix_ms + 1'000'000);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(status(admission, bearer(one), Access::kRead), 200);
  client = *client_address("192.0.2.2");
  EXPECT_EQ(status(admission, bearer(one), Access::kRead), 429);
  EXPECT_EQ(last->retry_after_s, 1);
  EXPECT_EQ(status(admission, bearer(two), Access::kRead), 200);
  EXPECT_EQ(status(admission, bearer(one), Access::kRead, 100), 200);
}

TEST_F(AdmissionTest, WithoutATokenTheAddressIsCountedButNotThisMachine) {
  Admission admission(config, table);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(status(admission, {}, Access::kOpen), 200);
  EXPECT_EQ(status(admission, {}, Access::kOpen), 429);
  EXPECT_EQ(status(admission, {}, Access::kRead), 429) << "also for being told that a token is needed";
  client = *client_address("127.0.0.1");
  for (int i = 0; i < 50; ++i) EXPECT_EQ(status(admission, {}, Access::kOpen), 200);
  config.limits_loopback = true;
  Admission strict(config, table);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(status(strict, {}, Access::kOpen), 200);
  EXPECT_EQ(status(strict, {}, Access::kOpen), 429);
}

TEST_F(AdmissionTest, WrongTokensAreLimitedByAddressAndRightOnesNeverLockedOut) {
  Admission admission(config, table);
  const std::string token = add("a", Scope::kRead, kNow_unix_ms + 1'000'000);
  EXPECT_EQ(status(admission, bearer(*new_token()), Access::kRead), 401);
  EXPECT_EQ(status(admission, bearer(*new_token()), Access::kRead), 401);
  EXPECT_EQ(status(admission, bearer(*new_token()), Access::kRead), 429);
  EXPECT_EQ(last->retry_after_s, 30);
  EXPECT_EQ(status(admission, bearer(token), Access::kRead), 200);
  client = *client_address("192.0.2.2");
  EXPECT_EQ(status(admission, bearer(*new_token()), Access::kRead), 401);
  client = *client_address("192.0.2.1");
  EXPECT_EQ(status(admission, bearer(*new_token()), Access::kRead, 30'000), 401);
}

class Ticking : public BodySource {
 public:
  explicit Ticking(std::string farewell) : farewell_(std::move(farewell)) {}
  Pull pull(std::string& out) override {
    out += "tick";
    return Pull::kWait;
  }
  std::string_view farewell() const override { return farewell_; }

 private:
  const std::string farewell_;
};

TEST(GuardedSource, EndsWithItsToken) {
  TokenTable table;
  table.add({"id", "a", Scope::kRead, {}, unix_time_ms() + 3'600'000});
  const Principal principal{"a", Scope::kRead, "id"};
  auto stream = guarded(std::make_unique<Ticking>("bye"), table, principal);
  auto download = guarded(std::make_unique<Ticking>(""), table, principal);
  int wakes = 0;
  stream->on_ready([&wakes] { ++wakes; });
  std::string out;
  EXPECT_EQ(stream->pull(out), BodySource::Pull::kWait);
  EXPECT_LE(*stream->wake_after(), std::chrono::hours(1));
  EXPECT_GT(*stream->wake_after(), std::chrono::minutes(59)) << "it wakes by itself when the token expires";
  table.remove("another");
  EXPECT_EQ(wakes, 0);
  table.remove("id");
  EXPECT_EQ(wakes, 1) << "a stream that waits must hear of it";
  out.clear();
  EXPECT_EQ(stream->pull(out), BodySource::Pull::kEnd);
  EXPECT_EQ(out, "bye");
  EXPECT_THROW(download->pull(out), std::runtime_error) << "cut, not ended";
  auto free = guarded(std::make_unique<Ticking>(""), table, Principal{});
  EXPECT_EQ(free->pull(out), BodySource::Pull::kWait) << "no token was needed";
}

TEST(GuardedSource, AWatchThatIsGoneIsNotWoken) {
  TokenTable table;
  table.add({"id", "a", Scope::kRead, {}, unix_time_ms() + 3'600'000});
  int wakes = 0;
  auto watch = table.watch("id", [&wakes] { ++wakes; });
  watch.reset();
  table.remove("id");
  EXPECT_EQ(wakes, 0);
}

}  // namespace
}  // namespace colony::server::http
