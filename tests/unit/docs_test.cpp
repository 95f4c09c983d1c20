// The page to read: it says what openapi.json says, and nothing in it can run, load or break out.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/api/docs.hpp"
#include "server/api/openapi.hpp"
#include "tests/unit/api_support.hpp"

namespace colony::server::testing {
namespace {

using api::Json;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Docs, TellEveryOperationAndSchema) {
  api::ApiConfig config = ApiFixture::config();
  config.base_path = "/colony";
  ApiFixture fixture(config);
  auto response = fixture.get("/docs");
  EXPECT_EQ(header(response, "Content-Type"), "text/html; charset=utf-8");
  EXPECT_THAT(header(response, "Content-Security-Policy"), HasSubstr("default-src 'none'"));
  const std::string page = response.body;
  for (const api::Endpoint& endpoint : api::endpoints()) {
    EXPECT_THAT(page, HasSubstr("<article id=\"" + std::string(endpoint.operation_id) + "\">"));
    EXPECT_THAT(page, HasSubstr("<a href=\"#" + std::string(endpoint.operation_id) + "\">"));
    for (const api::QueryParam& param : endpoint.query) EXPECT_THAT(page, HasSubstr("<code>" + std::string(param.name) + "</code>"));
  }
  auto document = fixture.get("/openapi.json");
  const Json openapi = json_of(document);
  for (const auto& [name, schema] : openapi["components"]["schemas"].items())
    EXPECT_THAT(page, HasSubstr("<article id=\"schema-" + name + "\">"));
  EXPECT_THAT(page, HasSubstr("href=\"/colony/docs.css\""));
}

TEST(Docs, ShowTheAddressTheyWereAskedAt) {
  api::ApiConfig config = ApiFixture::config();
  config.base_path = "/colony";
  config.is_behind_proxy = true;
  ApiFixture fixture(config);
  const auto base = [&](std::vector<std::pair<std::string, std::string>> headers) {
    const std::string page = fixture.get("/docs", std::move(headers)).body;
    EXPECT_THAT(page, Not(HasSubstr(std::string(api::kDocsAddress))));
    const std::size_t at = page.find("BASE=&#39;") == std::string::npos ? page.find("BASE='") : page.find("BASE=&#39;");
    return page.substr(at, page.find('\n', at) - at);
  };
  EXPECT_EQ(base({}), "BASE='http://127.0.0.1:8080/colony'");
  EXPECT_EQ(base({{"Host", "lab.example:444"}}), "BASE='http://lab.example:444/colony'");
  EXPECT_EQ(base({{"Host", "lab.example"}, {"X-Forwarded-Proto", "https"}}), "BASE='https://lab.example/colony'");
  EXPECT_EQ(base({{"Host", "'<a>"}}), "BASE='http://&#39;&lt;a&gt;/colony'");
  EXPECT_THAT(fixture.get("/docs").body, HasSubstr("curl &quot;$BASE/v1/jobs&quot;"));
}

TEST(Docs, SendATokenWhereOneIsNeeded) {
  api::ApiConfig config = ApiFixture::config();
  EXPECT_THAT(ApiFixture(config).get("/docs").body, Not(HasSubstr("Bearer $TOKEN")));
  config.tokens_required = true;
  ApiFixture fixture(config);
  const std::string page = fixture.get("/docs").body;
  for (const api::Endpoint& endpoint : api::endpoints()) {
    const std::size_t article = page.find("<article id=\"" + std::string(endpoint.operation_id) + "\">");
    const std::string example = page.substr(page.find("<h4>Example</h4>", article), 200);
    const bool is_open = api::access_of(endpoint) == http::Access::kOpen;
    EXPECT_EQ(example.find("Authorization: Bearer $TOKEN") == std::string::npos, is_open) << endpoint.operation_id;
  }
}

// Who finds out by trying that EventSource sends no token has lost an afternoon.
TEST(Docs, SayHowAStreamIsReadWithAToken) {
  ApiFixture fixture;
  auto document = fixture.get("/openapi.json");
  const Json openapi = json_of(document);
  for (const char* path : {"/v1/stream", "/v1/jobs/{job_id}/events"}) {
    const std::string text = openapi["paths"][path]["get"]["description"];
    EXPECT_THAT(text, HasSubstr("`EventSource`"));
    EXPECT_THAT(text, HasSubstr("`fetch`"));
  }
  EXPECT_THAT(fixture.get("/docs").body, HasSubstr("async function readStream("));
}

TEST(Docs, RunAndLoadNothing) {
  ApiFixture fixture;
  for (const char* path : {"/docs", "/docs.css"}) {
    auto response = fixture.get(path);
    for (const char* danger : {"<script", "javascript:", "style=", "<img", "@import", "url(", "onclick", "<iframe", "//cdn"})
      EXPECT_THAT(response.body, Not(HasSubstr(danger))) << path;
  }
  // Every link within the page has its place.
  const std::string page = fixture.get("/docs").body;
  for (std::size_t at = page.find("href=\"#"); at != std::string::npos; at = page.find("href=\"#", at + 1)) {
    const std::string target = page.substr(at + 7, page.find('"', at + 7) - at - 7);
    EXPECT_THAT(page, HasSubstr("id=\"" + target + "\""));
  }
}

TEST(Docs, EscapeEveryText) {
  const std::string evil = "<script>alert('\"&\")</script>";
  Json openapi = {{"info", {{"title", evil}, {"version", evil}, {"summary", evil}, {"description", evil}}},
                  {"servers", Json::array({{{"url", "/" + evil}}})},
                  {"tags", Json::array({{{"name", evil}, {"description", evil}}})},
                  {"paths",
                   {{"/" + evil,
                     {{"get",
                       {{"operationId", evil},
                        {"tags", Json::array({evil})},
                        {"summary", evil},
                        {"parameters", Json::array({{{"name", evil}, {"in", evil}, {"description", evil}, {"schema", {{"enum", Json::array({evil})}}}}})},
                        {"responses",
                         {{"200", {{"description", evil}, {"content", {{evil, {{"schema", {{"const", evil}}}}}}}, {"headers", {{evil, {{"description", evil}}}}}}},
                          {"404", {{"description", evil}}}}}}}}}}},
                  {"components", {{"schemas", {{evil, {{"properties", {{evil, {{"type", evil}, {"description", evil}}}}}}}}}}}};
  const std::string page = api::docs_page(openapi, "/" + evil, true);
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(&#39;&quot;&amp;&quot;)&lt;/script&gt;"));
}

}  // namespace
}  // namespace colony::server::testing
