#include "tests/bench/load_jobs.hpp"

#include <atomic>
#include <stdexcept>
#include <thread>

#include "server/api/codec_spec.hpp"
#include "server/store/store.hpp"

namespace colony::bench {
namespace {

constexpr std::size_t kWriters = 128;  // who waits for a commit shares it
constexpr std::size_t kPaused = 100, kVerify = 100, kNames = 100, kBatches = 1000;

template <class Value>
Value expect(Result<Value> result) {
  if (!result) throw std::runtime_error("the store: " + result.error().message);
  return std::move(*result);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> make_jobs(const std::string& data, std::size_t count) {
  server::StoreConfig config;
  config.data_dir = data;
  const auto store = expect(server::Store::open(config));
  const auto body = server::api::parse_json(R"({"until": {"cells": 1000}, "model": {"cycle": {"mean_h": 14}}})");
  const auto spec = expect(server::api::decode_spec(*body, server::api::SpecLimits{}));
  const server::NewJob sample = server::api::new_job(spec);
  const auto make = [&](std::size_t i) {
    server::NewJob job = sample;
    job.name = "colony " + std::to_string(i % kNames);
    job.labels = {{"project", "bench"}, {"batch", std::to_string(i % kBatches)}};
    if (i >= kPaused && i < kPaused + kVerify) job.kind = "verify";
    const auto made = expect(store->create_job(job, count));
    (void)expect(
        store->command_job(made.job.job_key, i < kPaused ? server::JobCommand::kPause : server::JobCommand::kCancel));
  };
  // The oldest ones in their order; then in that of whoever comes first.
  const std::size_t ordered = kPaused + kVerify;
  for (std::size_t i = 0; i < ordered; ++i) make(i);
  std::atomic<std::size_t> next{ordered};
  std::vector<std::thread> writers;
  for (std::size_t k = 0; k < kWriters; ++k) {
    writers.emplace_back([&] {
      for (std::size_t i; (i = next++) < count;) make(i);
    });
  }
  for (std::thread& writer : writers) writer.join();

  std::string middle;
  for (std::size_t passed = 0; passed < count / 2;) {
    const auto page = expect(store->list_jobs({}, 1000, middle));
    passed += page.items.size();
    middle = page.next.value();
  }
  const std::string all = "/v1/jobs?", half = "cursor=" + middle;
  return {{"first page", all},
          {"first page of 500", all + "limit=500"},
          {"middle page", all + half},
          {"middle page of 500", all + "limit=500&" + half},
          {"state of most", all + "state=cancelled"},
          {"state of most, from the middle", all + "state=cancelled&" + half},
          {"state of the oldest 100", all + "state=paused"},
          {"state of none", all + "state=failed"},
          {"name of 1 %", all + "name=colony%207"},
          {"name of none", all + "name=other"},
          {"kind of 0.1 %", all + "kind=verify"},
          {"kind of most", all + "kind=colony"},
          {"label of all", all + "label=project:bench"},
          {"label of all, from the middle", all + "label=project:bench&" + half},
          {"label of 0.1 %", all + "label=batch:77"},
          {"label of none", all + "label=batch:none"},
          {"two labels", all + "label=project:bench&label=batch:77"},
          {"label of all and state of the oldest", all + "label=project:bench&state=paused"},
          {"name of 1 % and state of the oldest", all + "name=colony%207&state=paused"},
          {"label of all and state of none", all + "label=project:bench&state=failed"},
          {"label of all and kind of 0.1 %", all + "label=project:bench&kind=verify"},
          {"counts", "/v1/jobs/counts"}};
}

}  // namespace colony::bench
