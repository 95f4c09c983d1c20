// lineage: who came from whom, as Newick trees (one a founder) and as a table.
// Meaning: an edge is a cell between two of its divisions; an inner node is a division, whose first subtree is the parent, which keeps
//          its id, and whose second one is the daughter; a leaf is a cell at the time asked for, named by its id. Branch lengths are model
//          hours: from the root to any leaf they add up to the time since the founder was placed.
// Memory:  20 bytes a cell, and a stack on the heap as deep as the tree: a chain of a million divisions is no danger.
// Errors:  CHECKs that events come in order and name known cells.
// Threads: plain data.
// Source:  the format of Archie and others (1986), as read by phylogenetic programs.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/stop.hpp"
#include "engine/model/event.hpp"
#include "server/api/json.hpp"
#include "server/http/message.hpp"
#include "server/jobs/service.hpp"

namespace colony::server::api {

/// Births in the order of cell ids; index = id - 1.
class Lineage {
 public:
  /// Events that are no births are let pass; births must come in order.
  void add(const Event& event);

  std::size_t size() const { return born_h_.size(); }
  CellId parent(CellId id) const { return CellId{parent_[id.value - 1]}; }  // value 0: a founder
  /// When the id came into being: placed, or split off its parent. (Cell::born_h is the last division, of either.)
  double born_h(CellId id) const { return born_h_[id.value - 1]; }
  /// The daughters of a cell from the latest to the first: the latest, and the one before another. Value 0: none.
  CellId last_daughter(CellId id) const { return CellId{last_daughter_[id.value - 1]}; }
  CellId daughter_before(CellId daughter) const { return CellId{before_[daughter.value - 1]}; }
  /// Ascending.
  const std::vector<std::uint32_t>& founders() const { return founders_; }

 private:
  void born(CellId id, std::uint32_t parent, double time_h);

  std::vector<std::uint32_t> parent_;
  std::vector<std::uint32_t> last_daughter_;
  std::vector<std::uint32_t> before_;
  std::vector<double> born_h_;
  std::vector<std::uint32_t> founders_;
};

/// One tree a line, each ended by ';', piece by piece.
class NewickSource : public http::BodySource {
 public:
  /// `time_h`: where the leaves end; not before the last birth.
  NewickSource(Lineage lineage, double time_h);
  Pull pull(std::string& out) override;

 private:
  struct Frame {
    CellId cell;
    CellId daughter;  // whose division comes next, from the latest to the first; value 0: all are written
    bool is_inside;   // its subtree is being written
  };
  void open(std::string& out, CellId id);

  const Lineage lineage_;
  const double time_h_;
  std::size_t next_founder_ = 0;
  std::vector<Frame> stack_;
};

/// The table: an envelope of `facts` with one item a cell.
class LineageTableSource : public http::BodySource {
 public:
  LineageTableSource(Lineage lineage, std::shared_ptr<const Colony> colony, const Json& facts);
  Pull pull(std::string& out) override;

 private:
  const Lineage lineage_;
  const std::shared_ptr<const Colony> colony_;
  std::string head_;
  std::uint32_t next_ = 1;
};

/// The births up to event `last_seq`, read page by page.
Result<Lineage> read_lineage(JobService& jobs, const std::string& id, std::uint64_t last_seq, StopFlag stop);

}  // namespace colony::server::api
