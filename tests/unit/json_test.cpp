// Strict JSON: one reading of every text, or an error with its place.
#include "server/api/json.hpp"

#include <cstddef>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace colony::server::api {
namespace {

using ::testing::HasSubstr;

struct Malformed {
  std::string text;
  std::string says;
  std::string pointer = "-";
};

TEST(StrictJson, RefusesEveryOtherReadingWithTheByteOffset) {
  const std::vector<Malformed> cases = {
      {"", "offset 0"},
      {"{", "offset"},
      {R"({"a": })", "offset 6"},
      {R"({"a": 1} x)", "offset"},
      {R"({"a": NaN})", "offset 6"},
      {R"({"a": Infinity})", "offset 6"},
      {R"({"a": 1e999})", "overflow"},
      {R"({"a": -1e999})", "overflow"},
      {R"({"a": 01})", "offset"},
      {"[1, /* c */ 2]", "offset"},
      {"\xEF\xBB\xBF{}", "byte order mark"},
      {"{\"\xff\": 1}", "offset"},
      {"\"\xC0\x80\"", "offset"},
      {"\"\xED\xA0\x80\"", "offset"},
      {R"(["\ud800"])", "offset"},
      {R"({"a": 1, "a": 2})", "offset 12: the member name is used twice", "/a"},
      {R"({"b": [{"a": 1, "a": 2}]})", "twice", "/b/0/a"},
      {R"({"a": "x\u0000y"})", "U+0000", "/a"},
      {R"({"a\u0000": 1})", "U+0000"},
      {std::string("{}\0", 3), "offset 2: a zero byte"},
      {std::string("{}\0 not looked at", 17), "offset 2: a zero byte"},
      {std::string("{\"a\": \0}", 8), "offset 6: a zero byte"},
  };
  for (const Malformed& one : cases) {
    const auto result = parse_json(one.text);
    ASSERT_FALSE(result) << one.text;
    EXPECT_EQ(result.error().code, ErrorCode::kMalformed) << one.text;
    EXPECT_THAT(result.error().message, HasSubstr("malformed JSON at byte offset")) << one.text;
    EXPECT_THAT(result.error().message, HasSubstr(one.says)) << one.text;
    if (one.pointer != "-") {
      ASSERT_EQ(result.error().fields.size(), 1u) << one.text;
      EXPECT_EQ(result.error().fields[0].pointer, one.pointer);
    }
  }
}

TEST(StrictJson, BoundsDepthAndMembers) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_TRUE(parse_json(nested(kJsonDepthMax)));
  EXPECT_FALSE(parse_json(nested(kJsonDepthMax + 1)));
  EXPECT_FALSE(parse_json(std::string(200'000, '[')));
  std::string many = "{";
  for (std::size_t i = 0; i <= kJsonMembersMax; ++i) many += (i ? ",\"" : "\"") + std::to_string(i) + "\":1";
  EXPECT_FALSE(parse_json(many + "}"));
}

TEST(StrictJson, KeepsValuesAndOrder) {
  const auto json = parse_json(R"( {"z": [1, -2, 3.5, true, null, "ü\n"], "a": {"b": {}}, "m": -0.0} )");
  ASSERT_TRUE(json);
  EXPECT_EQ(to_text(*json), R"({"z":[1,-2,3.5,true,null,"ü\n"],"a":{"b":{}},"m":0.0})");
}

TEST(StrictJson, IntegersAreIntegralNumbersWithin64Bits) {
  EXPECT_EQ(integer_of(*parse_json("12")), 12);
  EXPECT_EQ(integer_of(*parse_json("12.0")), 12);
  EXPECT_EQ(integer_of(*parse_json("1.2e1")), 12);
  EXPECT_EQ(integer_of(*parse_json("12.5")), std::nullopt);
  EXPECT_EQ(integer_of(*parse_json("99999999999999999999999")), std::nullopt);
  EXPECT_EQ(integer_of(*parse_json("18446744073709551615")), std::nullopt);
  EXPECT_EQ(integer_of(*parse_json("\"12\"")), std::nullopt);
}

}  // namespace
}  // namespace colony::server::api
