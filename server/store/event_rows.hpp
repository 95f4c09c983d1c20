// event_rows: an event as rows of event, placement and woken, and back. The one place that knows their columns.
// Promise: read(write(event)) == event, every double bit for bit.
// Errors:  DbError. A double that SQLite would change (not finite, or -0.0) is CHECKed before it is written.
// Threads: as the connection.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/analysis/series.hpp"
#include "engine/model/event.hpp"
#include "server/store/connection.hpp"
#include "server/store/store.hpp"

namespace colony::server {

void write_event(Connection& connection, std::int64_t job_key, const Event& event);
/// Rows that write_event makes of it, all tables together.
std::size_t row_count(const Event& event);
/// Up to `limit` events that pass the filter, ascending. Call inside a read transaction.
std::vector<Event> read_events(Connection& connection, std::int64_t job_key, const EventFilter& filter,
                               std::size_t limit);
/// The seq of event number `limit` (from 1) of those that pass the filter, if one more follows it.
std::optional<std::uint64_t> page_end(Connection& connection, std::int64_t job_key, const EventFilter& filter,
                                      std::size_t limit);

void write_series(Connection& connection, std::int64_t job_key, const SeriesRow& row);
std::vector<SeriesRow> read_series(Connection& connection, std::int64_t job_key);

}  // namespace colony::server
