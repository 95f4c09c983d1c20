// codec_event: cells, events, jobs and the growth curve as JSON, with the names of the HTTP interface.
// Promise: every double round-trips; every member is always present, null where there is nothing to say.
// Threads: pure.
#pragma once

#include "engine/analysis/series.hpp"
#include "engine/model/cell.hpp"
#include "engine/model/event.hpp"
#include "server/api/columns.hpp"
#include "server/api/json.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::api {

Json encode_field(const Field& field);

template <class Row>
Json encode_row(std::span<const Column<Row>> columns, const Row& row) {
  Json out = Json::object();
  auto& members = out.template get_ref<Json::object_t&>();
  members.reserve(columns.size());
  for (const Column<Row>& column : columns) members.emplace(std::string(column.name), encode_field(column.get(row)));
  return out;
}

Json encode_cell(const Cell& cell);
Json encode_event(const Event& event);
Json encode_progress(const Progress& progress);
/// `base_path`: what the links begin with.
Json encode_job(const JobView& view, std::string_view base_path);
/// The text of encode_job. Its spec is not read: it is stored in the form in which it is answered.
void append_job_text(std::string& out, const JobView& view, std::string_view base_path);
Json encode_log_row(const LogRow& row);

}  // namespace colony::server::api
