// colony-picture-bench: grows one colony and times what engine/picture makes of it; each figure stands beside the hash
// of the answer.
//         Last: box counting of cell walls, 4,000 x 4,000 px, 64 offsets, 20 sides, whatever the other options.
// Usage:  colony-picture-bench [--cells N] [--width PX] [--threads T] [--triangles N] [--out DIR]
//         With --out the pictures, the OME-TIFF and the mesh (Wavefront OBJ) are written there, to be looked at.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "engine/analysis/contour.hpp"
#include "engine/analysis/controls.hpp"
#include "engine/analysis/scaling.hpp"
#include "engine/picture/mesh.hpp"
#include "engine/picture/ome_tiff.hpp"
#include "engine/picture/paths.hpp"
#include "engine/picture/render.hpp"
#include "engine/sim/simulator.hpp"

namespace {

using namespace colony;

struct Options {
  std::uint64_t cells = 1000;
  std::int64_t width_px = 2000;
  int threads = 2;
  std::int64_t triangles = 1'000'000;
  std::string out;
};

Simulator grown(const Options& options) {
  RunSpec spec;
  spec.seed = 1;
  spec.params = *preset("paper");
  spec.params.division.generation_limit.reset();
  spec.until.cells = options.cells;
  Simulator simulator(spec, nullptr, options.threads);
  while (simulator.step()) {
  }
  return simulator;
}

/// FNV-1a over 8 bytes at a time, to tell answers apart.
std::uint64_t hash_of(const std::string& bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (std::size_t at = 0; at < bytes.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
    hash = (hash ^ word) * 0x100000001b3ULL;
  }
  return hash;
}

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// One line: what, wall and processor seconds, digest of the bytes that `make` returns.
template <class Make>
std::string timed(const std::string& name, const Options& options, const Make& make) {
  const auto wall = std::chrono::steady_clock::now();
  const double cpu = cpu_s();
  const std::string bytes = make();
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
  std::printf("%s,%d,%.3f,%.3f,%zu,%016llx\n", name.c_str(), options.threads, wall_s, cpu_s() - cpu, bytes.size(),
              static_cast<unsigned long long>(hash_of(bytes)));
  std::fflush(stdout);
  return bytes;
}

void keep(const Options& options, const std::string& name, const std::string& bytes) {
  if (options.out.empty()) return;
  std::ofstream(options.out + "/" + name, std::ios::binary) << bytes;
}

std::string bytes_of(const void* data, std::size_t size) { return std::string(static_cast<const char*>(data), size); }

/// By the divergence theorem, of all cells together.
double volume_um3(const Mesh& mesh) {
  double six = 0.0;
  const std::size_t end = mesh.nuclei.empty() ? mesh.indices.size() : mesh.nuclei.front().first_index;
  const auto at = [&](std::size_t i) {
    const float* p = mesh.positions_um.data() + 3 * static_cast<std::size_t>(mesh.indices[i]);
    return Vec3(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
  };
  for (std::size_t i = 0; i < end; i += 3) six += at(i).dot(at(i + 1).cross(at(i + 2)));
  return six / 6.0;
}

std::string wavefront(const Mesh& mesh) {
  std::string text;
  char line[128];
  for (std::size_t i = 0; i < mesh.positions_um.size(); i += 3) {
    std::snprintf(line, sizeof line, "v %.4f %.4f %.4f\n", static_cast<double>(mesh.positions_um[i]),
                  static_cast<double>(mesh.positions_um[i + 1]), static_cast<double>(mesh.positions_um[i + 2]));
    text += line;
  }
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    std::snprintf(line, sizeof line, "f %u %u %u\n", mesh.indices[i] + 1, mesh.indices[i + 1] + 1,
                  mesh.indices[i + 2] + 1);
    text += line;
  }
  return text;
}

/// Discs in hexagonal packing: the walls of a dense layer, as many lines as such a picture has.
BinaryImage walls_of_discs(std::int64_t side_px) {
  std::vector<LabelArea> areas;
  for (std::uint32_t label = 1; label <= 4096; ++label) areas.push_back({label, 2000});
  const LabelImage discs = *hexagonal_control(areas);
  LabelImage part(side_px, side_px);
  for (std::int64_t row = 0; row < std::min(side_px, discs.height_px); ++row) {
    for (std::int64_t column = 0; column < std::min(side_px, discs.width_px); ++column) {
      part.at(row, column) = discs.at(std::int64_t{row}, std::int64_t{column});
    }
  }
  return *cell_walls(part);
}

void count_boxes_timed(const Options& options) {
  const BinaryImage walls = walls_of_discs(4000);
  BoxOptions boxes;
  boxes.threads = options.threads;
  boxes.sides_px = geometric_sides(4000, boxes);
  while (boxes.sides_px.size() > 20) boxes.sides_px.pop_back();
  BoxDimensions found;
  timed("box_counting", options, [&] {
    found = *box_dimensions(walls, boxes);
    std::string bytes;
    for (const BoxCount& count : found.counts) bytes += bytes_of(&count.count_mean, sizeof count.count_mean);
    return bytes;
  });
  std::printf("box counting: %zu sides of %d to %d px, %d offsets, %llu px of lines, D0 %.3f\n", found.counts.size(), static_cast<int>(found.side_min_px),
              static_cast<int>(found.side_max_px), static_cast<int>(found.counts.back().offset_count),
              static_cast<unsigned long long>(found.foreground_px), found.capacity.value);
}

void run(const Options& options) {
  const Simulator simulator = grown(options);
  const Colony& colony = simulator.colony();
  const Params& params = simulator.spec().params;
  const Effort effort{options.threads, nullptr};
  std::printf("cells %zu, digest %s\nwhat,threads,wall_s,cpu_s,bytes,digest\n", colony.cells().size(),
              colony.digest().hex().c_str());
  const std::pair<const char*, PictureStyle> styles[] = {{"brightfield", PictureStyle::kBrightfield},
                                                         {"phase", PictureStyle::kPhase},
                                                         {"labels", PictureStyle::kLabels},
                                                         {"shaded", PictureStyle::kShaded},
                                                         {"contours", PictureStyle::kContours}};
  PictureSpec spec;
  spec.width_px = options.width_px;
  spec.side_max_px = kRasterSideMax_px;
  for (const auto& [name, style] : styles) {
    spec.style = style;
    Picture picture;
    timed(name, options, [&] {
      picture = *render(colony, params, spec, effort);
      return bytes_of(picture.rgb.data(), picture.rgb.size());
    });
    keep(options, std::string(name) + ".png",
         timed(std::string(name) + ".png", options, [&] { return encode_png(picture); }));
  }
  spec.style = PictureStyle::kContours;
  spec.contour_lines = ContourLines::kColony;
  keep(options, "outline.png", encode_png(*render(colony, params, spec, effort)));
  keep(options, "colony.ome.tif", timed("ome_tiff", options, [&] {
         MemoryFile file;
         static_cast<void>(write_ome_tiff(colony, params, spec, OmeChannels{}, effort, file).value());
         return file.bytes();
       }));
  Mesh mesh;
  timed("mesh", options, [&] {
    MeshSpec mesh_spec;
    mesh_spec.triangles_max = options.triangles;
    mesh = *build_mesh(colony, params.contact.rule, mesh_spec, effort);
    return bytes_of(mesh.positions_um.data(), mesh.positions_um.size() * sizeof(float)) +
           bytes_of(mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t));
  });
  std::printf("mesh: %zu triangles, %zu vertices, grid %.3f um\n", mesh.indices.size() / 3,
              mesh.positions_um.size() / 3, mesh.pitch_um);
  const std::vector<double> volumes = path_volumes_um3(colony, params.contact.rule, *frame_of(colony, spec), effort);
  double sum_um3 = 0.0;
  for (const double volume : volumes) sum_um3 += volume;
  std::printf("mesh: volume %.0f um3, by path lengths %.0f um3, ratio %.4f\n", volume_um3(mesh), sum_um3,
              volume_um3(mesh) / sum_um3);
  if (!options.out.empty()) keep(options, "colony.obj", wavefront(mesh));
  count_boxes_timed(options);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    if (name == "--cells")
      options.cells = std::strtoull(argv[i + 1], nullptr, 10);
    else if (name == "--width")
      options.width_px = std::strtoll(argv[i + 1], nullptr, 10);
    else if (name == "--threads")
      options.threads = std::atoi(argv[i + 1]);
    else if (name == "--triangles")
      options.triangles = std::strtoll(argv[i + 1], nullptr, 10);
    else if (name == "--out")
      options.out = argv[i + 1];
    else
      return std::fprintf(stderr, "colony-picture-bench: unknown option %s\n", argv[i]), 2;
  }
  run(options);
  return 0;
}
