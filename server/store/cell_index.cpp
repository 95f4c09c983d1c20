#include "server/store/cell_index.hpp"

namespace colony::server {
namespace {
constexpr std::int64_t kSweepCells = 200;  // a cell has some tens of rows
}  // namespace

const char* const kSeqsOfCell =
    "SELECT seq FROM cell_event WHERE job_key = ?1 AND cell_id = ?4 AND seq > ?2"
    " UNION SELECT seq FROM event WHERE job_key = ?1 AND cell_id = ?4"
    " AND seq > max(?2, (SELECT indexed_seq FROM job WHERE job_key = ?1))"
    " UNION SELECT seq FROM placement WHERE job_key = ?1 AND cell_id = ?4"
    " AND seq > max(?2, (SELECT indexed_seq FROM job WHERE job_key = ?1))";

void index_cells_if_due(Connection& connection, std::int64_t job_key, std::uint64_t last_seq) {
  Statement& job = connection.prepared("SELECT indexed_seq FROM job WHERE job_key = ?").bind(job_key);
  if (!job.step()) return;
  const std::int64_t indexed = job.integer(0);
  job.reset();
  const auto last = static_cast<std::int64_t>(last_seq);
  if (last - indexed < static_cast<std::int64_t>(kUnindexedEventsMax)) return;
  // UNION sorts by (cell_id, seq), the order of the table: every page is written once.
  connection
      .prepared(
          "INSERT INTO cell_event SELECT ?1, cell_id, seq FROM"
          " (SELECT cell_id, seq FROM event WHERE job_key = ?1 AND seq > ?2 AND seq <= ?3 AND cell_id IS NOT NULL"
          " UNION SELECT cell_id, seq FROM placement WHERE job_key = ?1 AND seq > ?2 AND seq <= ?3)"
          " ORDER BY cell_id, seq")
      .bind(job_key)
      .bind(indexed)
      .bind(last)
      .run();
  connection.prepared("UPDATE job SET indexed_seq = ? WHERE job_key = ?").bind(last).bind(job_key).run();
}

bool sweep_cell_index(Connection& connection, std::int64_t job_key) {
  connection
      .prepared(
          "DELETE FROM cell_event WHERE job_key = ?1"
          " AND cell_id < (SELECT min(cell_id) FROM cell_event WHERE job_key = ?1) + ?2")
      .bind(job_key)
      .bind(kSweepCells)
      .run();
  return connection.changes() > 0;
}

}  // namespace colony::server
