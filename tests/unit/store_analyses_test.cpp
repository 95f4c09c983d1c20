// Analyses in the store: what was sent comes back, limits refuse, a worker's states survive a crash.
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "server/store/store.hpp"
#include "tests/support/old_schema.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

class StoreAnalysesTest : public ::testing::Test {
 protected:
  StoreAnalysesTest() { open(); }
  void open() {
    store_.reset();
    StoreConfig config;
    config.data_dir = dir_.path();
    auto store = Store::open(config);
    ASSERT_TRUE(store) << store.error().message;
    store_ = std::move(*store);
  }
  AnalysisStore& analyses() { return store_->analyses(); }
  static NewAnalysis picture(const std::string& name, std::string bytes = "bytes") {
    NewAnalysis analysis;
    analysis.name = name;
    analysis.options_json = "{}";
    analysis.media_type = "image/png";
    analysis.image = std::move(bytes);
    return analysis;
  }
  AnalysisRow made(const NewAnalysis& analysis) {
    auto row = analyses().create(analysis, kWide);
    EXPECT_TRUE(row);
    return row ? *row : AnalysisRow{};
  }
  AnalysisRow found(const std::string& id) {
    auto row = analyses().find(AnalysisKind::kAnalysis, id);
    EXPECT_TRUE(row);
    return row ? *row : AnalysisRow{};
  }

  static constexpr AnalysisLimits kWide{1 << 30, 1000};
  const tests::TempDir dir_;
  std::unique_ptr<Store> store_;
};

TEST_F(StoreAnalysesTest, AnImageComesBackAsItWasSent) {
  std::string bytes(3'000'000, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 2654435761U >> 24);
  NewAnalysis with_result = picture("a", bytes);
  with_result.result_json = R"({"x":1})";
  const std::string id = made(with_result).id;
  open();
  const AnalysisRow row = found(id);
  EXPECT_EQ(row.state, AnalysisState::kSucceeded);
  EXPECT_EQ(row.result_json, with_result.result_json);
  EXPECT_EQ(row.image_bytes, bytes.size());
  EXPECT_EQ(row.media_type, "image/png");
  EXPECT_FALSE(row.finished_at.empty());
  const auto image = analyses().image(id);
  ASSERT_TRUE(image);
  EXPECT_TRUE(*image == bytes);
}

TEST_F(StoreAnalysesTest, KindsAreApart) {
  const std::string id = made(picture("a")).id;
  NewAnalysis other;
  other.kind = AnalysisKind::kComparison;
  other.options_json = other.result_json = "{}";
  other.job_id = "some job";
  other.analysis_id = id;
  const std::string comparison = made(other).id;
  EXPECT_EQ(analyses().find(AnalysisKind::kComparison, id).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(analyses().remove(AnalysisKind::kAnalysis, comparison).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(analyses().image(comparison).error().code, ErrorCode::kNotFound);
  ASSERT_TRUE(analyses().remove(AnalysisKind::kAnalysis, id));
  EXPECT_EQ(analyses().image(id).error().code, ErrorCode::kNotFound);
  const auto left = analyses().find(AnalysisKind::kComparison, comparison);
  ASSERT_TRUE(left);
  EXPECT_EQ(left->analysis_id, id);
}

TEST_F(StoreAnalysesTest, PagesAreNewestFirstAndNeverOverlap) {
  for (int i = 0; i < 5; ++i) made(picture(std::to_string(i)));
  std::string names, cursor;
  for (int pages = 0; pages < 3; ++pages) {
    const auto page = analyses().list(AnalysisKind::kAnalysis, 2, cursor);
    ASSERT_TRUE(page);
    for (const AnalysisRow& row : page->items) names += row.name;
    made(picture("later"));
    cursor = page->next.value_or("");
  }
  EXPECT_EQ(names, "43210");
  EXPECT_TRUE(cursor.empty());
  EXPECT_EQ(analyses().list(AnalysisKind::kAnalysis, 2, "made up").error().code, ErrorCode::kInvalid);
}

TEST_F(StoreAnalysesTest, LimitsRefuseAndLeaveNothing) {
  made(picture("a", std::string(60, 'x')));
  const auto too_many_bytes = analyses().create(picture("b", std::string(41, 'x')), {100, 1000});
  EXPECT_EQ(too_many_bytes.error().code, ErrorCode::kLimit);
  const auto too_many = analyses().create(picture("b"), {100, 1});
  EXPECT_EQ(too_many.error().code, ErrorCode::kBusy);
  EXPECT_EQ(analyses().list(AnalysisKind::kAnalysis, 10, "")->items.size(), 1u);
  EXPECT_TRUE(analyses().create(picture("b", std::string(40, 'x')), {100, 1000}));
}

TEST_F(StoreAnalysesTest, AWorkerTakesTheOldestAndEndsIt) {
  const std::string first = made(picture("first")).id;
  const std::string second = made(picture("second")).id;
  const auto taken = analyses().take_queued();
  ASSERT_TRUE(taken && *taken);
  EXPECT_EQ((*taken)->id, first);
  EXPECT_EQ(found(first).state, AnalysisState::kRunning);
  ASSERT_TRUE(analyses().succeed((*taken)->analysis_key, "{}"));
  EXPECT_EQ(found(first).state, AnalysisState::kSucceeded);
  EXPECT_EQ(analyses().fail((*taken)->analysis_key, "x", "y").error().code, ErrorCode::kNotFound);

  const auto other = analyses().take_queued();
  ASSERT_TRUE(other && *other);
  ASSERT_TRUE(analyses().fail((*other)->analysis_key, "malformed", "cut off"));
  EXPECT_EQ(found(second).state, AnalysisState::kFailed);
  EXPECT_EQ(found(second).failure_code, "malformed");
  EXPECT_EQ(found(second).detail, "cut off");
  EXPECT_FALSE(*analyses().take_queued());
}

TEST_F(StoreAnalysesTest, OneThatKillsTheServerIsGivenUp) {
  const std::string id = made(picture("poison")).id;
  for (int tries = 1; tries <= kAnalysisTriesMax; ++tries) {
    // Being put back is no try.
    auto taken = analyses().take_queued();
    ASSERT_TRUE(taken && *taken);
    ASSERT_TRUE(analyses().put_back((*taken)->analysis_key));
    taken = analyses().take_queued();
    ASSERT_TRUE(taken && *taken);
    EXPECT_EQ((*taken)->try_count, tries);
    open();
    ASSERT_TRUE(analyses().recover());
  }
  EXPECT_EQ(found(id).state, AnalysisState::kFailed);
  EXPECT_FALSE(found(id).detail.empty());
}

TEST_F(StoreAnalysesTest, TheTablesComeToADatabaseOfTheSecondSchema) {
  made(picture("a"));
  store_.reset();
  tests::take_back_to(dir_.path() + "/colony.db", 2);
  open();
  EXPECT_TRUE(analyses().list(AnalysisKind::kAnalysis, 10, "")->items.empty());
  made(picture("b"));
}

}  // namespace
}  // namespace colony::server
