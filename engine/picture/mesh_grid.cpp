#include "engine/picture/mesh_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/picture/column.hpp"
#include "engine/picture/mesh_tetrahedron.hpp"
#include "engine/picture/pixels.hpp"

namespace colony {
namespace {

constexpr std::int64_t kTileNodes = kTileCubes + 1;
// A vertex keeps off the ends of its edge, so that triangles have an area.
constexpr double kEndShare = 0.02;
constexpr int kRootSteps = 5;
constexpr double kSlopeStep_um = 1e-3;  // of the differences that give a normal

/// A simplex: corners base + mask; key = place of the base, then the masks.
struct Corner {
  std::int64_t x, y, z;
  Corner plus(unsigned mask) const { return {x + (mask & 1U), y + ((mask >> 1) & 1U), z + ((mask >> 2) & 1U)}; }
};
std::uint64_t key_of(const Corner& base, unsigned first, unsigned second) {
  return ((static_cast<std::uint64_t>(base.x) << 34 | static_cast<std::uint64_t>(base.y) << 10 |
           static_cast<std::uint64_t>(base.z))
          << 6) |
         first << 3 | second;
}
std::uint64_t edge_key(const Corner& base, unsigned mask) { return key_of(base, mask, 0); }
std::uint64_t face_key(const Corner& base, unsigned first, unsigned second) { return key_of(base, first, second); }
/// Masks swapped: a face has the smaller set first.
std::uint64_t middle_key(const Corner& base, unsigned first, unsigned second) { return key_of(base, second, first); }

/// A body as a tile needs it.
struct TileBody {
  std::uint32_t id;
  ColumnScan scan;
  Box box;
  TileBody(const Colony& colony, CellId cell_id)
      : id(cell_id.value), scan(colony.body(cell_id)), box(colony.body(cell_id).box()) {}
  bool may_hold(const Vec3& p) const {
    return p.x() >= box.low.x() && p.x() <= box.high.x() && p.y() >= box.low.y() && p.y() <= box.high.y() &&
           p.z() <= box.high.z();
  }
  double field(const Vec3& p) const { return scan.column(p.x(), p.y()).field(p.z()); }
};

class TileWork {
 public:
  TileWork(const Colony& colony, ContactRule rule, const MeshGrid& grid, const TileCells& cells)
      : rule_(rule), grid_(grid), x0_(cells.x * kTileCubes), y0_(cells.y * kTileCubes) {
    bodies_.reserve(cells.ids.size());
    for (const CellId id : cells.ids) bodies_.emplace_back(colony, id);
    label_nodes();
  }

  std::uint32_t label(const Corner& c) const { return labels_[index(c)]; }

  /// visit(base, masks, labels) for every tetrahedron of the tile whose corners differ.
  template <class Visit>
  void for_each_mixed(const Visit& visit) const;

  Vec3 edge_point(const Corner& p, const Corner& q) const;
  /// The cell at one end of the edge from which it leads out (the lower id of two), and the normal out of it at a point
  /// of the border.
  std::uint32_t inside_of(const Corner& p, const Corner& q) const { return leads_back(p, q) ? label(q) : label(p); }
  Vec3 normal_at(const Corner& p, const Corner& q, const Vec3& point_um) const;

 private:
  std::size_t index(const Corner& c) const {
    return static_cast<std::size_t>(((c.z * kTileNodes) + (c.y - y0_)) * kTileNodes + (c.x - x0_));
  }
  bool leads_back(const Corner& p, const Corner& q) const {
    return label(p) == 0 || (label(q) != 0 && label(q) < label(p));
  }
  Vec3 place(const Corner& c) const { return grid_.position_um(c.x, c.y, c.z); }
  void label_nodes();
  const TileBody& body(std::uint32_t id) const {
    const auto found = std::lower_bound(bodies_.begin(), bodies_.end(), id,
                                        [](const TileBody& b, std::uint32_t value) { return b.id < value; });
    return *found;
  }
  /// What decides between label a (>= 0) and b (< 0).
  double difference(std::uint32_t a, std::uint32_t b, const Vec3& p) const;

  ContactRule rule_;
  const MeshGrid& grid_;
  std::int64_t x0_, y0_;
  std::vector<TileBody> bodies_;
  std::vector<std::uint32_t> labels_;
};

void TileWork::label_nodes() {
  const auto count = static_cast<std::size_t>(kTileNodes * kTileNodes * grid_.levels);
  labels_.assign(count, 0);
  std::vector<double> most(count, -1.0), sum(count, 0.0);
  for (const TileBody& b : bodies_) {
    const auto nodes = [](double low_um, double high_um, double origin_um, double pitch_um, std::int64_t begin,
                          std::int64_t end) {
      const double low =
          std::clamp((low_um - origin_um) / pitch_um, static_cast<double>(begin), static_cast<double>(end));
      const double high =
          std::clamp((high_um - origin_um) / pitch_um, static_cast<double>(begin - 1), static_cast<double>(end - 1));
      return std::pair(ceil_to_int(low), floor_to_int(high) + 1);
    };
    const Vec3 origin = grid_.position_um(0, 0, 0);
    const auto [x_begin, x_end] =
        nodes(b.box.low.x(), b.box.high.x(), origin.x(), grid_.pitch_um, x0_, x0_ + kTileNodes);
    const auto [y_begin, y_end] =
        nodes(b.box.low.y(), b.box.high.y(), origin.y(), grid_.pitch_um, y0_, y0_ + kTileNodes);
    const auto [z_begin, z_end] = nodes(b.box.low.z(), b.box.high.z(), origin.z(), grid_.pitch_z_um(), 1, grid_.levels);
    for (std::int64_t y = y_begin; y < y_end; ++y) {
      for (std::int64_t x = x_begin; x < x_end; ++x) {
        const Vec3 foot = grid_.position_um(x, y, 0);
        const Column column = b.scan.column(foot.x(), foot.y());
        for (std::int64_t z = z_begin; z < z_end; ++z) {
          const double field = column.field(grid_.position_um(x, y, z).z());
          if (!(field >= 0.0)) continue;
          const std::size_t at = index({x, y, z});
          sum[at] += field;
          if (!(field > most[at])) continue;  // a tie stays with the lower id
          most[at] = field;
          labels_[at] = b.id;
        }
      }
    }
  }
  if (rule_ == ContactRule::kMax) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (labels_[i] != 0 && !(most[i] - (sum[i] - most[i]) >= 0.0)) labels_[i] = 0;  // a void
  }
}

template <class Visit>
void TileWork::for_each_mixed(const Visit& visit) const {
  constexpr std::array<std::array<unsigned, 2>, 6> kChains = {{{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}}};
  for (std::int64_t z = 0; z + 1 < grid_.levels; ++z) {
    for (std::int64_t y = y0_; y < y0_ + kTileCubes; ++y) {
      for (std::int64_t x = x0_; x < x0_ + kTileCubes; ++x) {
        const Corner base{x, y, z};
        std::array<std::uint32_t, 8> at{};
        bool mixed = false;
        for (unsigned mask = 0; mask < 8; ++mask) {
          at[mask] = label(base.plus(mask));
          mixed = mixed || at[mask] != at[0];
        }
        if (!mixed) continue;
        for (const auto& [first, second] : kChains) {
          if (at[0] == at[first] && at[0] == at[second] && at[0] == at[7]) continue;
          visit(base, std::array<unsigned, 4>{0, first, second, 7},
                std::array<std::uint32_t, 4>{at[0], at[first], at[second], at[7]});
        }
      }
    }
  }
}

double TileWork::difference(std::uint32_t a, std::uint32_t b, const Vec3& p) const {
  const double own = body(a).field(p);
  if (b != 0) return own - body(b).field(p);
  double taken = 0.0;
  for (const TileBody& other : bodies_) {
    if (other.id == a || !other.may_hold(p)) continue;
    const double field = other.field(p);
    if (field > 0.0) taken = rule_ == ContactRule::kSum ? taken + field : std::max(taken, field);
  }
  return own - taken;
}

Vec3 TileWork::edge_point(const Corner& p, const Corner& q) const {
  // From a cell to another or to nothing; always in the same direction, whoever asks.
  const bool turned = leads_back(p, q);
  const Corner& from = turned ? q : p;
  const Corner& to = turned ? p : q;
  const std::uint32_t a = label(from), b = label(to);
  const Vec3 start = place(from);
  Vec3 end = place(to);
  double share_max = 1.0;
  if (end.z() < 0.0) {
    share_max = start.z() / (start.z() - end.z());
    end = start + share_max * (end - start);
    end.z() = 0.0;
    if (difference(a, b, end) >= 0.0) return end;
  }
  double in = 0.0, out = 1.0;
  double in_value = difference(a, b, start), out_value = difference(a, b, end);
  for (int step = 0; step < kRootSteps && in_value > 0.0 && out_value < 0.0; ++step) {
    // False position; the middle in turn, since f may bend at a third cell.
    const double guess = step == 2 ? 0.5 * (in + out) : in + (out - in) * (in_value / (in_value - out_value));
    const double value = difference(a, b, start + guess * (end - start));
    if (value >= 0.0) {
      in = guess, in_value = value;
    } else {
      out = guess, out_value = value;
    }
  }
  const double root = in_value > 0.0 && out_value < 0.0 ? in + (out - in) * (in_value / (in_value - out_value))
                                                        : (in_value > 0.0 ? out : in);
  return start + std::clamp(root, kEndShare, 1.0 - kEndShare) * (end - start);
}

Vec3 TileWork::normal_at(const Corner& p, const Corner& q, const Vec3& point_um) const {
  if (!(point_um.z() > 0.0)) return {0.0, 0.0, -1.0};  // the dish
  const std::uint32_t inside = inside_of(p, q);
  const std::uint32_t outside = inside == label(p) ? label(q) : label(p);
  Vec3 slope;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 step = Vec3::Zero();
    step[axis] = kSlopeStep_um;
    slope[axis] = difference(inside, outside, point_um - step) - difference(inside, outside, point_um + step);
  }
  const double length = std::sqrt(slope.squaredNorm());
  return length > 0.0 ? Vec3(slope / length) : Vec3(0.0, 0.0, 1.0);
}

/// Corners of a `Between`, in the order of the chain.
struct Chain {
  int size = 0;
  std::array<unsigned, 4> masks{};
};
Chain chain_of(Between set, const std::array<unsigned, 4>& masks) {
  Chain chain;
  for (int i = 0; i < 4; ++i) {
    if ((set & corner_bit(i)) != 0) chain.masks[chain.size++] = masks[i];
  }
  return chain;
}

std::uint64_t vertex_key(const Corner& base, const Chain& chain) {
  const Corner first = base.plus(chain.masks[0]);
  const unsigned m0 = chain.masks[0];
  if (chain.size == 2) return edge_key(first, chain.masks[1] ^ m0);
  if (chain.size == 3) return face_key(first, chain.masks[1] ^ m0, chain.masks[2] ^ m0);
  return middle_key(first, chain.masks[1], chain.masks[2]);
}

/// The mean of the points on all edges of the simplex whose ends differ, in the chain's order.
Vec3 vertex_position(const TileWork& tile, const Corner& base, const Chain& chain) {
  Vec3 sum = Vec3::Zero();
  double n = 0.0;
  for (int i = 0; i < chain.size; ++i) {
    for (int j = i + 1; j < chain.size; ++j) {
      sum += tile.edge_point(base.plus(chain.masks[i]), base.plus(chain.masks[j]));
      n += 1.0;
    }
  }
  return sum / n;
}

}  // namespace

std::uint64_t count_part_triangles(const Colony& colony, ContactRule rule, const MeshGrid& grid,
                                   const TileCells& cells) {
  const TileWork tile(colony, rule, grid, cells);
  std::uint64_t count = 0;
  std::array<Polygon, 6> polygons{};
  tile.for_each_mixed([&](const Corner&, const std::array<unsigned, 4>&, const std::array<std::uint32_t, 4>& labels) {
    const int n = polygons_of(labels, polygons);
    for (int i = 0; i < n; ++i) {
      const bool shared = labels[polygons[i].a] != 0 && labels[polygons[i].b] != 0;
      count += static_cast<std::uint64_t>((polygons[i].size - 2) * (shared ? 2 : 1));
    }
  });
  return count;
}

BorderTile border_of_tile(const Colony& colony, ContactRule rule, const MeshGrid& grid, const TileCells& cells) {
  const TileWork tile(colony, rule, grid, cells);
  struct Use {
    std::uint64_t key;
    Corner base;
    Chain chain;
  };
  struct Piece {
    std::uint32_t a, b;
    std::array<std::uint64_t, 3> keys;
  };
  std::vector<Use> uses;
  std::vector<Piece> pieces;
  std::array<Polygon, 6> polygons{};
  tile.for_each_mixed(
      [&](const Corner& base, const std::array<unsigned, 4>& masks, const std::array<std::uint32_t, 4>& labels) {
        const int n = polygons_of(labels, polygons);
        for (int i = 0; i < n; ++i) {
          Polygon polygon = polygons[i];
          if (!faces_b(polygon, masks)) std::swap(polygon.a, polygon.b);
          std::array<std::uint64_t, 4> keys{};
          for (int v = 0; v < polygon.size; ++v) {
            const Chain chain = chain_of(polygon.vertices[v], masks);
            keys[v] = vertex_key(base, chain);
            uses.push_back({keys[v], base, chain});
          }
          for (int v = 2; v < polygon.size; ++v) {
            pieces.push_back({labels[polygon.a], labels[polygon.b], {keys[0], keys[v - 1], keys[v]}});
          }
        }
      });
  std::sort(uses.begin(), uses.end(), [](const Use& l, const Use& r) { return l.key < r.key; });
  BorderTile border;
  for (std::size_t i = 0; i < uses.size(); ++i) {
    if (i > 0 && uses[i].key == uses[i - 1].key) continue;
    // Every use of a key names the same corners: which one is taken cannot matter.
    const Vec3 p = vertex_position(tile, uses[i].base, uses[i].chain);
    border.keys.push_back(uses[i].key);
    Vec3 normal = Vec3::Zero();
    std::uint32_t inside = 0;
    if (uses[i].chain.size == 2) {
      const Corner from = uses[i].base.plus(uses[i].chain.masks[0]), to = uses[i].base.plus(uses[i].chain.masks[1]);
      inside = tile.inside_of(from, to);
      normal = tile.normal_at(from, to, p);
    }
    border.inside.push_back(inside);
    for (int axis = 0; axis < 3; ++axis) {
      border.positions_um.push_back(static_cast<float>(p[axis]));
      border.normals.push_back(static_cast<float>(normal[axis]));
    }
  }
  border.triangles.reserve(pieces.size());
  for (const Piece& piece : pieces) {
    BorderTriangle triangle{piece.a, piece.b, {}};
    for (int v = 0; v < 3; ++v) {
      const auto found =
          std::lower_bound(border.keys.begin(), border.keys.end(), piece.keys[static_cast<std::size_t>(v)]);
      triangle.vertex[v] = static_cast<std::uint32_t>(found - border.keys.begin());
    }
    border.triangles.push_back(triangle);
  }
  return border;
}

}  // namespace colony
