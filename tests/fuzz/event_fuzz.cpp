// event_fuzz: an event through everything that writes and reads one: JSON text, the rows of the database, and rows that were tampered with.
// Input:   choices and numbers, read by FuzzedDataProvider.
// Promise checked: strict JSON reads the fast text as what encode_event says; read(write(event)) is the event, bit for bit; a row that no
//                  writer of ours made is refused or read, never a crash.
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <fuzzer/FuzzedDataProvider.h>
#include <iostream>
#include <memory>
#include <string>

#include "server/api/codec_event.hpp"
#include "server/api/event_text.hpp"
#include "server/store/event_rows.hpp"
#include "server/store/schema.hpp"
#include "tests/support/temp_dir.hpp"

namespace {

using namespace colony;
using namespace colony::server;

void require(bool holds) {
  if (!holds) std::abort();
}

class Maker {
 public:
  explicit Maker(FuzzedDataProvider& from) : from_(from) {}

  /// Any finite double, subnormal ones and the ends included.
  double number() {
    const double value = std::bit_cast<double>(from_.ConsumeIntegral<std::uint64_t>());
    return std::isfinite(value) ? value : 0.5;
  }
  Vec3 vector() {
    const double x = number(), y = number(), z = number();
    return {x, y, z};
  }
  CellId cell_id() { return {from_.ConsumeIntegralInRange<std::uint32_t>(1, 4'294'967'295U)}; }
  std::optional<double> maybe() { return from_.ConsumeBool() ? std::optional(number()) : std::nullopt; }
  std::int32_t small() { return from_.ConsumeIntegralInRange<std::int32_t>(0, 2'147'483'647); }

  Cell cell() {
    Cell cell;
    cell.id = cell_id();
    if (from_.ConsumeBool()) cell.parent_id = cell_id();
    cell.generation = small();
    cell.ordinal = from_.ConsumeIntegral<std::uint32_t>();
    cell.try_count = small();
    cell.activity = static_cast<Activity>(from_.ConsumeIntegralInRange(0, 2));
    for (Vec3* vec : {&cell.centre_um, &cell.nucleus_um, &cell.semiaxes_um, &cell.rotation_rad, &cell.noise_offset})
      *vec = vector();
    for (double* value : {&cell.nucleus_radius_um, &cell.born_h, &cell.volume_um3}) *value = number();
    for (auto* value : {&cell.due_h, &cell.settle_due_h, &cell.move_due_h, &cell.free_share, &cell.deformed_volume_um3})
      *value = maybe();
    if (from_.ConsumeBool()) cell.nearest_membrane_um = vector();
    return cell;
  }

  std::vector<Woken> woken() {
    std::vector<Woken> list;
    std::uint32_t id = 0;
    for (int left = from_.ConsumeIntegralInRange(0, 3); left > 0; --left) {
      id += from_.ConsumeIntegralInRange<std::uint32_t>(1, 1'000'000);
      const double share = number(), due_h = number();
      list.push_back({CellId{id}, share, due_h});
    }
    return list;
  }

  EventBody body() {
    switch (static_cast<EventKind>(from_.ConsumeIntegralInRange(0, kEventKindCount - 1))) {
      case EventKind::kFounded:
        return Founded{cell()};
      case EventKind::kDivided: {
        Divided divided;
        divided.cells[0] = cell();
        divided.cells[1] = cell();
        for (Vec3* vec : {&divided.plane_point_um, &divided.plane_normal, &divided.direction}) *vec = vector();
        divided.fitness = number();
        divided.evaluation_count = from_.ConsumeIntegral<std::uint32_t>();
        divided.corrected = from_.ConsumeBool();
        divided.woken = woken();
        return divided;
      }
      case EventKind::kInhibited: {
        Inhibited inhibited;
        inhibited.fitness = number();
        inhibited.free_share = number();
        inhibited.try_count = small();
        inhibited.evaluation_count = from_.ConsumeIntegral<std::uint32_t>();
        inhibited.corrected = from_.ConsumeBool();
        inhibited.due_h = maybe();
        return inhibited;
      }
      case EventKind::kSettled: {
        Settled settled;
        settled.nucleus_um = vector();
        settled.nearest_membrane_um = vector();
        settled.deformed_volume_um3 = number();
        settled.due_h = maybe();
        return settled;
      }
      case EventKind::kMoved: {
        Moved moved;
        moved.cell = cell();
        moved.woken = woken();
        return moved;
      }
      case EventKind::kSenesced:
        return Senesced{};
      case EventKind::kFinished:
        return Finished{static_cast<FinishReason>(from_.ConsumeIntegralInRange(0, 7)),
                        from_.ConsumeIntegralInRange<std::uint64_t>(0, 4'294'967'295U)};
    }
    return Senesced{};
  }

  Event event() {
    Event event;
    event.seq = from_.ConsumeIntegralInRange<std::uint64_t>(1, 1ULL << 53);
    event.time_h = std::fabs(number());
    event.body = body();
    if (!std::holds_alternative<Finished>(event.body)) event.cell_id = cell_id();
    for (std::uint8_t& byte : event.digest.bytes) byte = from_.ConsumeIntegral<std::uint8_t>();
    canonicalise(event);
    return event;
  }

 private:
  FuzzedDataProvider& from_;
};

Connection& database() {
  static const std::unique_ptr<Connection> one = [] {
    static const tests::TempDir
        folder;  // a log needs a file; every transaction is rolled back, so little is ever written
    auto made = std::make_unique<Connection>(folder.path() + "/fuzz.db", Connection::Access::kWriter);
    prepare_database(*made);
    return made;
  }();
  return *one;
}

void check_text(const Event& event) {
  std::string text;
  api::append_event_text(text, event);
  const api::Json defined = api::encode_event(event);
  const auto read = api::parse_json(text);
  if (read && *read == defined && api::to_text(*read) == api::to_text(defined)) return;
  std::cerr << text << "\n" << api::to_text(defined) << "\n" << (read ? "" : read.error().message) << "\n";
  std::abort();
}

/// One column of one table becomes something else; what the schema refuses stays as it was.
void tamper(FuzzedDataProvider& from, Connection& connection) {
  static constexpr std::array<const char*, 15> kColumns = {
      "event SET kind",       "event SET cell_id",        "event SET reason",       "event SET digest",
      "event SET due_h",      "event SET try_count",      "event SET corrected",    "event SET evaluation_count",
      "event SET cell_count", "placement SET cell_id",    "placement SET activity", "placement SET parent_id",
      "placement SET slot",   "placement SET generation", "woken SET cell_id"};
  static constexpr std::array<const char*, 12> kValues = {
      "NULL", "0",     "-1",        "9223372036854775807", "-9223372036854775808", "''", "'moved'", "x'00'",
      "x''",  "9e999", "'divided'", "4294967296"};
  const std::string sql = std::string("UPDATE ") + kColumns[from.ConsumeIntegralInRange<std::size_t>(0, 14)] + " = " +
                          kValues[from.ConsumeIntegralInRange<std::size_t>(0, 11)];
  try {
    connection.execute(sql);
  } catch (const DbError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider from(data, size);
  const Event event = Maker(from).event();
  check_text(event);
  Connection& connection = database();
  connection.execute("BEGIN");
  write_event(connection, 1, event);
  const std::vector<Event> read = read_events(connection, 1, {}, 10);
  require(read.size() == 1 && read[0] == event);
  require(digest_after(event.digest, read[0]) == digest_after(event.digest, event));
  for (int left = from.ConsumeIntegralInRange(0, 2); left > 0; --left) tamper(from, connection);
  try {
    for (const Event& one : read_events(connection, 1, {}, 10)) check_text(one);
  } catch (const std::exception&) {
    // refused
  }
  connection.execute("ROLLBACK");
  return 0;
}
