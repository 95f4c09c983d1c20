#include "server/store/schema.hpp"

#include <array>
#include <string>

namespace colony::server {
namespace {

constexpr int kWriterCache_KiB = 65'536;
constexpr std::int64_t kApplicationId = 0x436F6C79;  // "Coly"

// Histories are clustered by (job_key, seq): a page of events is one range of one tree. No foreign keys: a big history is
// deleted in pieces by the sweeper, and a cascade would make one long transaction of it.
constexpr const char* kVersion1 = R"sql(
CREATE TABLE meta (name TEXT PRIMARY KEY, value INTEGER NOT NULL) STRICT, WITHOUT ROWID;
CREATE TABLE job (
  job_key INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  kind TEXT NOT NULL,
  name TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'paused', 'succeeded', 'failed', 'cancelled')),
  reason TEXT NOT NULL,
  detail TEXT NOT NULL,
  command TEXT CHECK (command IN ('cancel', 'pause')),
  submitted_by TEXT NOT NULL,
  created_at TEXT NOT NULL,
  started_at TEXT,
  finished_at TEXT,
  revision INTEGER NOT NULL,
  last_seq INTEGER NOT NULL,
  digest BLOB NOT NULL,
  engine_version TEXT NOT NULL,
  spec TEXT NOT NULL,
  until_time_h REAL,
  until_cells INTEGER,
  time_h REAL NOT NULL,
  cell_count INTEGER NOT NULL,
  active_count INTEGER NOT NULL,
  passive_count INTEGER NOT NULL,
  senescent_count INTEGER NOT NULL,
  deleted INTEGER NOT NULL DEFAULT 0
) STRICT;
CREATE INDEX job_by_state ON job (state, job_key) WHERE deleted = 0;
CREATE INDEX job_by_name ON job (name, job_key) WHERE deleted = 0;
CREATE INDEX job_deleted ON job (job_key) WHERE deleted = 1;
CREATE TABLE label (
  job_key INTEGER NOT NULL,
  name TEXT NOT NULL,
  value TEXT NOT NULL,
  PRIMARY KEY (job_key, name)
) STRICT, WITHOUT ROWID;
CREATE INDEX label_by_value ON label (name, value, job_key);
CREATE TABLE idempotency (
  submitted_by TEXT NOT NULL,
  key TEXT NOT NULL,
  body_hash TEXT NOT NULL,
  job_key INTEGER NOT NULL,
  PRIMARY KEY (submitted_by, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX idempotency_by_job ON idempotency (job_key);
CREATE TABLE event (
  job_key INTEGER NOT NULL,
  seq INTEGER NOT NULL,
  time_h REAL NOT NULL,
  kind TEXT NOT NULL,
  cell_id INTEGER,
  digest BLOB NOT NULL,
  plane_x_um REAL, plane_y_um REAL, plane_z_um REAL,
  normal_x REAL, normal_y REAL, normal_z REAL,
  direction_x REAL, direction_y REAL, direction_z REAL,
  fitness REAL,
  evaluation_count INTEGER,
  corrected INTEGER,
  free_share REAL,
  try_count INTEGER,
  nucleus_x_um REAL, nucleus_y_um REAL, nucleus_z_um REAL,
  nearest_membrane_x_um REAL, nearest_membrane_y_um REAL, nearest_membrane_z_um REAL,
  deformed_volume_um3 REAL,
  due_h REAL,
  reason TEXT,
  cell_count INTEGER,
  PRIMARY KEY (job_key, seq)
) STRICT, WITHOUT ROWID;
CREATE INDEX event_by_cell ON event (job_key, cell_id, seq);
CREATE TABLE placement (
  job_key INTEGER NOT NULL,
  seq INTEGER NOT NULL,
  slot INTEGER NOT NULL,
  cell_id INTEGER NOT NULL,
  parent_id INTEGER,
  generation INTEGER NOT NULL,
  ordinal INTEGER NOT NULL,
  activity TEXT NOT NULL,
  x_um REAL NOT NULL, y_um REAL NOT NULL, z_um REAL NOT NULL,
  nucleus_x_um REAL NOT NULL, nucleus_y_um REAL NOT NULL, nucleus_z_um REAL NOT NULL,
  nucleus_radius_um REAL NOT NULL,
  a_um REAL NOT NULL, b_um REAL NOT NULL, c_um REAL NOT NULL,
  w1_rad REAL NOT NULL, w2_rad REAL NOT NULL, w3_rad REAL NOT NULL,
  noise_u REAL NOT NULL, noise_v REAL NOT NULL, noise_w REAL NOT NULL,
  born_h REAL NOT NULL,
  due_h REAL,
  settle_due_h REAL,
  move_due_h REAL,
  free_share REAL,
  try_count INTEGER NOT NULL,
  volume_um3 REAL NOT NULL,
  deformed_volume_um3 REAL,
  nearest_membrane_x_um REAL, nearest_membrane_y_um REAL, nearest_membrane_z_um REAL,
  PRIMARY KEY (job_key, seq, slot)
) STRICT, WITHOUT ROWID;
CREATE INDEX placement_by_cell ON placement (job_key, cell_id, seq);
CREATE TABLE woken (
  job_key INTEGER NOT NULL,
  seq INTEGER NOT NULL,
  slot INTEGER NOT NULL,
  cell_id INTEGER NOT NULL,
  free_share REAL NOT NULL,
  due_h REAL NOT NULL,
  PRIMARY KEY (job_key, seq, slot)
) STRICT, WITHOUT ROWID;
CREATE TABLE series (
  job_key INTEGER NOT NULL,
  time_h REAL NOT NULL,
  cell_count INTEGER NOT NULL,
  active_count INTEGER NOT NULL,
  passive_count INTEGER NOT NULL,
  senescent_count INTEGER NOT NULL,
  volume_mean_um3 REAL NOT NULL,
  volume_sd_um3 REAL NOT NULL,
  radius_um REAL NOT NULL,
  area_um2 REAL NOT NULL,
  density_per_mm2 REAL NOT NULL,
  PRIMARY KEY (job_key, time_h)
) STRICT, WITHOUT ROWID;
CREATE TABLE job_log (
  job_key INTEGER NOT NULL,
  line INTEGER NOT NULL,
  at TEXT NOT NULL,
  level TEXT NOT NULL,
  message TEXT NOT NULL,
  PRIMARY KEY (job_key, line)
) STRICT, WITHOUT ROWID;
INSERT INTO meta VALUES ('cursor_salt', random()), ('writable_probe', 0);
)sql";

// Two indexes by cell become one table that is written in large sorted pieces (cell_index.hpp).
constexpr const char* kVersion2 = R"sql(
DROP INDEX event_by_cell;
DROP INDEX placement_by_cell;
CREATE TABLE cell_event (
  job_key INTEGER NOT NULL,
  cell_id INTEGER NOT NULL,
  seq INTEGER NOT NULL,
  PRIMARY KEY (job_key, cell_id, seq)
) STRICT, WITHOUT ROWID;
ALTER TABLE job ADD COLUMN indexed_seq INTEGER NOT NULL DEFAULT 0;
INSERT INTO cell_event SELECT job_key, cell_id, seq FROM
  (SELECT job_key, cell_id, seq FROM event WHERE cell_id IS NOT NULL UNION SELECT job_key, cell_id, seq FROM placement)
  ORDER BY job_key, cell_id, seq;
UPDATE job SET indexed_seq = last_seq;
)sql";

// The image has a table of its own: it is megabytes, and lists of analyses never look at it.
constexpr const char* kVersion3 = R"sql(
CREATE TABLE analysis (
  analysis_key INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  kind TEXT NOT NULL CHECK (kind IN ('analysis', 'comparison')),
  name TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed')),
  failure_code TEXT NOT NULL,
  detail TEXT NOT NULL,
  created_at TEXT NOT NULL,
  finished_at TEXT,
  options TEXT NOT NULL,
  media_type TEXT,
  image_bytes INTEGER NOT NULL,
  job_id TEXT,
  analysis_id TEXT,
  try_count INTEGER NOT NULL,
  result TEXT
) STRICT;
CREATE INDEX analysis_by_kind ON analysis (kind, analysis_key);
CREATE INDEX analysis_waiting ON analysis (state, analysis_key) WHERE state IN ('queued', 'running');
CREATE TABLE analysis_image (
  analysis_key INTEGER PRIMARY KEY,
  bytes BLOB NOT NULL
) STRICT;
)sql";

// Who may ask, where a forked job comes from, what a job of kind `verify` found, and who did what.
constexpr const char* kVersion4 = R"sql(
CREATE TABLE token (
  token_key INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  name TEXT NOT NULL,
  scope TEXT NOT NULL CHECK (scope IN ('read', 'submit', 'admin')),
  secret_hash BLOB NOT NULL UNIQUE,
  created_by TEXT NOT NULL,
  created_at TEXT NOT NULL,
  expires_at TEXT
) STRICT;
ALTER TABLE job ADD COLUMN origin TEXT;
ALTER TABLE job ADD COLUMN result TEXT;
ALTER TABLE job_log ADD COLUMN actor TEXT NOT NULL DEFAULT '';
CREATE INDEX job_by_kind ON job (kind, job_key) WHERE deleted = 0;
)sql";

constexpr std::array<const char*, 4> kMigrations = {kVersion1, kVersion2, kVersion3, kVersion4};  // kMigrations[v] leads from version v to v + 1

std::int64_t pragma(Connection& writer, const char* sql) {
  Statement statement = writer.prepare_once(sql);
  return statement.step() ? statement.integer(0) : 0;
}

}  // namespace

void prepare_database(Connection& writer) {
  const std::int64_t version = pragma(writer, "PRAGMA user_version");
  const std::int64_t application = pragma(writer, "PRAGMA application_id");
  const bool fresh = pragma(writer, "SELECT count(*) FROM sqlite_schema") == 0;
  if (!fresh && application != kApplicationId) {
    throw IncompatibleDatabase("colony.db is a database of another program");
  }
  if (version > static_cast<std::int64_t>(kMigrations.size())) {
    throw IncompatibleDatabase("colony.db has schema version " + std::to_string(version) +
                               ", this program knows up to " + std::to_string(kMigrations.size()));
  }
  Statement mode = writer.prepare_once("PRAGMA journal_mode = WAL");
  if (!mode.step() || mode.text(0) != "wal")
    throw DbError(SQLITE_CANTOPEN, "the file system allows no write-ahead log");
  mode.reset();
  writer.execute("PRAGMA synchronous = FULL");
  // What a large job touches again and again (the ends of its tables, the index by cell) stays in memory.
  writer.execute("PRAGMA cache_size = -" + std::to_string(kWriterCache_KiB));
  for (std::int64_t v = version; v < static_cast<std::int64_t>(kMigrations.size()); ++v) {
    writer.execute("BEGIN IMMEDIATE");
    try {
      writer.execute(kMigrations[static_cast<std::size_t>(v)]);
      writer.execute("PRAGMA application_id = " + std::to_string(kApplicationId));
      writer.execute("PRAGMA user_version = " + std::to_string(v + 1));
      writer.execute("COMMIT");
    } catch (...) {
      if (writer.in_transaction()) writer.execute("ROLLBACK");
      throw;
    }
  }
}

}  // namespace colony::server
