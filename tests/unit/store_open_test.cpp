// Opening a store: which folders and files are taken, which are refused.
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "server/store/store.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

using tests::TempDir;

TEST(StoreOpen, RefusesWhatIsNoDatabaseOfOurs) {
  const TempDir dir;
  std::ofstream(dir.path() + "/colony.db")
      << "this is a text, and long enough not to be taken for an empty database file";
  StoreConfig config;
  config.data_dir = dir.path();
  const auto store = Store::open(config);
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().code, ErrorCode::kStorage);
  config.data_dir = dir.path() + "/colony.db";
  EXPECT_EQ(Store::open(config).error().code, ErrorCode::kStorage);
  config.data_dir = "";
  EXPECT_EQ(Store::open(config).error().code, ErrorCode::kStorage);
}

TEST(StoreOpen, RefusesABoundThatHoldsNothing) {
  const TempDir dir;
  StoreConfig config;
  config.data_dir = dir.path() + "/data";
  config.database_bytes_max = 4095;
  EXPECT_EQ(Store::open(config).error().code, ErrorCode::kInvalid);
  EXPECT_FALSE(std::filesystem::exists(config.data_dir));
}

TEST(StoreOpen, MakesTheFoldersAbove) {
  const TempDir dir;
  StoreConfig config;
  config.data_dir = dir.path() + "/a/b/data/";  // a trailing slash names the same folder
  ASSERT_TRUE(Store::open(config));
  struct stat found {};
  ASSERT_EQ(stat((dir.path() + "/a/b/data").c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0700U);
  EXPECT_TRUE(Store::open(config));
  std::ofstream(dir.path() + "/file") << "no folder";
  config.data_dir = dir.path() + "/file/data";
  EXPECT_EQ(Store::open(config).error().code, ErrorCode::kStorage);
}

}  // namespace
}  // namespace colony::server
