#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "scenes/core/models/gltf_document.h"
#include "scenes/core/models/gltf_lights.h"
#include "scenes/core/models/gltf_materials.h"
#include "scenes/core/models/gltf_transform.h"
#include "scenes/core/models/importers.h"

/// glTF 2.0 by tinygltf: nodes are walked from the scene's roots, and each use of a mesh becomes
/// shapes of its own in world space.
namespace penumbra {
namespace {

constexpr double kMaxCoordinate = 1e30;

using Triangle = std::array<std::uint32_t, 3>;

class GltfReader {
 public:
  GltfReader(const std::filesystem::path& file, ModelFaces faces)
      : document_(file),
        model_(document_.model()),
        builder_(file),
        materials_(document_, builder_),
        faces_(faces) {}

  Model read() {
    walk_nodes();
    report();
    return builder_.take();
  }

 private:
  struct Visit {
    int node;
    Imath::M44d parent;  ///< world_from_parent
  };

  void walk_nodes() {
    std::vector<bool> visited(model_.nodes.size(), false);
    std::vector<Visit> stack;
    const auto push = [&](const std::vector<int>& nodes, const Imath::M44d& parent) {
      for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
        stack.push_back({*node, parent});
      }
    };
    push(roots(), Imath::M44d());
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      const tinygltf::Node& node = document_.at(model_.nodes, visit.node, "node");
      if (visited[static_cast<std::size_t>(visit.node)]) {
        document_.fault("node " + std::to_string(visit.node) +
                        " is reached twice; nodes must form trees");
      }
      visited[static_cast<std::size_t>(visit.node)] = true;
      const Placement world(local_matrix(document_, visit.node) * visit.parent);
      for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) {
          if (!(std::abs(world.matrix()[i][j]) <= kMaxCoordinate)) {
            document_.fault("node " + std::to_string(visit.node) +
                            ": its place in the world is beyond 1e30");
          }
        }
      }
      read_node(node, visit.node, world);
      push(node.children, world.matrix());
    }
  }

  std::vector<int> roots() {
    if (!model_.scenes.empty()) {
      if (model_.scenes.size() > 1) {
        builder_.warn("the file has " + std::to_string(model_.scenes.size()) + " scenes; scene " +
                      std::to_string(std::max(model_.defaultScene, 0)) + " is taken");
      }
      return document_.at(model_.scenes, std::max(model_.defaultScene, 0), "scene").nodes;
    }
    std::set<int> children;
    for (const tinygltf::Node& node : model_.nodes) {
      children.insert(node.children.begin(), node.children.end());
    }
    std::vector<int> roots;
    for (int i = 0; i < static_cast<int>(model_.nodes.size()); ++i) {
      if (!children.contains(i)) roots.push_back(i);
    }
    return roots;
  }

  void read_node(const tinygltf::Node& node, int index, const Placement& world) {
    if (node.camera >= 0 && !add_camera(document_, builder_, index, world)) ++left_out_cameras_;
    if (const auto found = node.extensions.find("KHR_lights_punctual");
        found != node.extensions.end()) {
      // tinygltf asserts what it is not asked about.
      const tinygltf::Value& extension = found->second;
      const bool has_light = extension.Has("light") && extension.Get("light").IsInt();
      add_light(document_, builder_, index, has_light ? extension.Get("light").Get<int>() : -1,
                world);
    }
    if (node.skin >= 0) ++skins_;
    if (node.mesh < 0) return;
    const tinygltf::Mesh& mesh = document_.at(model_.meshes, node.mesh, "mesh");
    std::string name = !node.name.empty()   ? node.name
                       : !mesh.name.empty() ? mesh.name
                                            : "mesh" + std::to_string(node.mesh);
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      const std::uint32_t material = materials_.use(primitive.material);
      // Parts of a mesh are told apart by their materials.
      add_primitive(primitive, material,
                    mesh.primitives.size() == 1
                        ? name
                        : name + "." + builder_.model().materials[material].name,
                    world);
    }
  }

  void add_primitive(const tinygltf::Primitive& primitive, std::uint32_t material,
                     const std::string& name, const Placement& world) {
    if (primitive.extensions.contains("KHR_draco_mesh_compression")) {
      document_.fault("shape \"" + name +
                      "\": KHR_draco_mesh_compression is not supported; store it uncompressed");
    }
    morph_targets_ += primitive.targets.empty() ? 0 : 1;
    if (primitive.mode >= TINYGLTF_MODE_POINTS && primitive.mode <= TINYGLTF_MODE_LINE_STRIP) {
      builder_.warn("shape \"" + name + "\": points and lines are not supported and left out");
      return;
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) {
      document_.fault("shape \"" + name + "\" has no POSITION");
    }
    TriangleMeshShape mesh;
    set_vertices(position->second, world, mesh);
    mesh.triangles = triangles(primitive, name, mesh.vertices.size(), world.mirrors());
    if (faces_ == ModelFaces::Subdivision) {
      add_cage(name, material, std::move(mesh));
      return;
    }
    set_attributes(primitive, name, world, mesh);
    builder_.add_mesh(name, material, std::move(mesh), materials_.emission(material));
  }

  void set_vertices(int accessor, const Placement& world, TriangleMeshShape& mesh) {
    const std::vector<float> values = document_.read_vectors(accessor, 3, false);
    mesh.vertices.reserve(values.size() / 3);
    for (std::size_t i = 0; i < values.size(); i += 3) {
      const Vec3d vertex = world.point(Vec3d(Vec3(values[i], values[i + 1], values[i + 2])));
      if (!(std::abs(vertex.x) <= kMaxCoordinate && std::abs(vertex.y) <= kMaxCoordinate &&
            std::abs(vertex.z) <= kMaxCoordinate)) {
        document_.fault("accessor " + std::to_string(accessor) + ": vertex " +
                        std::to_string(i / 3) + " is beyond 1e30");
      }
      mesh.vertices.push_back(vertex);
    }
  }

  std::vector<Triangle> triangles(const tinygltf::Primitive& primitive, const std::string& name,
                                  std::size_t vertices, bool mirrored) {
    std::vector<std::uint32_t> corners;
    if (primitive.indices >= 0) {
      corners = document_.read_indices(primitive.indices);
    } else {
      corners.resize(vertices);
      for (std::uint32_t i = 0; i < vertices; ++i) corners[i] = i;
    }
    for (const std::uint32_t corner : corners) {
      if (corner < vertices) continue;
      document_.fault("shape \"" + name + "\": vertex " + std::to_string(corner) +
                      " does not exist; there are " + std::to_string(vertices));
    }
    std::vector<Triangle> result;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      if (mirrored) std::swap(b, c);
      result.push_back({corners[a], corners[b], corners[c]});
    };
    switch (primitive.mode) {
      case TINYGLTF_MODE_TRIANGLES:
        if (corners.size() % 3 != 0) {
          document_.fault("shape \"" + name + "\": " + std::to_string(corners.size()) +
                          " corners are not a multiple of 3");
        }
        result.reserve(corners.size() / 3);
        for (std::size_t i = 0; i < corners.size(); i += 3) add(i, i + 1, i + 2);
        break;
      case TINYGLTF_MODE_TRIANGLE_STRIP:
        // Every second triangle has its first two corners swapped, so that all wind alike.
        for (std::size_t i = 0; i + 2 < corners.size(); ++i) add(i, i + 1 + i % 2, i + 2 - i % 2);
        break;
      case TINYGLTF_MODE_TRIANGLE_FAN:
        for (std::size_t i = 1; i + 1 < corners.size(); ++i) add(i, i + 1, 0);
        break;
      default:
        document_.fault("shape \"" + name + "\": unknown mode " + std::to_string(primitive.mode));
    }
    return result;
  }

  void set_attributes(const tinygltf::Primitive& primitive, const std::string& name,
                      const Placement& world, TriangleMeshShape& mesh) {
    const auto find = [&](const char* attribute, int components) {
      const auto found = primitive.attributes.find(attribute);
      if (found == primitive.attributes.end()) return std::vector<float>();
      std::vector<float> values =
          document_.read_vectors(found->second, components, components == 2);
      if (values.size() != mesh.vertices.size() * static_cast<std::size_t>(components)) {
        document_.fault("shape \"" + name + "\": " + attribute +
                        " has another number of elements "
                        "than POSITION");
      }
      return values;
    };
    const std::vector<float> normals = find("NORMAL", 3);
    for (std::size_t i = 0; i < normals.size(); i += 3) {
      const Vec3d normal = world.normal(Vec3d(Vec3(normals[i], normals[i + 1], normals[i + 2])));
      if (normal.length() == 0.0) {
        builder_.warn("shape \"" + name + "\": normal " + std::to_string(i / 3) +
                      " has length 0: its normals are left out and faces are flat");
        mesh.normals.clear();
        break;
      }
      mesh.normals.emplace_back(normal.normalized());
    }
    const std::vector<float> uvs = find("TEXCOORD_0", 2);
    for (std::size_t i = 0; i < uvs.size(); i += 2) mesh.uvs.emplace_back(uvs[i], uvs[i + 1]);
    if (primitive.attributes.contains("COLOR_0")) ++colored_;
  }

  void add_cage(const std::string& name, std::uint32_t material, TriangleMeshShape mesh) {
    SubdivisionShape cage;
    cage.vertices = std::move(mesh.vertices);
    cage.face_sizes.assign(mesh.triangles.size(), 3);
    for (const Triangle& t : mesh.triangles) {
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
        document_.fault("shape \"" + name +
                        "\": a face of a subdivision cage meets a vertex twice");
      }
      cage.indices.insert(cage.indices.end(), t.begin(), t.end());
    }
    if (cage.face_sizes.empty()) document_.fault("shape \"" + name + "\" has no faces");
    builder_.add_cage(name, material, std::move(cage), materials_.emission(material));
  }

  void report() {
    for (const std::string& name : model_.extensionsUsed) {
      if (is_supported_extension(name)) continue;
      builder_.warn("extension " + name + " is not supported and left out");
    }
    const auto count = [&](std::size_t number, const std::string& what) {
      if (number > 0) builder_.warn(std::to_string(number) + " " + what);
    };
    count(skins_, "nodes have a skin: it is not supported, meshes stay in their rest pose");
    count(morph_targets_, "meshes have morph targets: they are not supported and left out");
    count(model_.animations.size(), "animations are not supported and left out");
    count(colored_, "meshes have colours of vertices: they are not supported and left out");
    count(left_out_cameras_, "further cameras are left out: the first one is taken");
  }

  GltfDocument document_;
  const tinygltf::Model& model_;
  ModelBuilder builder_;
  GltfMaterials materials_;
  ModelFaces faces_;
  std::size_t skins_{0}, morph_targets_{0}, colored_{0}, left_out_cameras_{0};
};

}  // namespace

Model load_gltf(const std::filesystem::path& file, ModelFaces faces) {
  return GltfReader(file, faces).read();
}

}  // namespace penumbra
