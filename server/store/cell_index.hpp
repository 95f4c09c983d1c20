// cell_index: which events a cell takes part in. Written late and in pieces: an index kept row by row would touch a page of its
// own for nearly every event, twenty times the pages that the events themselves fill.
// Promise: exact at any moment: a question takes the table cell_event up to job.indexed_seq, and looks through what came after.
// Errors:  DbError.        Threads: as the connection.
#pragma once

#include <cstdint>

#include "server/store/connection.hpp"

namespace colony::server {

/// Events of a job that may be stored and not yet indexed. More: fewer pages written; less: fewer rows to look through.
inline constexpr std::uint64_t kUnindexedEventsMax = 32'768;

/// Indexes the events of the job up to `last_seq` if so many wait. Call in the transaction that wrote them.
void index_cells_if_due(Connection& connection, std::int64_t job_key, std::uint64_t last_seq);

/// SQL: the seqs of job ?1 after ?2 that cell ?4 takes part in, as a list of one column.
extern const char* const kSeqsOfCell;

/// Removes a piece of a job's index; false if none is left.
bool sweep_cell_index(Connection& connection, std::int64_t job_key);

}  // namespace colony::server
