// event_text: events, cells and growth curves as JSON text without a value in between, for streams and lists of hundreds of thousands of them.
// Promise: the same members in the same order as encode_event and encode_cell (a test holds the two together); numbers in the
//          shortest form that round-trips, a double always with a point or an exponent.
// Errors:  CHECKs that doubles are finite, as those of events are.
// Threads: pure.
#pragma once

#include <string>

#include "engine/analysis/series.hpp"
#include "engine/model/cell.hpp"
#include "engine/model/event.hpp"

namespace colony::server::api {

void append_event_text(std::string& out, const Event& event);
void append_cell_text(std::string& out, const Cell& cell);
void append_series_text(std::string& out, const SeriesRow& row);

}  // namespace colony::server::api
