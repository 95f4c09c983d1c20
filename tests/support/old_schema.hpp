// old_schema: takes a database of this version back to an earlier one, so that migrations can be tried on it.
// A new version of the schema needs one more step here.
#pragma once

#include <string>

#include "server/store/connection.hpp"

namespace colony::tests {

/// `path` of a closed database of the newest schema; `version` 1 to the newest.
inline void take_back_to(const std::string& path, int version) {
  server::Connection old(path, server::Connection::Access::kWriter);
  if (version < 4) {
    old.execute(
        "DROP TABLE token; ALTER TABLE job DROP COLUMN origin; ALTER TABLE job DROP COLUMN result;"
        "ALTER TABLE job_log DROP COLUMN actor; DROP INDEX job_by_kind");
  }
  if (version < 3) old.execute("DROP TABLE analysis; DROP TABLE analysis_image");
  if (version < 2) {
    old.execute(
        "DROP TABLE cell_event; ALTER TABLE job DROP COLUMN indexed_seq;"
        "CREATE INDEX event_by_cell ON event (job_key, cell_id, seq);"
        "CREATE INDEX placement_by_cell ON placement (job_key, cell_id, seq)");
  }
  old.execute("PRAGMA user_version = " + std::to_string(version));
  old.checkpoint(true);
}

}  // namespace colony::tests
