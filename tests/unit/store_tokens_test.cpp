// Tokens in the database: what is kept, what is refused, and that it lasts.
#include <algorithm>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "server/store/identity.hpp"
#include "server/store/store.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

class TokenStoreTest : public ::testing::Test {
 protected:
  void open() {
    store_.reset();
    StoreConfig config;
    config.data_dir = dir_.path();
    auto opened = Store::open(config);
    ASSERT_TRUE(opened) << opened.error().message;
    store_ = std::move(*opened);
  }
  void SetUp() override { open(); }
  static NewToken token(std::uint8_t byte, const std::string& name = "ann", const std::string& scope = "read") {
    NewToken out{name, scope, {}, "local", "2030-01-02T03:04:05.678Z"};
    out.secret_hash.fill(byte);
    return out;
  }
  colony::tests::TempDir dir_;
  std::unique_ptr<Store> store_;
};

TEST_F(TokenStoreTest, WhatWasStoredIsThereAfterARestartAndGoneAfterARemoval) {
  const auto first = store_->tokens().create(token(1));
  ASSERT_TRUE(first) << first.error().message;
  const auto second = store_->tokens().create(token(2, "ann", "admin"));
  ASSERT_TRUE(second) << "two tokens of one name";
  open();
  auto rows = store_->tokens().list();
  ASSERT_TRUE(rows);
  ASSERT_EQ(rows->size(), 2u);
  EXPECT_EQ((*rows)[0].id, second->row.id) << "newest first";
  EXPECT_EQ((*rows)[1].secret_hash, token(1).secret_hash);
  EXPECT_EQ((*rows)[1].scope, "read");
  EXPECT_EQ((*rows)[1].expires_at, "2030-01-02T03:04:05.678Z");
  EXPECT_EQ((*rows)[1].created_by, "local");
  ASSERT_TRUE(store_->tokens().remove(first->row.id));
  EXPECT_EQ(store_->tokens().remove(first->row.id).error().code, ErrorCode::kNotFound);
  open();
  EXPECT_EQ(store_->tokens().list()->size(), 1u);
}

TEST_F(TokenStoreTest, ARefusedOneLeavesNothing) {
  ASSERT_TRUE(store_->tokens().create(token(1)));
  EXPECT_FALSE(store_->tokens().create(token(1, "other"))) << "the same secret twice";
  EXPECT_FALSE(store_->tokens().create(token(2, "other", "root"))) << "no such scope";
  EXPECT_EQ(store_->tokens().list()->size(), 1u);
}

TEST_F(TokenStoreTest, ThereIsALimit) {
  // In one go: each create is an fsync.
  store_.reset();
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((dir_.path() + "/colony.db").c_str(), &db), SQLITE_OK);
  const std::string rows =
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < " + std::to_string(kTokensMax - 1) +
      ") INSERT INTO token (id, name, scope, secret_hash, created_by, created_at, expires_at)"
      " SELECT 'id-' || i, 'x', 'read', randomblob(32), 'x', 'x', 'x' FROM n";
  EXPECT_EQ(sqlite3_exec(db, rows.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  sqlite3_close(db);
  open();
  ASSERT_TRUE(store_->tokens().create(token(8)));
  EXPECT_EQ(store_->tokens().create(token(9)).error().code, ErrorCode::kLimit);
  ASSERT_TRUE(store_->tokens().remove(store_->tokens().list()->back().id));
  EXPECT_TRUE(store_->tokens().create(token(9)));
}

TEST_F(TokenStoreTest, ExpiredOnesDoNotCountAndGiveWayOldestFirst) {
  store_.reset();
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((dir_.path() + "/colony.db").c_str(), &db), SQLITE_OK);
  // The last two are valid.
  const std::string rows =
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < " + std::to_string(kTokensMax) +
      ") INSERT INTO token (id, name, scope, secret_hash, created_by, created_at, expires_at)"
      " SELECT 'id-' || i, 'x', 'read', randomblob(32), 'x', 'x',"
      " printf('20%02d-01-01T00:00:%02d.000Z', CASE WHEN i > " + std::to_string(kTokensMax - 2) +
      " THEN 99 ELSE 20 END, (i * 7) % 60) FROM n";
  EXPECT_EQ(sqlite3_exec(db, rows.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  sqlite3_close(db);
  open();
  const auto made = store_->tokens().create(token(8));
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_EQ(made->removed.size(), 1u) << "no more than must be: the others say who had a token";
  EXPECT_EQ(made->removed[0].expires_at, "2020-01-01T00:00:00.000Z");
  EXPECT_EQ(made->removed[0].id, "id-60");
  const auto next = store_->tokens().create(token(9));
  ASSERT_TRUE(next);
  EXPECT_EQ(next->removed.at(0).id, "id-120");
  const auto kept = *store_->tokens().list();
  EXPECT_EQ(kept.size(), kTokensMax);
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), [](const TokenRow& row) { return row.expires_at > "2090"; }), 2);
}

TEST_F(TokenStoreTest, TheLogSaysWhoAsked) {
  NewJob job;
  job.name = "j";
  job.spec_json = "{}";
  job.until_cells = 5;
  job.submitted_by = "ann";
  const auto made = store_->create_job(job, 10);
  ASSERT_TRUE(made);
  const std::int64_t key = made->job.job_key;
  ASSERT_TRUE(store_->command_job(key, JobCommand::kPause, "bob"));
  ASSERT_TRUE(store_->command_job(key, JobCommand::kResume, "cleo"));
  ASSERT_TRUE(store_->take_queued_job());
  ASSERT_TRUE(store_->command_job(key, JobCommand::kCancel, "dan"));
  std::vector<std::string> actors;
  const auto log = store_->read_log(key, 0, 100);
  for (const LogRow& row : *log) actors.push_back(row.actor);
  EXPECT_EQ(actors, (std::vector<std::string>{"ann", "bob", "cleo", "", "dan"})) << "the runner is nobody";
}

TEST(WallTime, ComesBackFromItsTextAndFromNoOther) {
  EXPECT_EQ(wall_time_text_at(0), "1970-01-01T00:00:00.000Z");
  EXPECT_EQ(wall_time_text_at(951'782'400'123), "2000-02-29T00:00:00.123Z");
  EXPECT_EQ(unix_ms_of("2000-02-29T00:00:00.123Z"), 951'782'400'123);
  for (const char* wrong : {"", "2001-02-29T00:00:00.123Z", "2000-02-29T00:00:00Z", "2000-02-29T00:00:00.123Z ",
                            "2000-2-29T00:00:00.123Z", "2000-02-29T24:00:00.000Z", "2000-02-29 00:00:00.123Z"}) {
    EXPECT_FALSE(unix_ms_of(wrong)) << wrong;
  }
}

}  // namespace
}  // namespace colony::server
