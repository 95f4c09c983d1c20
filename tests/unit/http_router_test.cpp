// server/http: which handler a request gets, what is answered where there is none, and what the log hears of failures.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/http/router.hpp"

namespace colony::server::http {
namespace {

Response dispatch(const Router& router, std::string method, std::string path) {
  Request request;
  request.method = std::move(method);
  request.path = std::move(path);
  request.request_id = "id-1";
  return router.dispatch(request);
}

TEST(HttpRouter, OptionsOfTheServerNameWhatThereIsAnywhere) {
  Router router;
  const auto nothing = [](const Request&) { return Response(); };
  router.add("GET", "/", nothing);
  router.add("GET", "/a", nothing);
  router.add("DELETE", "/a/{}", nothing);
  router.advertise("/", "Accept-Post", "x");
  const Response server = dispatch(router, "OPTIONS", "*");
  EXPECT_EQ(server.status, 204);
  EXPECT_EQ(server.headers.get("Allow"), "GET, HEAD, DELETE, OPTIONS");
  EXPECT_EQ(server.headers.count("Accept-Post"), 0u) << "that is of the root alone";
  EXPECT_EQ(dispatch(router, "OPTIONS", "/").headers.get("Allow"), "GET, HEAD, OPTIONS");
  EXPECT_EQ(dispatch(router, "OPTIONS", "/nowhere").status, 404);
}

TEST(HttpRouter, AnAnswered500IsReportedWithItsReason) {
  Router router;
  std::vector<std::string> heard;
  router.on_failure([&heard](const Request& request, std::string_view what) { heard.push_back(request.request_id + " " + std::string(what)); });
  const auto answers = [](int status, std::string failure) {
    return [status, failure](const Request&) {
      Response response;
      response.status = status;
      response.failure = failure;
      return response;
    };
  };
  router.add("GET", "/why", answers(500, "event 7 is not there"));
  router.add("GET", "/mute", answers(500, ""));
  router.add("GET", "/busy", answers(503, "not a bug"));
  for (const char* path : {"/why", "/mute", "/busy"}) dispatch(router, "GET", path);
  router.set_ready("GET", "/busy", [&](const Request& request) { return std::make_optional(answers(500, "at once")(request)); });
  Request request;
  request.method = "GET";
  request.path = "/busy";
  request.request_id = "id-2";
  router.dispatch_ready(request);
  EXPECT_EQ(heard, (std::vector<std::string>{"id-1 event 7 is not there", "id-1 a handler answered 500 and did not say why", "id-2 at once"}));
}

TEST(HttpRouter, PatternBeforeMethodLiteralBeforeCapture) {
  Router router;
  const auto named = [](std::string name) {
    return [name](const Request& request) {
      Response response;
      response.body = name;
      for (const auto& param : request.path_params) response.body += ":" + param;
      return response;
    };
  };
  router.add("GET", "/v1/jobs/{}", named("job"));
  router.add("DELETE", "/v1/jobs/{}", named("delete"));
  router.add("GET", "/v1/jobs/counts", named("counts"));
  router.add("GET", "/v1/{}/{}", named("any"));
  router.add("GET", "/", named("root"));
  EXPECT_EQ(dispatch(router, "GET", "/v1/jobs/counts").body, "counts");
  EXPECT_EQ(dispatch(router, "GET", "/v1/jobs/a b").body, "job:a b");
  EXPECT_EQ(dispatch(router, "HEAD", "/v1/jobs/a").body, "job:a");
  EXPECT_EQ(dispatch(router, "GET", "/v1/x/y").body, "any:x:y");
  EXPECT_EQ(dispatch(router, "GET", "/").body, "root");
  const auto wrong_method = dispatch(router, "DELETE", "/v1/jobs/counts");
  EXPECT_EQ(wrong_method.status, 405);
  EXPECT_EQ(wrong_method.headers.get("allow"), "GET, HEAD, OPTIONS");
  const auto options = dispatch(router, "OPTIONS", "/v1/jobs/a");
  EXPECT_EQ(options.status, 204);
  EXPECT_EQ(options.headers.get("Allow"), "GET, HEAD, DELETE, OPTIONS");
  for (const char* path : {"/v1/jobs", "/v1/jobs/", "/v1/jobs/a/b", "//", "/v1//", "/V1/jobs/a"}) {
    const auto missing = dispatch(router, "GET", path);
    EXPECT_EQ(missing.status, 404) << path;
    EXPECT_NE(missing.body.find(path), std::string::npos) << "the problem names the path";
  }
  EXPECT_ANY_THROW(router.add("GET", "/", named("twice")));
}

TEST(HttpRouter, AnExceptionIsToldToTheLogAndNotToTheClient) {
  Router router;
  router.add("GET", "/", [](const Request&) -> Response { throw std::runtime_error("secret detail"); });
  std::string heard;
  router.on_failure(
      [&](const Request& request, std::string_view what) { heard = request.request_id + " " + std::string(what); });
  const auto response = dispatch(router, "GET", "/");
  EXPECT_EQ(response.status, 500);
  EXPECT_EQ(response.body.find("secret"), std::string::npos);
  EXPECT_NE(response.body.find("\"request_id\":\"id-1\""), std::string::npos);
  EXPECT_EQ(heard, "id-1 secret detail");
}

}  // namespace
}  // namespace colony::server::http
