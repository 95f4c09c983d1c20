#include "server/api/lineage.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include "engine/base/check.hpp"
#include "server/api/streams.hpp"

namespace colony::server::api {
namespace {

// Plain digits: an exponent is no number to some readers of the format.
void append_length(std::string& out, double length_h) {
  char text[400];
  out.append(text, std::to_chars(text, text + sizeof text, length_h, std::chars_format::fixed).ptr);
}

}  // namespace

void Lineage::born(CellId id, std::uint32_t parent, double time_h) {
  CHECK(id.value == born_h_.size() + 1);
  CHECK(parent < id.value);
  CHECK(born_h_.empty() || time_h >= born_h_.back());
  parent_.push_back(parent);
  last_daughter_.push_back(0);
  born_h_.push_back(time_h);
  before_.push_back(parent == 0 ? 0 : std::exchange(last_daughter_[parent - 1], id.value));
  if (parent == 0) founders_.push_back(id.value);
}

void Lineage::add(const Event& event) {
  if (const auto* const founded = std::get_if<Founded>(&event.body)) {
    born(founded->cell.id, 0, event.time_h);
  } else if (const auto* const divided = std::get_if<Divided>(&event.body)) {
    CHECK(divided->cells[0].id.value >= 1);
    born(divided->cells[1].id, divided->cells[0].id.value, event.time_h);
  }
}

NewickSource::NewickSource(Lineage lineage, double time_h) : lineage_(std::move(lineage)), time_h_(time_h) {}

// A cell with divisions d1 < d2 < ... is ((((leaf), d3), d2), d1): its earliest division is the outermost node.
void NewickSource::open(std::string& out, CellId id) {
  const CellId last = lineage_.last_daughter(id);
  for (CellId daughter = last; daughter.value != 0; daughter = lineage_.daughter_before(daughter)) out += '(';
  out += std::to_string(id.value) + ":";
  append_length(out, time_h_ - (last.value == 0 ? lineage_.born_h(id) : lineage_.born_h(last)));
  stack_.push_back({id, last, false});
}

http::BodySource::Pull NewickSource::pull(std::string& out) {
  const std::size_t full = out.size() + kPieceBytes;
  while (out.size() < full) {
    if (stack_.empty()) {
      if (next_founder_ == lineage_.founders().size()) return Pull::kEnd;
      open(out, CellId{lineage_.founders()[next_founder_++]});
      continue;
    }
    Frame& top = stack_.back();
    const CellId daughter = top.daughter;
    if (daughter.value == 0) {
      stack_.pop_back();
      if (stack_.empty()) out += ";\n";
    } else if (!top.is_inside) {
      out += ',';
      top.is_inside = true;
      open(out, daughter);  // `top` may be elsewhere from here on
    } else {
      const CellId before = lineage_.daughter_before(daughter);
      out += "):";
      append_length(out, lineage_.born_h(daughter) - lineage_.born_h(before.value == 0 ? top.cell : before));
      top.daughter = before;
      top.is_inside = false;
    }
  }
  return Pull::kMore;
}

LineageTableSource::LineageTableSource(Lineage lineage, std::shared_ptr<const Colony> colony, const Json& facts)
    : lineage_(std::move(lineage)), colony_(std::move(colony)), head_(to_text(facts)) {
  CHECK(lineage_.size() == colony_->cells().size());
  head_.back() = ',';
  head_ += "\"items\":[";
}

http::BodySource::Pull LineageTableSource::pull(std::string& out) {
  const std::size_t full = out.size() + kPieceBytes;
  out += std::exchange(head_, {});
  std::vector<std::uint32_t> daughters;
  for (; next_ <= lineage_.size() && out.size() < full; ++next_) {
    const CellId id{next_};
    const Cell& cell = colony_->cell(id);
    const CellId parent = lineage_.parent(id);
    daughters.clear();
    for (CellId at = lineage_.last_daughter(id); at.value != 0; at = lineage_.daughter_before(at)) {
      daughters.push_back(at.value);
    }
    std::reverse(daughters.begin(), daughters.end());
    if (next_ > 1) out += ',';
    out += to_text({{"cell_id", id.value},
                    {"parent_id", parent.value == 0 ? Json(nullptr) : Json(parent.value)},
                    {"born_h", lineage_.born_h(id)},
                    {"generation", cell.generation},
                    {"activity", name_of(cell.activity)},
                    {"daughter_ids", daughters}});
  }
  if (next_ <= lineage_.size()) return Pull::kMore;
  out += "],\"next\":null}";
  return Pull::kEnd;
}

Result<Lineage> read_lineage(JobService& jobs, const std::string& id, std::uint64_t last_seq, StopFlag stop) {
  Lineage lineage;
  EventFilter filter;
  filter.kinds = {EventKind::kFounded, EventKind::kDivided};
  for (;;) {
    throw_if_stopped(stop);
    const auto page = jobs.events(id, filter, kEventsPerRead);
    if (!page) return page.error();
    for (const Event& event : *page) {
      if (event.seq > last_seq) return lineage;
      lineage.add(event);
      filter.after = event.seq;
    }
    if (page->size() < kEventsPerRead) return lineage;
  }
}

}  // namespace colony::server::api
