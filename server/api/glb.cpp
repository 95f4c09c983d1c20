#include "server/api/glb.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <sstream>
#include <utility>

#include <tiny_gltf.h>

#include "engine/picture/colour.hpp"

namespace colony::server::api {
namespace {

constexpr std::array<double, 3> kNucleusColour = {0.20, 0.12, 0.39};
constexpr double kCellOpacity = 0.45;  // nuclei are seen through the cells

template <class T>
void append_bytes(std::vector<unsigned char>& out, const std::vector<T>& values) {
  const std::size_t at = out.size();
  out.resize(at + values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(out.data() + at, values.data(), values.size() * sizeof(T));
}

tinygltf::Material material(std::string name, std::array<double, 3> colour, double opacity) {
  tinygltf::Material out;
  out.name = std::move(name);
  out.pbrMetallicRoughness.baseColorFactor = {colour[0], colour[1], colour[2], opacity};
  out.pbrMetallicRoughness.metallicFactor = 0.0;
  out.pbrMetallicRoughness.roughnessFactor = 0.6;
  if (opacity < 1.0) out.alphaMode = "BLEND";
  return out;
}

std::array<double, 3> share_of(Rgb colour) { return {colour.red / 255.0, colour.green / 255.0, colour.blue / 255.0}; }

class Writer {
 public:
  explicit Writer(const Mesh& mesh) : mesh_(mesh) {
    model_.asset.version = "2.0";
    model_.asset.generator = "colonyd";
    model_.asset.extras = tinygltf::Value(tinygltf::Value::Object{{"unit", tinygltf::Value(std::string("micrometre"))}});
    root_.name = "colony";
    root_.rotation = {-0.70710678118654757, 0.0, 0.0, 0.70710678118654757};  // z up becomes y up
  }

  void add_cell(const MeshPart& cell, const MeshPart* nucleus, Activity activity) {
    tinygltf::Node node;
    node.name = "cell " + std::to_string(cell.id.value);
    node.mesh = add_mesh(node.name, cell, cell_material(activity));
    if (nucleus != nullptr && nucleus->index_count > 0) {
      tinygltf::Node inside;
      inside.name = "nucleus " + std::to_string(cell.id.value);
      inside.mesh = add_mesh(inside.name, *nucleus, nucleus_material());
      model_.nodes.push_back(std::move(inside));
      node.children = {static_cast<int>(model_.nodes.size() - 1)};
    }
    if (node.mesh < 0 && node.children.empty()) return;
    model_.nodes.push_back(std::move(node));
    root_.children.push_back(static_cast<int>(model_.nodes.size() - 1));
  }

  Result<std::string> finish() {
    if (!model_.meshes.empty()) add_buffer();
    model_.nodes.push_back(std::move(root_));
    tinygltf::Scene scene;
    scene.nodes = {static_cast<int>(model_.nodes.size() - 1)};
    model_.scenes = {std::move(scene)};
    model_.defaultScene = 0;
    std::ostringstream out(std::ios::binary);
    if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&model_, out, false, true)) {
      return Error{ErrorCode::kInternal, "the mesh could not be written"};
    }
    return std::move(out).str();
  }

 private:
  enum View { kPositions, kNormals, kIndices };

  // A material is made when the first part has it: one that nothing has is a warning of validators.
  int made(int& index, tinygltf::Material&& material) {
    if (index < 0) {
      model_.materials.push_back(std::move(material));
      index = static_cast<int>(model_.materials.size() - 1);
    }
    return index;
  }
  int cell_material(Activity activity) {
    return made(cell_materials_[static_cast<std::size_t>(activity)],
                material(std::string(name_of(activity)) + " cell", share_of(activity_colour(activity)), kCellOpacity));
  }
  int nucleus_material() { return made(nucleus_material_, material("nucleus", kNucleusColour, 1.0)); }

  int add_accessor(tinygltf::Accessor accessor) {
    model_.accessors.push_back(std::move(accessor));
    return static_cast<int>(model_.accessors.size() - 1);
  }

  tinygltf::Accessor vectors(View view, const MeshPart& part) const {
    tinygltf::Accessor accessor;
    accessor.bufferView = view;
    accessor.byteOffset = part.first_vertex * 3 * sizeof(float);
    accessor.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
    accessor.count = part.vertex_count;
    accessor.type = TINYGLTF_TYPE_VEC3;
    return accessor;
  }

  // -1 for a part without triangles.
  int add_mesh(const std::string& name, const MeshPart& part, int material_index) {
    if (part.index_count == 0) return -1;
    tinygltf::Accessor positions = vectors(kPositions, part);
    const float* const first = mesh_.positions_um.data() + 3 * part.first_vertex;
    positions.minValues.assign(first, first + 3);
    positions.maxValues = positions.minValues;
    for (std::size_t i = 0; i < 3 * part.vertex_count; ++i) {
      positions.minValues[i % 3] = std::min<double>(positions.minValues[i % 3], first[i]);
      positions.maxValues[i % 3] = std::max<double>(positions.maxValues[i % 3], first[i]);
    }
    tinygltf::Accessor indices;
    indices.bufferView = kIndices;
    indices.byteOffset = indices_.size() * sizeof(std::uint32_t);
    indices.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    indices.count = part.index_count;
    indices.type = TINYGLTF_TYPE_SCALAR;
    for (std::size_t i = 0; i < part.index_count; ++i) {
      indices_.push_back(mesh_.indices[part.first_index + i] - static_cast<std::uint32_t>(part.first_vertex));
    }
    tinygltf::Primitive primitive;
    primitive.attributes["POSITION"] = add_accessor(std::move(positions));
    primitive.attributes["NORMAL"] = add_accessor(vectors(kNormals, part));
    primitive.indices = add_accessor(std::move(indices));
    primitive.material = material_index;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    tinygltf::Mesh mesh;
    mesh.name = name;
    mesh.primitives = {std::move(primitive)};
    model_.meshes.push_back(std::move(mesh));
    return static_cast<int>(model_.meshes.size() - 1);
  }

  void add_buffer() {
    model_.buffers.emplace_back();
    std::vector<unsigned char>& bytes = model_.buffers.back().data;
    const auto add_view = [&](const auto& values, int target, std::size_t stride) {
      tinygltf::BufferView view;
      view.buffer = 0;
      view.byteOffset = bytes.size();
      append_bytes(bytes, values);
      view.byteLength = bytes.size() - view.byteOffset;
      view.byteStride = stride;
      view.target = target;
      model_.bufferViews.push_back(std::move(view));
    };
    add_view(mesh_.positions_um, TINYGLTF_TARGET_ARRAY_BUFFER, 3 * sizeof(float));
    add_view(mesh_.normals, TINYGLTF_TARGET_ARRAY_BUFFER, 3 * sizeof(float));
    add_view(indices_, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER, 0);
  }

  const Mesh& mesh_;
  std::array<int, 3> cell_materials_{-1, -1, -1};  // by activity; -1: none yet
  int nucleus_material_ = -1;
  tinygltf::Model model_;
  tinygltf::Node root_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace

Result<std::string> encode_glb(const Mesh& mesh, const Colony& colony) {
  Writer writer(mesh);
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) {
    const MeshPart* const nucleus = mesh.nuclei.empty() ? nullptr : &mesh.nuclei[i];
    writer.add_cell(mesh.cells[i], nucleus, colony.cell(mesh.cells[i].id).activity);
  }
  return writer.finish();
}

}  // namespace colony::server::api
