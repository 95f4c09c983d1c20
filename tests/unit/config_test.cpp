// The configuration: precedence, strictness, refusals.
#include "server/config.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace colony::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const Environment kHome = {{"HOME", "/home/someone"}};

class ConfigFile {
 public:
  explicit ConfigFile(const std::string& text) {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::path(::testing::TempDir()) / ("colony_config_" + std::string(info->name()) + ".toml");
    std::ofstream(path_) << text;
  }
  ~ConfigFile() { std::filesystem::remove(path_); }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

Result<Invocation> given(std::vector<std::string> arguments, Environment environment = kHome, std::uint64_t cores = 2) {
  return configure(arguments, environment, "1.2.3", cores);
}

std::vector<std::string> places(const Result<Invocation>& result) {
  std::vector<std::string> out;
  if (!result) {
    for (const FieldError& field : result.error().fields) out.push_back(field.pointer);
  }
  return out;
}

TEST(Config, HasDefaults) {
  const auto result = given({});
  ASSERT_TRUE(result);
  const Config& config = result->config;
  EXPECT_EQ(config.http.address, "127.0.0.1");
  EXPECT_EQ(config.http.port, 8080);
  EXPECT_EQ(config.store.data_dir, "/home/someone/.local/share/colony");
  EXPECT_EQ(config.jobs.concurrent_max, 1u);
  EXPECT_EQ(given({}, {{"HOME", "/h"}, {"XDG_DATA_HOME", "/x"}})->config.store.data_dir, "/x/colony");
  EXPECT_EQ(given({}, {{"HOME", "/h"}, {"XDG_DATA_HOME", "relative"}})->config.store.data_dir,
            "/h/.local/share/colony");
  EXPECT_THAT(places(given({}, {})), ElementsAre("--server.data"));
}

TEST(Config, FlagsBeatEnvironmentBeatsFile) {
  const ConfigFile file(
      "[jobs]\nconcurrent_max = 2\nqueued_max = 20\n[limits]\ncells_max = 200\n"
      "[server]\nlisten = \"[::1]:0\"\nallowed_hosts = [\"a.example\", \"b\"]\n");
  Environment environment = kHome;
  environment.emplace_back("COLONY_JOBS_QUEUED_MAX", "30");
  environment.emplace_back("COLONY_LIMITS_CELLS_MAX", "300");
  const auto result = given({"--config", file.path(), "--limits.cells-max", "400", "--data", "/d"}, environment);
  ASSERT_TRUE(result) << places(result).at(0);
  const Config& config = result->config;
  EXPECT_EQ(config.jobs.concurrent_max, 2u);
  EXPECT_EQ(config.jobs.queued_max, 30u);
  EXPECT_EQ(config.jobs.cells_max, 400u);
  EXPECT_EQ(config.http.address, "::1");
  EXPECT_EQ(config.http.port, 0);
  EXPECT_THAT(config.http.allowed_hosts, ElementsAre("a.example", "b"));
  EXPECT_EQ(config.store.data_dir, "/d");
  EXPECT_EQ(given({"--listen=127.0.0.1:9", "--jobs.concurrent-max=3"})->config.jobs.concurrent_max, 3u);
}

TEST(Config, EveryFaultInTheFileIsNamed) {
  const ConfigFile file(
      "colour = 1\n[jobs]\nconcurrent_max = 0\nqueued_max = \"many\"\nspeed = 3\n[weather]\nrain = true\n"
      "[server]\nlisten = 8080\nallowed_hosts = [1]\n[limits]\ncells_max = -1\n");
  const std::string at = file.path() + ": ";
  EXPECT_THAT(places(given({"--config", file.path()})),
              ::testing::UnorderedElementsAre(at + "colour", at + "jobs.concurrent_max", at + "jobs.queued_max",
                                              at + "jobs.speed", at + "weather.rain", at + "server.listen",
                                              at + "server.allowed_hosts", at + "limits.cells_max"));
}

TEST(Config, AFileThatIsMissingOrBrokenIsAnError) {
  EXPECT_FALSE(given({"--config", "/no/such/file.toml"}));
  const ConfigFile file("[jobs\n");
  const auto result = given({"--config", file.path()});
  EXPECT_THAT(places(result), ElementsAre(HasSubstr(file.path() + ":1")));
}

TEST(Config, UnknownOrWrongEnvironmentIsAnError) {
  const auto with = [](const char* name, const char* value) {
    return places(given({}, {{"HOME", "/h"}, {name, value}}));
  };
  EXPECT_THAT(with("COLONY_JOBS_SPEED", "1"), ElementsAre("COLONY_JOBS_SPEED"));
  EXPECT_THAT(with("COLONY_AUTH_MODES", "required"), ElementsAre("COLONY_AUTH_MODES"));
  EXPECT_THAT(with("COLONY_LOG_LEVEL", "debug"), ElementsAre("COLONY_LOG_LEVEL"));
  EXPECT_THAT(with("COLONY_JOBS_CONCURRENT_MAX", "two"), ElementsAre("COLONY_JOBS_CONCURRENT_MAX"));
  EXPECT_THAT(with("COLONY_JOBS_CONCURRENT_MAX", ""), ElementsAre("COLONY_JOBS_CONCURRENT_MAX"));
  EXPECT_THAT(with("COLONY_SERVER", "http://x"), ElementsAre()) << "belongs to the command line";
}

TEST(Config, WrongFlagsAreErrors) {
  EXPECT_FALSE(given({"--colour", "red"}));
  EXPECT_FALSE(given({"stray"}));
  EXPECT_FALSE(given({"--jobs.concurrent-max"}));
  EXPECT_THAT(places(given({"--jobs.concurrent-max", "-1"})).size(), 1u);
  EXPECT_THAT(places(given({"--jobs.concurrent-max", "257"})), ElementsAre("--jobs.concurrent-max"));
}

TEST(Config, JobsShareTheCoresUnlessToldOtherwise) {
  const auto shared = [](std::uint64_t cores, std::vector<std::string> arguments) {
    const auto result = given(std::move(arguments), kHome, cores);
    return std::pair{result->config.jobs.concurrent_max, result->config.jobs.threads_per_job};
  };
  using Pair = std::pair<std::size_t, int>;
  EXPECT_EQ(shared(1, {}), Pair(1, 1));
  EXPECT_EQ(shared(2, {}), Pair(1, 2));
  EXPECT_EQ(shared(6, {}), Pair(1, 4));
  EXPECT_EQ(shared(8, {}), Pair(2, 4));
  EXPECT_EQ(shared(64, {}), Pair(16, 4));
  EXPECT_EQ(shared(8, {"--jobs.concurrent-max", "1"}), Pair(1, 8));
  EXPECT_EQ(shared(8, {"--jobs.concurrent-max", "3"}), Pair(3, 2));
  EXPECT_EQ(shared(8, {"--jobs.threads-per-job", "3"}), Pair(2, 3));
  EXPECT_EQ(shared(2, {"--jobs.threads-per-job", "16"}), Pair(1, 16)) << "what is asked for stands";
  EXPECT_EQ(shared(2, {"--jobs.concurrent-max", "16"}), Pair(16, 1));
  EXPECT_EQ(shared(2, {"--jobs.concurrent-max", "5", "--jobs.threads-per-job", "7"}), Pair(5, 7));
  EXPECT_EQ(shared(0, {}), Pair(1, 1));
  EXPECT_EQ(shared(100'000, {}), Pair(64, 4)) << "within the ranges of both";
  for (std::uint64_t cores = 1; cores <= 300; ++cores) {
    for (const char* argument : {"--limits.cells-max=9", "--jobs.concurrent-max=1", "--jobs.threads-per-job=1"}) {
      const auto [jobs, threads] = shared(cores, {argument});
      ASSERT_LE(jobs * static_cast<std::size_t>(threads), cores);
    }
  }
}

TEST(Config, ThreadsPerJobComeFromFileEnvironmentAndFlagWithinTheirRange) {
  const ConfigFile file("[jobs]\nthreads_per_job = 2\n");
  Environment environment = kHome;
  EXPECT_EQ(given({"--config", file.path()}, environment)->config.jobs.threads_per_job, 2);
  environment.emplace_back("COLONY_JOBS_THREADS_PER_JOB", "3");
  EXPECT_EQ(given({"--config", file.path()}, environment)->config.jobs.threads_per_job, 3);
  EXPECT_EQ(given({"--config", file.path(), "--jobs.threads-per-job=5"}, environment)->config.jobs.threads_per_job, 5);
  for (const char* wrong : {"0", "257", "-1", "two", "1.5"}) {
    EXPECT_THAT(places(given({std::string("--jobs.threads-per-job=") + wrong})), ElementsAre("--jobs.threads-per-job"))
        << wrong;
  }
}

TEST(Config, OnlyLoopbackIsListenedOn) {
  for (const char* right : {"127.0.0.1:0", "127.1.2.3:80", "[::1]:65535", "localhost:1"}) {
    EXPECT_TRUE(given({"--listen", right})) << right;
  }
  for (const char* wrong : {"example.org:80", "127.0.0.1", "127.0.0.1:", ":80", "127.0.0.1:65536", "127.0.0.1:x",
                            "127.0.0:80", "127.0.0.256:80", "127.0.0.1.example.org:80", ""}) {
    EXPECT_THAT(places(given({"--listen", wrong})), ElementsAre("--server.listen")) << wrong;
  }
}

TEST(Config, OtherAddressesNeedTokensAndTlsOrAProxy) {
  const auto listens = [](std::vector<std::string> more) {
    more.insert(more.begin(), {"--listen", "0.0.0.0:80"});
    return given(more);
  };
  for (const char* address : {"0.0.0.0:8080", "192.168.1.1:8080", "[::]:80"}) {
    EXPECT_THAT(places(given({"--listen", address})), ElementsAre("server.listen", "server.listen")) << address;
  }
  EXPECT_THAT(listens({}).error().fields.at(0).message, HasSubstr("auth.mode"));
  EXPECT_THAT(listens({"--auth.mode=required"}).error().fields.at(0).message, HasSubstr("in the clear"));
  EXPECT_THAT(places(listens({"--server.behind-proxy=true"})), ElementsAre("server.listen")) << "a proxy is no token";
  EXPECT_TRUE(listens({"--auth.mode=required", "--server.behind-proxy=true"}));
  const auto with_tls = listens({"--auth.mode=required", "--tls.certificate=c", "--tls.key=k"});
  ASSERT_TRUE(with_tls);
  EXPECT_TRUE(with_tls->config.http.tokens_required);
  EXPECT_EQ(with_tls->config.http.tls_key, "k");
  EXPECT_THAT(places(given({"--tls.certificate=c"})), ElementsAre("tls.key"));
  EXPECT_THAT(places(given({"--tls.key=c"})), ElementsAre("tls.certificate"));
  EXPECT_THAT(places(given({"--server.trust-forwarded-for=true"})), ElementsAre("server.trust_forwarded_for"));
}

TEST(Config, EachSettingOfTheGateHasItsOwnError) {
  for (const char* wrong : {"auth.mode=on", "log.format=xml", "server.behind-proxy=yes", "server.trust-forwarded-for=1",
                            "limits.count-loopback=2", "limits.connections-per-address-max=0",
                            "limits.requests-per-s=-1", "limits.requests-burst=0", "limits.failed-tokens-per-min=x",
                            "limits.handshake-timeout-ms=0", "limits.header-timeout-ms=9", "limits.body-timeout-ms=3600001",
                            "limits.idle-timeout-ms=1.5", "limits.write-timeout-ms=x"}) {
    const std::string flag = std::string("--") + wrong;
    EXPECT_THAT(places(given({flag})), ElementsAre(flag.substr(0, flag.find('=')))) << wrong;
  }
  for (const char* origin : {"*", "null", "lab.example", "https://", "https://lab.example/", "https://Lab.example",
                             "ftp://lab.example", "https://a b", "https://a@b", "https://a,"}) {
    EXPECT_THAT(places(given({std::string("--server.cors-origins=") + origin})), ElementsAre("--server.cors-origins")) << origin;
  }
  const ConfigFile file(
      "[server]\ncors_origins = [\"https://lab.example\", \"http://localhost:3000\"]\nbehind_proxy = true\n"
      "[limits]\nrequests_per_s = 0\nheader_timeout_ms = 250\ncount_loopback = true\n[log]\nformat = \"json\"\n");
  const auto right = given({"--config", file.path()});
  ASSERT_TRUE(right) << places(right).at(0);
  EXPECT_THAT(right->config.http.cors_origins, ElementsAre("https://lab.example", "http://localhost:3000"));
  EXPECT_TRUE(right->config.http.behind_proxy);
  EXPECT_EQ(right->config.http.requests_per_s, 0.0);
  EXPECT_EQ(right->config.http.header_timeout_ms, 250);
  EXPECT_EQ(right->config.log_format, LogFormat::kJson);
  const ConfigFile wrong("[server]\nbehind_proxy = \"true\"\n");
  EXPECT_THAT(places(given({"--config", wrong.path()})), ElementsAre(HasSubstr("server.behind_proxy")));
}

TEST(Config, TokenCreateTakesItsOwnFlagsAndTheServers) {
  const auto result = given({"token", "create", "--name", "ann", "--scope", "admin", "--expires-h", "24", "--data", "/d"});
  ASSERT_TRUE(result) << places(result).at(0);
  ASSERT_TRUE(result->token);
  EXPECT_EQ(result->token->name, "ann");
  EXPECT_EQ(result->token->scope, "admin");
  EXPECT_EQ(result->token->expires_h, 24.0);
  EXPECT_EQ(result->config.store.data_dir, "/d");
  EXPECT_FALSE(given({})->token);
  EXPECT_FALSE(given({"token"}));
  EXPECT_FALSE(given({"token", "create", "--name", "ann", "--scope", "admin"})) << "how long is never guessed";
  EXPECT_THAT(places(given({"token", "create", "--name=a", "--scope=read", "--expires-h=inf"})), ElementsAre("--expires-h"));
}

TEST(Config, TheBasePathIsCheckedAndTheDiskLimitsAreRead) {
  EXPECT_EQ(given({})->config.http.base_path, "");
  for (const char* right : {"/colony", "/a/b-c_d.e", ""}) {
    const auto result = given({"--server.base-path", right});
    ASSERT_TRUE(result) << right;
    EXPECT_EQ(result->config.http.base_path, right);
  }
  for (const char* wrong :
       {"colony", "/", "/colony/", "//a", "/a//b", "/a/../b", "/.", "/a b", "/a%20", "/a?b", "/\xc3\xbc"}) {
    EXPECT_THAT(places(given({"--server.base-path", wrong})), ElementsAre("--server.base-path")) << wrong;
  }
  const auto disk = given({"--limits.database-bytes-max=1000000", "--limits.free-bytes-min", "5"});
  ASSERT_TRUE(disk);
  EXPECT_EQ(disk->config.store.database_bytes_max, 1'000'000u);
  EXPECT_EQ(disk->config.jobs.free_bytes_min, 5u);
}

TEST(Config, HelpAndVersion) {
  EXPECT_EQ(given({"--version"})->print, "colonyd 1.2.3\n");
  const std::string help = given({"--help"})->print;
  for (const char* word : {"--jobs.concurrent-max", "COLONY_JOBS_CONCURRENT_MAX", "--listen", "--data", "--config"}) {
    EXPECT_THAT(help, HasSubstr(word));
  }
}

}  // namespace
}  // namespace colony::server
