// Lines on their way to standard error: none out of order, none waited for, and what is lost is said.
#include "server/log_sink.hpp"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <sys/resource.h>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/logger.h>

namespace colony::server {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kLong{60'000};

class Pipe {
 public:
  Pipe() { EXPECT_EQ(pipe2(ends_, O_CLOEXEC), 0); }
  ~Pipe() {
    close_reader();
    close(ends_[1]);
  }
  int writer() const { return ends_[1]; }
  void close_reader() {
    if (ends_[0] >= 0) close(ends_[0]);
    ends_[0] = -1;
  }
  /// Waits for some bytes. False at the end.
  bool read_some() {
    std::vector<char> buffer(1 << 16);
    const ssize_t got = read(ends_[0], buffer.data(), buffer.size());
    if (got > 0) text_.append(buffer.data(), static_cast<std::size_t>(got));
    return got > 0;
  }
  /// Reads until `count` lines are there.
  std::vector<std::string> lines(std::size_t count) {
    while (static_cast<std::size_t>(std::count(text_.begin(), text_.end(), '\n')) < count && read_some()) {
    }
    std::vector<std::string> out;
    std::istringstream in(text_);
    for (std::string line; std::getline(in, line);) out.push_back(line);
    return out;
  }

 private:
  int ends_[2] = {-1, -1};
  std::string text_;
};

struct Logged {
  Pipe pipe;
  std::shared_ptr<LogSink> sink;
  spdlog::logger logger;
  explicit Logged(std::size_t lines_max)
      : sink(std::make_shared<LogSink>(pipe.writer(), lines_max, [](std::size_t lines) { return "lost " + std::to_string(lines); })),
        logger("test", sink) {
    logger.set_pattern("%v");
  }
};

TEST(LogSink, LinesComeInTheirOrderAndAllAreOutAtTheEnd) {
  Logged log(100'000);
  for (int i = 0; i < 1'000; ++i) log.logger.info("{}", i);
  ASSERT_TRUE(log.sink->end(kLong));
  log.logger.info("too late");
  const auto lines = log.pipe.lines(1'000);
  ASSERT_EQ(lines.size(), 1'000U);
  for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_EQ(lines[i], std::to_string(i));
}

TEST(LogSink, ALineAloneIsWrittenWithoutAnother) {
  Logged log(10);
  log.logger.info("one");
  EXPECT_EQ(log.pipe.lines(1), std::vector<std::string>{"one"});
  log.logger.info("two");
  EXPECT_EQ(log.pipe.lines(2).back(), "two");
}

constexpr std::size_t kSmall = 300, kWaiting = 10;

// Nobody reads: more than a pipe holds is under way, then three hundred lines where ten may wait.
void stall(Logged& log) {
  log.logger.info("{}", std::string(1 << 20, 'x'));
  ASSERT_TRUE(log.pipe.read_some());  // it is under way
  for (std::size_t i = 0; i < kSmall; ++i) log.logger.info("{}", i);
}

TEST(LogSink, WhoDoesNotReadHoldsNobody) {
  Logged log(kWaiting);
  stall(log);
  EXPECT_FALSE(log.sink->end(milliseconds(0)));
  // What waits is written all the same, once somebody reads, and what was lost is told.
  const auto lines = log.pipe.lines(1 + kWaiting + 1);
  ASSERT_EQ(lines.size(), 1 + kWaiting + 1);
  EXPECT_EQ(lines.back(), "lost " + std::to_string(kSmall - kWaiting));
  for (std::size_t i = 0; i < kWaiting; ++i) EXPECT_EQ(lines[1 + i], std::to_string(kSmall - kWaiting + i));
  EXPECT_TRUE(log.sink->end(kLong));
}

TEST(LogSink, TheNextLineTakenSaysHowManyWereLost) {
  Logged log(kWaiting);
  stall(log);
  (void)log.pipe.lines(1 + kWaiting);
  log.logger.info("after");
  const auto lines = log.pipe.lines(1 + kWaiting + 2);
  ASSERT_EQ(lines.size(), 1 + kWaiting + 2);
  EXPECT_EQ(lines[1 + kWaiting], "lost " + std::to_string(kSmall - kWaiting));
  EXPECT_EQ(lines.back(), "after");
}

// Whoever shares standard error may have made it non-blocking: a full pipe is then no reason to lose or tear a line.
TEST(LogSink, ABusyDescriptorIsWaitedFor) {
  Logged log(100'000);
  ASSERT_EQ(fcntl(log.pipe.writer(), F_SETFL, O_NONBLOCK), 0);
  constexpr std::size_t kLines = 3'000;
  for (std::size_t i = 0; i < kLines; ++i) log.logger.info("{} {}", i, std::string(100, 'x'));
  const auto lines = log.pipe.lines(kLines);
  ASSERT_EQ(lines.size(), kLines);
  for (std::size_t i = 0; i < kLines; ++i) EXPECT_EQ(lines[i], std::to_string(i) + " " + std::string(100, 'x'));
  EXPECT_TRUE(log.sink->end(kLong));
}

TEST(LogSink, EveryLineIsWrittenOrCounted) {
  const std::string path = ::testing::TempDir() + "log_sink_test.txt";
  const int full = open("/dev/full", O_WRONLY | O_CLOEXEC), file = open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  ASSERT_GE(full, 0);
  ASSERT_GE(file, 0);
  std::size_t told_count = 0, lost_count = 0, logged_count = 0;
  const auto sink = std::make_shared<LogSink>(full, 10, [&](std::size_t lines) {
    ++told_count;
    lost_count = lines;
    return "lost " + std::to_string(lines);
  });
  spdlog::logger logger("test", sink);
  logger.set_pattern("%v");
  while (told_count == 0) logger.info("{}", logged_count++);
  ASSERT_EQ(dup2(file, full), full);  // room again
  while (told_count == 1) logger.info("{}", logged_count++);
  ASSERT_TRUE(sink->end(kLong));
  std::ifstream in(path);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  EXPECT_EQ(lines + lost_count, logged_count + told_count);
  EXPECT_THAT(text, ::testing::HasSubstr("lost " + std::to_string(lost_count) + "\n"));
  close(full);
  close(file);
  std::remove(path.c_str());
}

// A file that may not grow beyond some bytes stands for a disk that is full for a while: no line runs into the one that was cut.
TEST(LogSink, ALineThatWasCutTearsNoOther) {
  std::signal(SIGXFSZ, SIG_IGN);
  const std::string path = ::testing::TempDir() + "log_sink_cut_test.txt";
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0600);
  ASSERT_GE(file, 0);
  std::size_t told_count = 0;
  const auto sink = std::make_shared<LogSink>(file, 10'000'000, [&](std::size_t) {  // room for all: only a write loses
    ++told_count;
    return std::string("lost");
  });
  spdlog::logger logger("test", sink);
  logger.set_pattern("%v");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{10, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  while (told_count == 0) logger.info("twelve bytes");
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  logger.info("whole");
  ASSERT_TRUE(sink->end(kLong));
  std::ifstream in(path);
  std::string line;
  ASSERT_TRUE(std::getline(in, line));
  EXPECT_EQ(line, "twelve byt");
  bool is_whole = false;
  while (std::getline(in, line)) {
    EXPECT_THAT(line, ::testing::AnyOf("twelve bytes", "lost", "whole"));
    is_whole = is_whole || line == "whole";
  }
  EXPECT_TRUE(is_whole);
  close(file);
  std::remove(path.c_str());
}

TEST(LogSink, ALogWhoseReaderHasGoneIsNoReasonToStop) {
  std::signal(SIGPIPE, SIG_IGN);  // as colonyd does
  Logged log(10);
  log.pipe.close_reader();
  for (int i = 0; i < 100; ++i) log.logger.info("{}", i);
  EXPECT_TRUE(log.sink->end(kLong));
}

}  // namespace
}  // namespace colony::server
