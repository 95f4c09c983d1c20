#include "tests/bench/load_jobs.hpp"

#include <stdexcept>

#include "server/api/codec_spec.hpp"
#include "server/store/connection.hpp"
#include "server/store/store.hpp"

namespace colony::bench {
namespace {

// Rows are copies of one that the store has made: a hundred thousand submissions would take longer than all else.
// i is 0 for the oldest.
constexpr const char* kCopies = R"sql(
WITH RECURSIVE number(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM number WHERE i + 1 < COUNT)
INSERT INTO job (id, kind, name, state, reason, detail, submitted_by, created_at, revision, last_seq, digest, engine_version, spec,
    until_time_h, until_cells, time_h, cell_count, active_count, passive_count, senescent_count)
  SELECT printf('01a00000-0000-7000-8000-%012d', i), iif(i BETWEEN 100 AND 199, 'verify', kind), 'colony ' || (i % 100),
      iif(i < 100, 'paused', state), iif(i < 100, 'user', reason), detail, submitted_by, created_at, revision, last_seq, digest,
      engine_version, spec, until_time_h, until_cells, time_h, cell_count, active_count, passive_count, senescent_count
    FROM number, (SELECT * FROM job) AS sample;
INSERT INTO label SELECT job_key, 'project', 'bench' FROM job UNION ALL SELECT job_key, 'batch', job_key % 1000 FROM job;
)sql";

template <class Value>
Value expect(Result<Value> result) {
  if (!result) throw std::runtime_error("the store: " + result.error().message);
  return std::move(*result);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> make_jobs(const std::string& data, std::size_t count) {
  server::StoreConfig config;
  config.data_dir = data;
  {
    const auto store = expect(server::Store::open(config));
    const auto body = server::api::parse_json(R"({"until": {"cells": 1000}, "model": {"cycle": {"mean_h": 14}}})");
    const auto spec = expect(server::api::decode_spec(*body, server::api::SpecLimits{}));
    const auto made = expect(store->create_job(server::api::new_job(spec), 1));
    (void)expect(store->command_job(made.job.job_key, server::JobCommand::kCancel));
  }
  {
    std::string sql = kCopies;
    sql.replace(sql.find("COUNT"), 5, std::to_string(count));
    server::Connection(data + "/colony.db", server::Connection::Access::kWriter).execute(sql);
  }
  const auto store = expect(server::Store::open(config));
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
