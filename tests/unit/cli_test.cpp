// The command line as its user meets it: arguments in; output, messages and exit code out, against a server that
// misbehaves on demand.
#include <atomic>
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
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

/// A port where nobody listens any more.
std::string closed_server() {
  const FakeServer gone([](const FakeRequest&, const FakeConnection&) {});
  return gone.url();
}

TEST_F(Cli, UsageErrorsAreTwo) {
  EXPECT_EQ(run({}), 2);
  EXPECT_EQ(run({"grow"}), 2);
  EXPECT_EQ(run({"show"}), 2);
  EXPECT_THAT(err(), StartsWith("error: ID is required"));
  EXPECT_EQ(run({"submit"}), 2);
  EXPECT_THAT(err(), HasSubstr("nothing to submit"));
  EXPECT_EQ(run({"submit", "--seed", "1.5"}), 2);
  EXPECT_THAT(err(), HasSubstr("--seed: '1.5' is not an integer"));
  EXPECT_EQ(run({"submit", path("absent.json")}), 2);
  EXPECT_THAT(err(), HasSubstr("absent.json: No such file"));
  EXPECT_EQ(run({"--server", "127.0.0.1:1", "list"}), 2);
  EXPECT_THAT(err(), HasSubstr("--server: '127.0.0.1:1' has no scheme"));
  EXPECT_EQ(run({"--server", "ftp://h", "list"}), 2);
  EXPECT_EQ(run({"--help"}), 0);
  EXPECT_THAT(out(), HasSubstr("submit"));
}

TEST_F(Cli, SettingsRiseFromFileToEnvironmentToFlag) {
  FakeServer server([](const FakeRequest&, const FakeConnection& to) { to.send(json_answer(200, R"({"queued":1})")); });
  write_file(".config/colony/config.toml", "server = \"" + server.url() + "/base/\"\ntoken = \"from-file\"\n");
  EXPECT_EQ(run({"counts", "--json"}), 0);
  EXPECT_EQ(out(), "{\"queued\":1}\n");
  variables_["COLONY_TOKEN"] = "from-variable";
  variables_["COLONY_SERVER"] = closed_server();
  EXPECT_EQ(run({"counts"}), 3);
  EXPECT_EQ(run({"counts", "--server", server.url()}), 0);
  EXPECT_EQ(out(), "queued: 1\n");
  const auto requests = server.requests();
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].line(), "GET /base/v1/jobs/counts HTTP/1.1");
  EXPECT_EQ(requests[0].header("Authorization"), "Bearer from-file");
  EXPECT_EQ(requests[1].header("Authorization"), "Bearer from-variable");
  write_file(".config/colony/config.toml", "servr = \"x\"\n");
  EXPECT_EQ(run({"counts"}), 2);
  EXPECT_THAT(err(), HasSubstr("config.toml: servr: unknown key"));
}

TEST_F(Cli, ATokenGoesNowhereInTheClear) {
  variables_["COLONY_TOKEN"] = "secret-token";
  for (const char* server : {"http://lab.example", "http://localhost.evil.example", "http://127.0.0.1.evil.example:80",
                             "http://10.0.0.1:8080/x"}) {
    EXPECT_EQ(run({"counts", "--server", server}), 2) << server;
    EXPECT_THAT(err(), HasSubstr("in the clear"));
    EXPECT_THAT(err() + out(), ::testing::Not(HasSubstr("secret-token")));
  }
  EXPECT_EQ(run({"counts", "--server", closed_server()}), 3) << "this machine is asked";
  EXPECT_EQ(run({"counts", "--server", "https://127.0.0.1:1", "--ca-file", "/no/such/file"}), 2);
  EXPECT_THAT(err(), HasSubstr("--ca-file"));
  write_file(".config/colony/config.toml", "ca_file = 1\n");
  EXPECT_EQ(run({"counts"}), 2);
}

TEST_F(Cli, ProblemsNameTheField) {
  FakeServer server([](const FakeRequest&, const FakeConnection& to) {
    to.send(json_answer(
        422, R"({"type":"urn:colony:problem:invalid","title":"The spec is wrong","status":422,"detail":"2 errors",
      "request_id":"r-9","errors":[{"pointer":"/model/cycle/mean_h","message":"must be within 3 to 200"},
      {"parameter":"at_h\u001b[2J","message":"is not a number"},{"pointer":"","message":"no bound"}]})"));
  });
  use(server);
  EXPECT_EQ(run({"submit", "--preset", "paper"}), 4);
  EXPECT_EQ(err(),
            "error: The spec is wrong: 2 errors\n  /model/cycle/mean_h: must be within 3 to 200\n  at_h?[2J: is not a "
            "number\n"
            "  (whole document): no bound\n  request id: r-9\n");
  EXPECT_EQ(out(), "");
  EXPECT_EQ(server.requests().size(), 1u);  // a refusal is not asked again
}

TEST_F(Cli, AnAnswerThatIsNoProblemIsQuoted) {
  FakeServer server(
      [](const FakeRequest&, const FakeConnection& to) { to.send(test::answer(502, "text/html", "<b>proxy</b>")); });
  use(server);
  EXPECT_EQ(run({"info"}), 4);
  EXPECT_EQ(err(), "error: HTTP 502 from the server: <b>proxy</b>\n");
}

TEST_F(Cli, RedirectsAreNotFollowed) {
  FakeServer server([](const FakeRequest&, const FakeConnection& to) {
    to.send(test::answer(302, "text/plain", "", "Location: http://127.0.0.1:1/\r\n"));
  });
  use(server);
  EXPECT_EQ(run({"info"}), 4);
  EXPECT_EQ(server.requests().size(), 1u);
}

TEST_F(Cli, SubmitMergesFileAndFlags) {
  FakeServer server(
      [](const FakeRequest&, const FakeConnection& to) { to.send(json_answer(201, job_json("queued"))); });
  use(server);
  in_ = R"({"seed": 3, "until": {"cells": 5}})";
  EXPECT_EQ(run({"submit", "-", "--seed", "-1", "--until-time", "42.5", "--label", "plate=7", "--set",
                 "model.cell.pair_volume_um3=[800,3600]", "--set", "model.cycle.mean_h=10"}),
            0);
  EXPECT_EQ(out(), "submitted: " + kId + " (queued)\n");
  const FakeRequest request = server.requests().at(0);
  EXPECT_EQ(request.line(), "POST /v1/jobs HTTP/1.1");
  EXPECT_EQ(request.header("Content-Type"), "application/json");
  EXPECT_EQ(request.body, R"({"seed":-1,"until":{"cells":5,"time_h":42.5},"labels":{"plate":"7"},)"
                          R"("model":{"cell":{"pair_volume_um3":[800,3600]},"cycle":{"mean_h":10}}})");
  in_ = "{ \"seed\": 1, \"seed\": 1 }";  // without flags: byte for byte, so that the server finds the mistake
  EXPECT_EQ(run({"submit", "-", "-q"}), 0);
  EXPECT_EQ(out(), kId + "\n");
  EXPECT_EQ(server.requests().at(1).body, in_);
  EXPECT_EQ(run({"submit", "-", "--name", "x"}), 2);
  EXPECT_THAT(err(), HasSubstr("standard input"));
}

TEST_F(Cli, SubmitKeepsItsKeyWhenItTriesAgain) {
  std::atomic<int> count{0};
  FakeServer server([&](const FakeRequest&, const FakeConnection& to) {
    const int index = count++;
    if (index == 0) return;  // closed without a word
    if (index == 1) return to.send(json_answer(503, R"({"title":"Busy"})", "Retry-After: 0\r\n"));
    to.send(json_answer(200, job_json("queued")));
  });
  use(server);
  EXPECT_EQ(run({"submit", "--preset", "paper"}), 0);
  EXPECT_EQ(out(), "submitted before: " + kId + " (queued)\n");
  EXPECT_THAT(err(), HasSubstr("trying again"));
  const auto requests = server.requests();
  ASSERT_EQ(requests.size(), 3u);
  EXPECT_THAT(requests[0].header("Idempotency-Key"), StartsWith("colony-"));
  EXPECT_EQ(requests[1].header("Idempotency-Key"), requests[0].header("Idempotency-Key"));
  EXPECT_EQ(requests[2].header("Idempotency-Key"), requests[0].header("Idempotency-Key"));
  EXPECT_EQ(run({"submit", "--preset", "paper"}), 0);
  EXPECT_NE(server.requests().at(3).header("Idempotency-Key"), requests[0].header("Idempotency-Key"));
}

TEST_F(Cli, SubmitGivesUpAfterItsAttempts) {
  variables_["COLONY_SERVER"] = closed_server();
  EXPECT_EQ(run({"submit", "--preset", "paper", "--idempotency-key", "k1"}), 3);
  EXPECT_THAT(err(), HasSubstr("(3 of 3)"));
  EXPECT_THAT(err(), HasSubstr("--idempotency-key k1 cannot make a second one"));
  FakeServer server([](const FakeRequest&, const FakeConnection& to) {
    to.send(json_answer(503, R"({"title":"Draining"})", "Retry-After: 3600\r\n"));
  });
  use(server);
  EXPECT_EQ(run({"submit", "--preset", "paper"}), 4);
  EXPECT_EQ(err(), "error: Draining\n  try again in 3600 s\n");  // an hour is not waited for
  EXPECT_EQ(server.requests().size(), 1u);
}

TEST_F(Cli, DryRunStoresNothingAndPrintsTheSpec) {
  FakeServer server(
      [](const FakeRequest&, const FakeConnection& to) { to.send(json_answer(200, R"({"spec":{"range":[1,2]}})")); });
  use(server);
  EXPECT_EQ(run({"submit", "--preset", "paper", "--dry-run"}), 0);
  EXPECT_EQ(out(), "{\n  \"spec\": {\n    \"range\": [1, 2]\n  }\n}\n");
  EXPECT_EQ(server.requests().at(0).line(), "POST /v1/jobs?dry_run=true HTTP/1.1");
}

TEST_F(Cli, SuffixesAreResolvedThroughAllPages) {
  FakeServer server([](const FakeRequest& request, const FakeConnection& to) {
    const std::string first = "0190aaaa-bbbb-7ccc-8ddd-00000000ffff", last = "0190aaaa-bbbb-7ccc-8ddd-0000aaaaffff";
    if (request.line().find("cursor=c%2B1") != std::string::npos) {
      return to.send(json_answer(
          200, R"({"items":[)" + job_json("queued") + "," + job_json("queued", last) + R"(],"next":null})"));
    }
    if (request.line().find("GET /v1/jobs?") == 0) {
      return to.send(json_answer(200, R"({"items":[)" + job_json("queued", first) + R"(],"next":"c+1"})"));
    }
    to.send(json_answer(200, job_json("succeeded")));
  });
  use(server);
  EXPECT_EQ(run({"show", "1234"}), 0);
  EXPECT_THAT(out(), HasSubstr("state: succeeded\n"));
  EXPECT_THAT(out(), HasSubstr("progress.cells: 180\n"));
  EXPECT_EQ(server.requests().back().line(), "GET /v1/jobs/" + kId + " HTTP/1.1");
  EXPECT_EQ(run({"show", "FFFF"}), 2);
  EXPECT_THAT(err(), HasSubstr("'FFFF' is the end of 2 job ids"));
  EXPECT_EQ(run({"show", "eeee"}), 4);
  EXPECT_THAT(err(), HasSubstr("no job's id ends in 'eeee'"));
  EXPECT_EQ(run({"show", "234"}), 2);
  EXPECT_EQ(run({"show", "../../x"}), 2);
  EXPECT_THAT(err(), HasSubstr("is no job id"));
  const std::size_t before = server.requests().size();
  EXPECT_EQ(run({"show", kId}), 0);
  EXPECT_EQ(server.requests().size(), before + 1);  // a full id is not looked up
}

TEST_F(Cli, CommandsSayWhetherAnythingChanged) {
  std::atomic<int> status{202};
  FakeServer server(
      [&](const FakeRequest&, const FakeConnection& to) { to.send(json_answer(status, job_json("cancelled"))); });
  use(server);
  EXPECT_EQ(run({"cancel", kId}), 0);
  EXPECT_EQ(out(), kId + ": cancelled (cells)\n");
  EXPECT_EQ(server.requests().at(0).header("Content-Type"), "application/json");
  status = 200;
  EXPECT_EQ(run({"pause", kId}), 0);
  EXPECT_EQ(out(), kId + ": already cancelled (cells)\n");
  status = 409;
  EXPECT_EQ(run({"resume", kId}), 4);
  EXPECT_EQ(run({"delete", kId}), 4);
  EXPECT_EQ(server.requests().back().line(), "DELETE /v1/jobs/" + kId + " HTTP/1.1");
}

const std::string kLines =
    "{\"seq\":1,\"time_h\":0.0,\"kind\":\"founded\",\"cell_id\":1,\"cell\":{\"x_um\":0.5,\"y_um\":-1.0}}\n"
    "{\"seq\":2,\"time_h\":11.25,\"kind\":\"divided\",\"cell_id\":1,\"fitness\":0.987654,"
    "\"cells\":[{},{\"cell_id\":2,\"x_um\":3.0,\"y_um\":4.0}]}\n";

TEST_F(Cli, EventsInEveryForm) {
  FakeServer server(
      [](const FakeRequest&, const FakeConnection& to) { to.send(test::answer(200, "application/x-ndjson", kLines)); });
  use(server);
  EXPECT_EQ(run({"events", kId, "--kind", "founded,divided", "--after", "0"}), 0);
  EXPECT_THAT(out(), HasSubstr("11.250  divided          1  daughter 2 at (3.0, 4.0) um  fitness 0.988\n"));
  EXPECT_EQ(server.requests().at(0).line(), "GET /v1/jobs/" + kId + "/events?after=0&kind=founded%2Cdivided HTTP/1.1");
  EXPECT_EQ(run({"events", kId, "--ndjson", "-o", path("e.ndjson")}), 0);
  EXPECT_EQ(read_file("e.ndjson"), kLines);
  EXPECT_EQ(run({"events", kId, "--json"}), 0);
  EXPECT_EQ(nlohmann::json::parse(out())["items"].size(), 2u);
  EXPECT_EQ(run({"events", kId, "--csv"}), 0);
  EXPECT_EQ(server.requests().back().header("Accept"), "text/csv");
  EXPECT_EQ(run({"events", kId, "--csv", "--ndjson"}), 2);
}

TEST_F(Cli, AFileIsWholeOrNotThere) {
  std::atomic<int> mode{0};
  FakeServer server([&](const FakeRequest&, const FakeConnection& to) {
    if (mode == 0) to.send("HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\n" + kLines);  // cut
    if (mode == 1) to.send(json_answer(409, R"({"title":"Not reached"})"));
    if (mode == 2) to.send(test::answer(200, "image/png", std::string("\x89PNG\0x", 6)));
  });
  use(server);
  write_file("e.csv", "old");
  EXPECT_EQ(run({"events", kId, "--csv", "-o", path("e.csv")}), 3);
  EXPECT_THAT(err(), HasSubstr("lost after"));
  EXPECT_EQ(read_file("e.csv"), "old");
  mode = 1;
  EXPECT_EQ(run({"image", kId, "-o", path("c.png"), "--at-h", "1e9"}), 4);
  EXPECT_EQ(file_count(), 1u);
  mode = 2;
  EXPECT_EQ(run({"image", kId, "-o", path("c.png"), "--at-h", "110.5", "--style", "contours", "--no-scale-bar"}), 0);
  EXPECT_EQ(read_file("c.png"), std::string("\x89PNG\0x", 6));
  EXPECT_EQ(file_count(), 2u);
  EXPECT_EQ(server.requests().back().line(),
            "GET /v1/jobs/" + kId + "/image?at_h=110.5&style=contours&scale_bar=false HTTP/1.1");
  EXPECT_EQ(run({"image", kId, "-o", path("absent/c.png")}), 2);
  EXPECT_THAT(err(), HasSubstr("cannot create a file there"));
}

TEST_F(Cli, SeriesForPeople) {
  FakeServer server([](const FakeRequest&, const FakeConnection& to) {
    to.send(
        json_answer(200, R"({"items":[{"time_h":0.0,"cell_count":1},{"time_h":50.0,"cell_count":14}],"next":null})"));
  });
  use(server);
  EXPECT_EQ(run({"series", kId}), 0);
  EXPECT_THAT(out(), StartsWith("TIME_H  CELLS"));
  EXPECT_THAT(out(), HasSubstr("  50.0     14"));
  EXPECT_THAT(out(), HasSubstr("cells  .#  to 14\n"));
}

TEST_F(Cli, AnUnknownCommandIsNamed) {
  EXPECT_EQ(run({"--server", "http://127.0.0.1:1", "bogus"}), 2);
  EXPECT_THAT(err(), HasSubstr("there is no command 'bogus'"));
}

TEST_F(Cli, FoundersMakeASpec) {
  write_file("t.csv", "track;time;Y;X\r\n1;0;10;20\r\n2;0;30;60\r\n");
  EXPECT_EQ(run({"founders", path("t.csv"), "--um-per-px", "2", "--until-time", "42", "--seed", "5", "-o",
                 path("spec.json")}),
            0);
  const auto spec = nlohmann::json::parse(read_file("spec.json"));
  EXPECT_EQ(spec["preset"], "clonogenic");
  EXPECT_EQ(spec["until"]["time_h"], 42);
  EXPECT_EQ(spec["model"]["dish"]["radius_um"], 200);
  EXPECT_EQ(spec["model"]["founders"]["positions_um"], nlohmann::json::parse("[[-40,20],[40,-20]]"));
  EXPECT_THAT(err(), HasSubstr("2 founders"));
  EXPECT_EQ(run({"founders", path("t.csv"), "--um-per-px", "2", "--until-time", "42", "--seed", "5", "--dish-radius-um",
                 "preset", "-o", path("preset.json")}),
            0);
  EXPECT_FALSE(nlohmann::json::parse(read_file("preset.json"))["model"].contains("dish"));
  EXPECT_THAT(err(), HasSubstr("starts here as one cell"));
  EXPECT_EQ(run({"founders", path("t.csv"), "--um-per-px", "0", "--until-time", "42", "--seed", "5"}), 2);
  EXPECT_THAT(err(), HasSubstr("--um-per-px: must be greater than 0"));
  EXPECT_EQ(run({"founders", path("t.csv"), "--until-time", "42", "--seed", "5"}), 2);
  EXPECT_THAT(err(), HasSubstr("--um-per-px is required"));
}

TEST_F(Cli, EditSendsOneMergePatch) {
  FakeServer server([](const FakeRequest&, const FakeConnection& to) {
    to.send(json_answer(200, R"({"id":"01890000-0000-7000-8000-000000000001","name":"n","revision":4,"labels":{"a":"b"}})"));
  });
  use(server);
  const std::string id = "01890000-0000-7000-8000-000000000001";
  EXPECT_EQ(run({"edit", id, "--name", "n", "--label", "plate=8=x", "--remove-label", "old", "--revision", "3"}), 0);
  EXPECT_EQ(out(), id + ": revision 4, name n, a=b\n");
  EXPECT_EQ(run({"edit", id, "--name", "", "--remove-labels"}), 0);
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {}, {"--label", "x"}, {"--label", "a=1", "--remove-label", "a"}, {"--revision", "x", "--name", "n"}, {"--remove-labels", "--label", "a=b"}}) {
    std::vector<std::string> arguments = {"edit", id};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    EXPECT_EQ(run(arguments), 2);
  }
  const auto requests = server.requests();
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].line(), "PATCH /v1/jobs/" + id + " HTTP/1.1");
  EXPECT_EQ(requests[0].body, R"({"name":"n","labels":{"plate":"8=x","old":null}})");
  EXPECT_EQ(requests[0].header("Content-Type"), "application/merge-patch+json");
  EXPECT_EQ(requests[0].header("If-Match"), "\"3.0\"");
  EXPECT_EQ(requests[1].body, R"({"name":null,"labels":null})");
  EXPECT_EQ(requests[1].header("If-Match"), "");
}

TEST_F(Cli, ShowWaitsByTheTagOfWhatIs) {
  std::atomic<int> count{0};
  FakeServer server([&](const FakeRequest& request, const FakeConnection& to) {
    if (request.header("Prefer").empty()) return to.send(json_answer(200, R"({"state":"queued"})", "ETag: \"2.7\"\r\n"));
    to.send(count++ == 0 ? json_answer(200, R"({"state":"running"})") : "HTTP/1.1 304 X\r\nConnection: close\r\n\r\n");
  });
  use(server);
  const std::string id = "01890000-0000-7000-8000-000000000001";
  EXPECT_EQ(run({"show", id, "--wait", "30"}), 0);
  EXPECT_EQ(out(), "state: running\n");
  EXPECT_EQ(run({"show", id, "--wait", "30"}), 0);
  EXPECT_EQ(out(), "state: queued\n") << "304: as it was";
  const auto requests = server.requests();
  EXPECT_EQ(requests.at(1).header("If-None-Match"), "\"2.7\"");
  EXPECT_EQ(requests.at(1).header("Prefer"), "wait=30");
  EXPECT_EQ(run({"show", id, "--wait", "61"}), 2);
}

}  // namespace
}  // namespace colony::client
