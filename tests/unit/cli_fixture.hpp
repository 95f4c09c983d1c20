// cli_fixture: runs the command line in this process, with a home folder, an environment and streams of its own.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

#include "client/cli/app.hpp"
#include "client/cli/environment.hpp"
#include "tests/unit/cli_fake_server.hpp"

namespace colony::client {

inline const std::string kId = "0190aaaa-bbbb-7ccc-8ddd-000000001234";

class Cli : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "colony_cli_XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    variables_["HOME"] = folder_.string();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  int run(const std::vector<std::string>& arguments) {
    out_.str("");
    err_.str("");
    std::istringstream in(in_);
    const auto variable = [this](const std::string& name) -> std::optional<std::string> {
      const auto found = variables_.find(name);
      return found == variables_.end() ? std::nullopt : std::optional(found->second);
    };
    Environment env{in, out_, err_, interrupt_, variable};
    env.out_is_terminal = out_is_terminal_;
    env.terminal_width = [] { return 60; };
    env.retry = {3, 3, std::chrono::milliseconds(1), std::chrono::milliseconds(2000)};
    return client::run(arguments, env);
  }
  void use(const test::FakeServer& server) { variables_["COLONY_SERVER"] = server.url(); }
  std::string out() const { return out_.str(); }
  std::string err() const { return err_.str(); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write_file(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  std::string read_file(const std::string& name) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_), {}));
  }

  std::filesystem::path folder_;
  std::map<std::string, std::string> variables_;
  std::string in_;
  bool out_is_terminal_ = false;
  Interrupt interrupt_;
  std::ostringstream out_, err_;
};

inline std::string job_json(const std::string& state, const std::string& id = kId) {
  return R"({"id":")" + id + R"(","state":")" + state +
         R"(","reason":"cells","detail":null,"name":"n","digest":"abc123","progress":{"cells":180,"time_h":172.3,"fraction":1.0}})";
}

}  // namespace colony::client
