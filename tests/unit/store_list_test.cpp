// The list of jobs: whichever index is walked, a page is what a look at every job gives.
#include <random>

#include <gtest/gtest.h>

#include "server/store/store.hpp"
#include "tests/support/temp_dir.hpp"

namespace colony::server {
namespace {

bool fits(const JobRow& job, const JobFilter& filter) {
  bool out = (!filter.state || job.state == *filter.state) && (!filter.kind || job.kind == *filter.kind) &&
             (!filter.name || job.name == *filter.name);
  for (const auto& [name, value] : filter.labels) {
    const auto label = job.labels.find(name);
    out = out && label != job.labels.end() && label->second == value;
  }
  return out;
}

TEST(StoreList, AnyFilterFromAnyPlaceIsALookAtEveryJob) {
  const tests::TempDir dir;
  StoreConfig config;
  config.data_dir = dir.path();
  const auto store = std::move(*Store::open(config));
  std::mt19937 random(3);
  const auto draw = [&random](std::size_t count) { return random() % count; };
  for (int i = 0; i < 120; ++i) {
    NewJob job;
    job.kind = draw(4) == 0 ? "verify" : "colony";
    job.name = draw(3) == 0 ? "value" : "name";  // the columns of labels are called so, too
    job.labels["all"] = "1";
    if (draw(3) == 0) job.labels["third"] = "yes";
    if (draw(10) == 0) job.labels["state"] = "queued";
    job.spec_json = "{}";
    const auto made = store->create_job(job, 1000);
    ASSERT_TRUE(made);
    const bool is_cancelled = draw(3) == 0;
    if (is_cancelled) {
      ASSERT_TRUE(store->command_job(made->job.job_key, JobCommand::kCancel));
    }
    if (is_cancelled && draw(8) == 0) {
      ASSERT_TRUE(store->delete_job(made->job.job_key));
    }
  }
  const auto all = store->list_jobs({}, 1000, "");
  ASSERT_TRUE(all);
  ASSERT_GT(all->items.size(), 80U);
  for (int round = 0; round < 300; ++round) {
    JobFilter filter;
    if (draw(2) == 0) filter.state = draw(2) == 0 ? JobState::kQueued : JobState::kCancelled;
    if (draw(3) == 0) filter.kind = draw(2) == 0 ? "verify" : "colony";
    if (draw(3) == 0) filter.name = draw(2) == 0 ? "name" : "value";
    if (draw(2) == 0) filter.labels.emplace_back("all", "1");
    if (draw(3) == 0) filter.labels.emplace_back("third", draw(4) == 0 ? "no" : "yes");
    if (draw(4) == 0) filter.labels.emplace_back("state", "queued");
    std::vector<std::string> expected, seen;
    for (const JobRow& job : all->items) {
      if (fits(job, filter)) expected.push_back(job.id);
    }
    std::string cursor;
    do {
      const auto page = store->list_jobs(filter, 1 + draw(20), cursor);
      ASSERT_TRUE(page) << page.error().message;
      for (const JobRow& job : page->items) seen.push_back(job.id);
      cursor = page->next.value_or("");
    } while (!cursor.empty());
    ASSERT_EQ(seen, expected) << "round " << round;
  }
}

}  // namespace
}  // namespace colony::server
