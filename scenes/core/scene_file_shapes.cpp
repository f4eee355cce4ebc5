#include "scenes/core/scene_file_shapes.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

namespace penumbra {

using nlohmann::json;

namespace {

/// A face whose area is a smaller part of its longest side squared counts as having none: below the
/// rounding of its corners in double precision.
constexpr double kMinRelativeArea = 1e-14;

template <std::size_t N>
using Face = std::array<std::uint32_t, N>;

std::vector<Vec3d> read_vertices(const json& value) {
  std::vector<Vec3d> vertices;
  vertices.reserve(value.size());
  for (const json& vertex : value) vertices.push_back(read_vector(vertex));
  return vertices;
}

template <std::size_t N>
bool has_area(const std::vector<Vec3d>& vertices, const Face<N>& face) {
  double longest = 0.0;
  for (std::size_t i = 0; i < N; ++i) {
    longest = std::max(longest, (vertices[face[(i + 1) % N]] - vertices[face[i]]).length());
  }
  // Of a quad, half the cross product of its diagonals is the vector area.
  const Vec3d a = vertices[face[2]] - vertices[face[0]];
  const Vec3d b = vertices[face[N - 1]] - vertices[face[1]];
  return 0.5 * a.cross(b).length() > kMinRelativeArea * longest * longest;
}

template <std::size_t N>
bool has_coincident_corners(const std::vector<Vec3d>& vertices, const Face<N>& face) {
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = i + 1; j < N; ++j) {
      if (vertices[face[i]] == vertices[face[j]]) return true;
    }
  }
  return false;
}

/// Reads the faces of one mesh and sorts out those that cannot be rendered.
template <std::size_t N>
std::vector<Face<N>> read_faces(const json& value, const std::vector<Vec3d>& vertices,
                                const std::string& key, const ShapePlace& place,
                                DiagnosticList& faults, std::vector<std::string>& warnings) {
  const std::string faces_pointer = child_pointer(place.pointer, key);
  std::vector<Face<N>> faces;
  bool sound = true;
  const auto fault = [&](const std::string& pointer, std::string message) {
    faults.add(place.document.value_at(pointer), pointer, std::move(message));
    sound = false;
  };
  faces.reserve(value.size());
  for (std::size_t f = 0; f < value.size(); ++f) {
    Face<N> face{};
    bool in_range = true;
    for (std::size_t c = 0; c < N; ++c) {
      const auto index = value[f][c].get<std::uint64_t>();
      if (index < vertices.size()) {
        face[c] = static_cast<std::uint32_t>(index);
        continue;
      }
      fault(child_pointer(child_pointer(faces_pointer, f), c),
            "vertex " + std::to_string(index) + " does not exist; the shape has vertices 0 to " +
                std::to_string(vertices.size() - 1));
      in_range = false;
    }
    if (!in_range || !has_area(vertices, face)) continue;
    if (N == 4 && has_coincident_corners(vertices, face)) {
      fault(child_pointer(faces_pointer, f),
            "two corners coincide: this is a triangle; give it in a shape of type \"triangles\"");
    }
    faces.push_back(face);
  }
  if (!sound) return faces;
  const std::size_t dropped = value.size() - faces.size();
  if (faces.empty()) {
    fault(faces_pointer, "no face has an area");
  } else if (dropped > 0) {
    warnings.push_back("shape \"" + place.name + "\": " + std::to_string(dropped) + " of " +
                       std::to_string(value.size()) + " " + key + " have no area and are left out");
  }
  return faces;
}

/// Which band covers each row.
/// @return empty, with faults added, unless every row is covered exactly once
std::vector<std::size_t> bands_of_rows(const json& bands, std::size_t row_count,
                                       const ShapePlace& place, DiagnosticList& faults) {
  constexpr std::size_t kNone = ~std::size_t{0};
  const std::string pointer = child_pointer(place.pointer, "rows");
  std::vector<std::size_t> result(row_count, kNone);
  bool sound = true;
  const auto fault = [&](const std::string& where, std::string message) {
    faults.add(place.document.value_at(where), where, std::move(message));
    sound = false;
  };
  for (std::size_t b = 0; b < bands.size(); ++b) {
    const auto first = bands[b]["rows"][0].get<std::size_t>();
    const auto last = bands[b]["rows"][1].get<std::size_t>();
    const std::string where = child_pointer(child_pointer(pointer, b), "rows");
    if (first > last || last >= row_count) {
      fault(where, "expected [first, last] with 0 <= first <= last <= " +
                       std::to_string(row_count - 1) + ", found " + bands[b]["rows"].dump());
      continue;
    }
    const auto begin = result.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = result.begin() + static_cast<std::ptrdiff_t>(last) + 1;
    const auto taken = std::find_if(begin, end, [](std::size_t band) { return band != kNone; });
    if (taken != end) {
      fault(where, "row " + std::to_string(taken - result.begin()) + " is also in band " +
                       std::to_string(*taken));
    }
    std::fill(begin, end, b);
  }
  const auto missing = std::find(result.begin(), result.end(), kNone);
  if (sound && missing != result.end()) {
    fault(pointer, "no band covers row " + std::to_string(missing - result.begin()) + " of " +
                       std::to_string(row_count));
  }
  return sound ? result : std::vector<std::size_t>();
}

/// Corners of the squares of a checkerboard; shared ones are bit-identical in every mesh that uses
/// them.
struct Grid {
  Vec3d origin, edge_u, edge_v;
  std::size_t columns, rows;

  Vec3d corner(std::size_t i, std::size_t j) const {
    return origin + edge_u * (static_cast<double>(i) / static_cast<double>(columns)) +
           edge_v * (static_cast<double>(j) / static_cast<double>(rows));
  }
};

/// One mesh under construction; a corner is added when its first square needs it.
class GridMesh {
 public:
  void add_square(const Grid& grid, std::size_t i, std::size_t j) {
    mesh.quads.push_back({vertex(grid, i, j), vertex(grid, i + 1, j), vertex(grid, i + 1, j + 1),
                          vertex(grid, i, j + 1)});
  }

  QuadMeshShape mesh;

 private:
  std::uint32_t vertex(const Grid& grid, std::size_t i, std::size_t j) {
    const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
    const auto [found, added] = index_.try_emplace({i, j}, next);
    if (added) mesh.vertices.push_back(grid.corner(i, j));
    return found->second;
  }

  std::map<std::pair<std::size_t, std::size_t>, std::uint32_t> index_;
};

}  // namespace

Vec3d read_vector(const json& value) {
  return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

Rgb read_rgb(const json& value) {
  if (value.is_number()) return Rgb(value.get<float>());
  return {value[0].get<float>(), value[1].get<float>(), value[2].get<float>()};
}

TriangleMeshShape read_triangles(const json& value, const ShapePlace& place, DiagnosticList& faults,
                                 std::vector<std::string>& warnings) {
  TriangleMeshShape mesh;
  mesh.vertices = read_vertices(value["vertices"]);
  mesh.triangles =
      read_faces<3>(value["triangles"], mesh.vertices, "triangles", place, faults, warnings);
  return mesh;
}

QuadMeshShape read_quads(const json& value, const ShapePlace& place, DiagnosticList& faults,
                         std::vector<std::string>& warnings) {
  QuadMeshShape mesh;
  mesh.vertices = read_vertices(value["vertices"]);
  mesh.quads = read_faces<4>(value["quads"], mesh.vertices, "quads", place, faults, warnings);
  return mesh;
}

std::vector<CheckerboardPart> expand_checkerboard(
    const json& value, const ShapePlace& place,
    const std::vector<std::array<std::uint32_t, 2>>& band_materials, DiagnosticList& faults) {
  const Grid grid{read_vector(value["origin"]), read_vector(value["edge_u"]),
                  read_vector(value["edge_v"]), value["squares"][0].get<std::size_t>(),
                  value["squares"][1].get<std::size_t>()};
  const double product = grid.edge_u.length() * grid.edge_v.length();
  if (!(grid.edge_u.cross(grid.edge_v).length() > kMinRelativeArea * product)) {
    const std::string pointer = child_pointer(place.pointer, "edge_v");
    faults.add(place.document.value_at(pointer), pointer, "edge_u and edge_v must span an area");
  }
  const std::vector<std::size_t> bands = bands_of_rows(value["rows"], grid.rows, place, faults);

  std::vector<std::pair<std::uint32_t, GridMesh>> meshes;
  for (std::size_t j = 0; j < bands.size(); ++j) {
    for (std::size_t i = 0; i < grid.columns; ++i) {
      const std::uint32_t material = band_materials[bands[j]][(i + j) % 2];
      auto found = std::find_if(meshes.begin(), meshes.end(),
                                [&](const auto& entry) { return entry.first == material; });
      if (found == meshes.end()) found = meshes.insert(found, {material, GridMesh()});
      found->second.add_square(grid, i, j);
    }
  }
  std::vector<CheckerboardPart> parts;
  for (auto& [material, builder] : meshes) parts.push_back({material, std::move(builder.mesh)});
  return parts;
}

}  // namespace penumbra
