#include <cmath>
#include <istream>
#include <map>
#include <tuple>
#include <utility>

#include "scenes/core/file_bytes.h"
#include "scenes/core/models/importers.h"
#include "scenes/core/models/mesh_tools.h"
#include "scenes/core/models/obj_materials.h"
#include "scenes/core/models/statement_lines.h"
#include "scenes/core/models/tiny_obj.h"

/// OBJ by tinyobjloader's callbacks, which give every statement in turn: its own meshes would be a
/// second copy of the file, without the place of a fault.
namespace penumbra {
namespace {

/// Beyond this a scene's bounds would overflow in single precision.
constexpr double kMaxCoordinate = 1e30;

/// Faces of one object and group with one material that have the same kinds of corners.
struct Bucket {
  std::string name;
  std::string material;
  bool has_uvs{false}, has_normals{false};
  std::vector<std::uint32_t> corners;     ///< vertex, then uv and normal where there are
  std::vector<std::uint32_t> face_sizes;  ///< of a cage
  std::size_t left_out{0};                ///< triangles of polygons without area
  std::size_t stride() const { return 1u + has_uvs + has_normals; }
};

using Corner = std::array<std::uint32_t, 3>;  ///< vertex, uv, normal

class ObjReader {
 public:
  ObjReader(const std::filesystem::path& file, ModelFaces faces)
      : builder_(file),
        lines_(file, read_bytes(file), [this](std::string_view s) { check_statement(s); }),
        materials_(builder_),
        faces_(faces) {}

  Model read() {
    std::istream stream(&lines_);
    stream.exceptions(std::ios::badbit);
    tinyobj::callback_t callbacks;
    callbacks.vertex_cb = [](void* self, double x, double y, double z, double) {
      static_cast<ObjReader*>(self)->add_vertex({x, y, z});
    };
    callbacks.normal_cb = [](void* self, double x, double y, double z) {
      static_cast<ObjReader*>(self)->add_normal({x, y, z});
    };
    callbacks.texcoord_cb = [](void* self, double x, double y, double) {
      static_cast<ObjReader*>(self)->add_uv(x, y);
    };
    callbacks.index_cb = [](void* self, tinyobj::index_t* corners, int count) {
      static_cast<ObjReader*>(self)->add_face({corners, static_cast<std::size_t>(count)});
    };
    std::string warnings, errors;
    tinyobj::LoadObjWithCallback(stream, callbacks, this, nullptr, &warnings, &errors);
    if (!errors.empty()) model_error(lines_.file(), errors);
    make_shapes();
    report();
    return builder_.take();
  }

 private:
  [[noreturn]] void fault(const std::string& message) const {
    model_error(lines_.file(), lines_.line(), message);
  }

  /// Names and materials are taken here, the numbers from the callbacks.
  void check_statement(std::string_view rest) {
    const std::string_view keyword = take_word(rest);
    if (keyword == "v") {
      has_colors_ |= check_numbers(lines_, keyword, rest, 3, 8) > 4;
    } else if (keyword == "vn") {
      check_numbers(lines_, keyword, rest, 3, 3);
    } else if (keyword == "vt") {
      check_numbers(lines_, keyword, rest, 1, 3);
    } else if (keyword == "f") {
      check_corners(rest);
    } else if (keyword == "o") {
      object_ = joined_words(rest);
      group_.clear();
      current_ = {};
    } else if (keyword == "g") {
      group_ = joined_words(rest);
      current_ = {};
    } else if (keyword == "usemtl") {
      material_ = joined_words(rest);
      current_ = {};
    } else if (keyword == "mtllib") {
      materials_.add_libraries(rest, lines_.line());
    } else if (keyword == "s") {
      const std::string_view value = take_word(rest);
      wants_smooth_ |= value != "off" && value != "0";
    } else {
      ++unsupported_[std::string(keyword)];
    }
  }

  void check_corners(std::string_view rest) const {
    for (std::string_view corner = take_word(rest); !corner.empty(); corner = take_word(rest)) {
      int numbers = 0, slashes = 0, digits = 0;
      for (const char c : corner) {
        const bool is_digit = c >= '0' && c <= '9';
        numbers += is_digit && digits == 0;
        digits = is_digit ? digits + 1 : 0;
        slashes += c == '/';
        // More digits would overflow in the parser, and no file has that many vertices.
        if ((!is_digit && c != '/' && c != '-') || digits > 9) numbers = -100;
      }
      if (numbers < 1 || slashes > 2) {
        fault("expected a corner like 1, 1/2, 1//3 or 1/2/3, found \"" + std::string(corner) +
              "\"");
      }
    }
  }

  void add_vertex(const Vec3d& vertex) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(vertex[axis]) <= kMaxCoordinate)) fault("a coordinate is beyond 1e30");
    }
    vertices_.push_back(vertex);
  }

  void add_normal(const Vec3d& normal) {
    const Vec3 value(normal.normalized());
    if (!std::isfinite(value.x + value.y + value.z)) fault("a normal's component is too large");
    normals_.push_back(value);
  }

  void add_uv(double u, double v) {
    if (!(std::abs(u) <= kMaxCoordinate && std::abs(v) <= kMaxCoordinate)) {
      fault("a texture coordinate is beyond 1e30");
    }
    uvs_.emplace_back(static_cast<float>(u), static_cast<float>(1.0 - v));
  }

  /// @param index  as in the file: from 1, or from -1 backwards
  std::uint32_t resolve(int index, std::size_t count, const char* what) const {
    const long long resolved = index > 0 ? index - 1ll : static_cast<long long>(count) + index;
    if (index == 0 || resolved < 0 || resolved >= static_cast<long long>(count)) {
      fault(std::string(what) + " " + std::to_string(index) + " does not exist; " +
            std::to_string(count) + " are defined before this line, counted from 1");
    }
    return static_cast<std::uint32_t>(resolved);
  }

  void add_face(std::span<const tinyobj::index_t> indices) {
    if (indices.size() < 3) {
      fault("a face needs at least 3 corners, found " + std::to_string(indices.size()));
    }
    const bool has_uvs = indices[0].texcoord_index != 0;
    bool has_normals = indices[0].normal_index != 0;
    face_.clear();
    for (const tinyobj::index_t& index : indices) {
      if ((index.texcoord_index != 0) != has_uvs || (index.normal_index != 0) != has_normals) {
        fault(
            "the corners of a face must all have texture coordinates or none, and normals or "
            "none");
      }
      face_.push_back(
          {resolve(index.vertex_index, vertices_.size(), "vertex"),
           has_uvs ? resolve(index.texcoord_index, uvs_.size(), "texture coordinate") : 0,
           has_normals ? resolve(index.normal_index, normals_.size(), "normal") : 0});
    }
    if (faces_ == ModelFaces::Subdivision) {
      add_polygon();
      return;
    }
    for (const Corner& corner : face_) {
      if (!has_normals || normals_[corner[2]] != Vec3(0.0f)) continue;
      has_normals = false;
      ++faces_with_zero_normals_;
    }
    add_triangles(bucket(has_uvs, has_normals));
  }

  void add_polygon() {
    Bucket& cage = bucket(false, false);
    const std::size_t first = cage.corners.size();
    for (const Corner& corner : face_) cage.corners.push_back(corner[0]);
    if (has_repeats(std::span(cage.corners).subspan(first))) {
      fault("a face of a subdivision cage meets a vertex twice");
    }
    cage.face_sizes.push_back(static_cast<std::uint32_t>(face_.size()));
  }

  void add_triangles(Bucket& bucket) {
    triangles_.clear();
    if (face_.size() == 3) {
      triangles_.push_back({0, 1, 2});
    } else {
      polygon_.clear();
      for (const Corner& corner : face_) polygon_.push_back(vertices_[corner[0]]);
      if (!triangulate(polygon_, triangles_)) {
        fault("a concave face has " + std::to_string(face_.size()) + " corners, at most " +
              std::to_string(kMaxConcaveCorners) + " are supported");
      }
      if (triangles_.empty()) bucket.left_out += face_.size() - 2;
    }
    for (const auto& triangle : triangles_) {
      for (const std::uint32_t k : triangle) {
        bucket.corners.push_back(face_[k][0]);
        if (bucket.has_uvs) bucket.corners.push_back(face_[k][1]);
        if (bucket.has_normals) bucket.corners.push_back(face_[k][2]);
      }
    }
  }

  Bucket& bucket(bool has_uvs, bool has_normals) {
    std::optional<std::size_t>& current = current_[(has_uvs ? 1u : 0u) + (has_normals ? 2u : 0u)];
    if (!current) {
      const auto [found, added] = bucket_index_.try_emplace(
          {object_, group_, material_, has_uvs, has_normals}, buckets_.size());
      if (added) {
        Bucket& made = buckets_.emplace_back();
        made.name = object_.empty() || group_.empty() ? object_ + group_ : object_ + "." + group_;
        if (made.name.empty()) made.name = lines_.file().stem().string();
        made.material = material_;
        made.has_uvs = has_uvs;
        made.has_normals = has_normals;
      }
      current = found->second;
    }
    return buckets_[*current];
  }

  void make_shapes() {
    first_local_.assign(vertices_.size(), kNone);
    std::map<std::string, int> uses;
    for (const Bucket& bucket : buckets_) ++uses[bucket.name];
    for (Bucket& bucket : buckets_) {
      const std::uint32_t material = materials_.use(bucket.material);
      // A group of several materials gives several shapes, told apart by them.
      std::string name = bucket.name;
      if (uses[name] > 1) name += "." + builder_.model().materials[material].name;
      if (faces_ == ModelFaces::Subdivision) {
        builder_.add_cage(name, material, make_cage(bucket), materials_.emission(material));
      } else {
        builder_.add_mesh(name, material, make_mesh(bucket), materials_.emission(material),
                          bucket.left_out);
      }
      std::vector<std::uint32_t>().swap(bucket.corners);
    }
  }

  SubdivisionShape make_cage(Bucket& bucket) {
    SubdivisionShape cage;
    cage.face_sizes = std::move(bucket.face_sizes);
    cage.indices.reserve(bucket.corners.size());
    for (const std::uint32_t vertex : bucket.corners) {
      if (first_local_[vertex] == kNone) {
        first_local_[vertex] = static_cast<std::uint32_t>(cage.vertices.size());
        cage.vertices.push_back(vertices_[vertex]);
      }
      cage.indices.push_back(first_local_[vertex]);
    }
    for (const std::uint32_t vertex : bucket.corners) first_local_[vertex] = kNone;
    return cage;
  }

  /// Corners that agree in vertex, uv and normal become one vertex of the mesh. Those of one vertex
  /// of the file are few, so they are chained.
  TriangleMeshShape make_mesh(const Bucket& bucket) {
    TriangleMeshShape mesh;
    const std::size_t stride = bucket.stride();
    const std::size_t triangles = bucket.corners.size() / stride / 3;
    mesh.triangles.resize(triangles);
    std::vector<std::uint32_t> next;     // [vertex of the mesh] of the same vertex of the file
    std::vector<std::uint32_t> origins;  // [vertex of the mesh] its first corner's place
    for (std::size_t i = 0; i < triangles * 3; ++i) {
      const std::uint32_t* corner = &bucket.corners[i * stride];
      std::uint32_t* link = &first_local_[corner[0]];
      while (*link != kNone && !std::equal(corner + 1, corner + stride,
                                           &bucket.corners[origins[*link] * stride] + 1)) {
        link = &next[*link];
      }
      std::uint32_t local = *link;
      if (local == kNone) {
        local = *link = static_cast<std::uint32_t>(mesh.vertices.size());
        next.push_back(kNone);
        origins.push_back(static_cast<std::uint32_t>(i));
        mesh.vertices.push_back(vertices_[corner[0]]);
        if (bucket.has_uvs) mesh.uvs.push_back(uvs_[corner[1]]);
        if (bucket.has_normals) mesh.normals.push_back(normals_[corner[bucket.has_uvs ? 2 : 1]]);
      }
      mesh.triangles[i / 3][i % 3] = local;
    }
    for (std::size_t i = 0; i < bucket.corners.size(); i += stride) {
      first_local_[bucket.corners[i]] = kNone;
    }
    return mesh;
  }

  void report() {
    for (const auto& [keyword, count] : unsupported_) {
      builder_.warn(std::to_string(count) + " statements \"" + keyword +
                    "\" are not supported and left out");
    }
    if (has_colors_) builder_.warn("colours of vertices are not supported and left out");
    if (wants_smooth_ && normals_.empty() && faces_ == ModelFaces::Triangles) {
      builder_.warn("smoothing groups (\"s\") without normals: faces are flat");
    }
    if (faces_with_zero_normals_ > 0) {
      builder_.warn(std::to_string(faces_with_zero_normals_) +
                    " faces have a normal of length 0: they are flat");
    }
  }

  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  ModelBuilder builder_;
  StatementLines lines_;
  ObjMaterials materials_;
  ModelFaces faces_;
  std::vector<Vec3d> vertices_;
  std::vector<Vec3> normals_;  ///< of length 1 or 0
  std::vector<Vec2> uvs_;
  std::string object_, group_, material_;
  std::vector<Bucket> buckets_;
  std::map<std::tuple<std::string, std::string, std::string, bool, bool>, std::size_t>
      bucket_index_;
  std::array<std::optional<std::size_t>, 4> current_;  ///< bucket of each kind of corners
  std::vector<std::uint32_t> first_local_;  ///< [vertex] its first vertex in the mesh being made
  std::vector<Corner> face_;
  std::vector<Vec3d> polygon_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::map<std::string, std::size_t> unsupported_;
  std::size_t faces_with_zero_normals_{0};
  bool has_colors_{false}, wants_smooth_{false};
};

}  // namespace

Model load_obj(const std::filesystem::path& file, ModelFaces faces) {
  return ObjReader(file, faces).read();
}

}  // namespace penumbra
