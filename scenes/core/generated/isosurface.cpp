#include "scenes/core/generated/isosurface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

// Share of a lattice edge at either end that carries no vertex.
constexpr double kEdgeMargin = 0.15;
// Newton steps of a vertex towards the surface, and how far they may lead [cells].
constexpr int kNewtonSteps = 2;
constexpr double kMaxMove = 0.2;
// Differences for gradients are taken over this length [cells].
constexpr double kDifference = 0.05;
// Smallest area of a triangle [cells squared], and smallest cosine between a vertex's gradient and
// the faces around it.
constexpr double kMinArea = 2e-3;
constexpr double kMinAgreement = 0.5;
constexpr double kGrid = 0x1p20;  // roundings per unit of length

// A corner of a cell, or a direction of a lattice edge: one bit per axis.
using Bits = std::uint32_t;

struct Tetrahedron {
  std::array<Bits, 4> corners;  // positively oriented; each pair of corners spans a lattice edge
};

// One tetrahedron per order in which a walk from corner 0 to corner 7 takes the axes.
constexpr std::array<Tetrahedron, 6> kTetrahedra{{{{0, 1, 3, 7}},
                                                  {{0, 2, 6, 7}},
                                                  {{0, 4, 5, 7}},
                                                  {{0, 5, 1, 7}},
                                                  {{0, 3, 2, 7}},
                                                  {{0, 6, 4, 7}}}};

// Even orders of a tetrahedron's corners that bring a corner, or a pair of them, to the front.
constexpr std::array<std::array<std::size_t, 4>, 4> kCornerFirst{
    {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 0, 1, 3}, {3, 0, 2, 1}}};
constexpr std::array<std::array<std::size_t, 4>, 6> kPairFirst{
    {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}}};

using Face = std::array<std::uint32_t, 3>;

class Polygoniser {
 public:
  Polygoniser(const Field& field, const FieldBox& box) : field_(field), box_(box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<int>(axis);
      count_[axis] = static_cast<std::size_t>(std::ceil((box.high[a] - box.low[a]) / box.cell)) + 1;
    }
    sample();
    place_vertices();
    emit_faces();
    undo_collapses();
    align_normals();
  }

  TriangleMeshShape mesh;

 private:
  std::size_t index(std::size_t x, std::size_t y, std::size_t z) const {
    return (z * count_[1] + y) * count_[0] + x;
  }
  std::size_t step(Bits bits) const { return index(bits & 1, bits >> 1 & 1, bits >> 2 & 1); }
  Vec3d position(std::size_t x, std::size_t y, std::size_t z) const {
    return box_.low +
           Vec3d(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)) *
               box_.cell;
  }
  bool inside(std::size_t point) const { return values_[point] < 0.0; }

  // Calls visit(z, y, x) for a layer of `upto` points per axis.
  template <typename Visit>
  static void for_layer(std::size_t z, const std::array<std::size_t, 3>& upto, Visit visit) {
    for (std::size_t y = 0; y < upto[1]; ++y) {
      for (std::size_t x = 0; x < upto[0]; ++x) visit(x, y, z);
    }
  }

  void sample() {
    values_.resize(count_[0] * count_[1] * count_[2]);
    tbb::parallel_for(std::size_t{0}, count_[2], [&](std::size_t layer) {
      for_layer(layer, count_, [&](std::size_t x, std::size_t y, std::size_t z) {
        const double value = field_(position(x, y, z));
        const bool border = x == 0 || y == 0 || z == 0 || x + 1 == count_[0] ||
                            y + 1 == count_[1] || z + 1 == count_[2];
        PN_CHECK(!border || value > 0.0, "a field is positive on its box");
        values_[index(x, y, z)] = value;
      });
    });
  }

  // Which of the 7 edges that start at a point carry a vertex: bit d for direction d.
  std::uint8_t crossed_edges(std::size_t x, std::size_t y, std::size_t z) const {
    std::uint8_t mask = 0;
    const std::size_t here = index(x, y, z);
    for (Bits d = 1; d < 8; ++d) {
      if (x + (d & 1) >= count_[0] || y + (d >> 1 & 1) >= count_[1] || z + (d >> 2) >= count_[2]) {
        continue;
      }
      if (inside(here) != inside(here + step(d))) mask = static_cast<std::uint8_t>(mask | 1u << d);
    }
    return mask;
  }

  void place_vertices() {
    masks_.resize(values_.size());
    first_vertex_.resize(values_.size());
    std::vector<std::uint32_t> per_layer(count_[2] + 1, 0);
    tbb::parallel_for(std::size_t{0}, count_[2], [&](std::size_t layer) {
      for_layer(layer, count_, [&](std::size_t x, std::size_t y, std::size_t z) {
        const std::size_t here = index(x, y, z);
        masks_[here] = crossed_edges(x, y, z);
        first_vertex_[here] = per_layer[layer + 1];
        per_layer[layer + 1] += static_cast<std::uint32_t>(std::popcount(masks_[here]));
      });
    });
    std::partial_sum(per_layer.begin(), per_layer.end(), per_layer.begin());
    mesh.vertices.resize(per_layer.back());
    mesh.normals.resize(per_layer.back());
    on_edge_.resize(per_layer.back());
    tbb::parallel_for(std::size_t{0}, count_[2], [&](std::size_t layer) {
      for_layer(layer, count_, [&](std::size_t x, std::size_t y, std::size_t z) {
        const std::size_t here = index(x, y, z);
        first_vertex_[here] += per_layer[layer];
        std::uint32_t vertex = first_vertex_[here];
        for (Bits d = 1; d < 8; ++d) {
          if ((masks_[here] >> d & 1u) != 0) place_vertex(vertex++, position(x, y, z), here, d);
        }
      });
    });
  }

  // Moves vertices back to their edges, where no triangle can degenerate, until none is thin or
  // turned over: near creases that are finer than the lattice, gradients lead to the same place.
  void undo_collapses() {
    const double least = kMinArea * box_.cell * box_.cell;
    const auto area = [&](const std::vector<Vec3d>& at, const Face& f) {
      return (at[f[1]] - at[f[0]]).cross(at[f[2]] - at[f[0]]) * 0.5;
    };
    for (bool changed = true; changed;) {
      changed = false;
      for (const Face& face : mesh.triangles) {
        const Vec3d moved = area(mesh.vertices, face);
        if (moved.length() >= least && moved.dot(area(on_edge_, face)) > 0.0) continue;
        for (const std::uint32_t v : face) {
          changed = changed || mesh.vertices[v] != on_edge_[v];
          mesh.vertices[v] = on_edge_[v];
        }
      }
    }
  }

  // A gradient beside such a crease may belong to its other side: where it is far from the normal
  // of the faces around, that one is taken.
  void align_normals() {
    std::vector<Vec3d> sums(mesh.vertices.size(), Vec3d(0.0));
    for (const Face& f : mesh.triangles) {
      const Vec3d n = (mesh.vertices[f[1]] - mesh.vertices[f[0]])
                          .cross(mesh.vertices[f[2]] - mesh.vertices[f[0]]);
      for (const std::uint32_t v : f) sums[v] += n;
    }
    for (std::size_t v = 0; v < sums.size(); ++v) {
      const Vec3d faces = sums[v].normalized();
      if (!(faces.dot(Vec3d(mesh.normals[v])) > kMinAgreement)) {
        mesh.normals[v] = rounded_normal(faces);
      }
    }
  }

  static Vec3 rounded_normal(const Vec3d& n) {
    return {static_cast<float>(std::round(n.x * kGrid) / kGrid),
            static_cast<float>(std::round(n.y * kGrid) / kGrid),
            static_cast<float>(std::round(n.z * kGrid) / kGrid)};
  }

  static Vec3d rounded(const Vec3d& p) {
    return {std::round(p.x * kGrid) / kGrid, std::round(p.y * kGrid) / kGrid,
            std::round(p.z * kGrid) / kGrid};
  }

  void place_vertex(std::uint32_t vertex, const Vec3d& start, std::size_t here, Bits direction) {
    const double a = values_[here];
    const double b = values_[here + step(direction)];
    const double t = std::clamp(a / (a - b), kEdgeMargin, 1.0 - kEdgeMargin);
    const Vec3d edge = Vec3d(direction & 1, direction >> 1 & 1, direction >> 2) * box_.cell;
    const Vec3d on_edge = start + edge * t;
    Vec3d p = on_edge;
    Vec3d gradient(0.0);
    for (int i = 0; i <= kNewtonSteps; ++i) {
      double value = 0.0;
      gradient = gradient_at(p, value);
      if (i == kNewtonSteps || gradient.length2() == 0.0) break;
      Vec3d move = p - gradient * (value / gradient.length2()) - on_edge;
      const double limit = kMaxMove * box_.cell;
      if (move.length() > limit) move *= limit / move.length();
      p = on_edge + move;
    }
    on_edge_[vertex] = rounded(on_edge);
    mesh.vertices[vertex] = rounded(p);
    mesh.normals[vertex] = rounded_normal(gradient.normalized());
  }

  // Gradient, and the field's mean around p, from the corners of a small tetrahedron.
  Vec3d gradient_at(const Vec3d& p, double& value) const {
    const double h = kDifference * box_.cell;
    Vec3d gradient(0.0);
    value = 0.0;
    for (const Vec3d& corner :
         {Vec3d(1, -1, -1), Vec3d(-1, -1, 1), Vec3d(-1, 1, -1), Vec3d(1, 1, 1)}) {
      const double f = field_(p + corner * h);
      gradient += corner * (f / (4.0 * h));
      value += f / 4.0;
    }
    return gradient;
  }

  void emit_faces() {
    std::vector<std::vector<Face>> layers(count_[2] - 1);
    const std::array<std::size_t, 3> cells{count_[0] - 1, count_[1] - 1, count_[2] - 1};
    tbb::parallel_for(std::size_t{0}, cells[2], [&](std::size_t layer) {
      for_layer(layer, cells, [&](std::size_t x, std::size_t y, std::size_t z) {
        emit_cell(index(x, y, z), layers[layer]);
      });
    });
    for (const auto& layer : layers) {
      mesh.triangles.insert(mesh.triangles.end(), layer.begin(), layer.end());
    }
  }

  void emit_cell(std::size_t here, std::vector<Face>& faces) const {
    int insides = 0;
    for (Bits corner = 0; corner < 8; ++corner) insides += inside(here + step(corner)) ? 1 : 0;
    if (insides == 0 || insides == 8) return;
    for (const Tetrahedron& tetrahedron : kTetrahedra) emit_tetrahedron(here, tetrahedron, faces);
  }

  // The vertex on the edge between two corners of a cell.
  std::uint32_t vertex(std::size_t here, Bits a, Bits b) const {
    const Bits low = a & b;  // one corner's bits contain the other's
    const std::size_t start = here + step(low);
    const std::uint32_t before = masks_[start] & ((1u << (a ^ b)) - 1u);
    return first_vertex_[start] + static_cast<std::uint32_t>(std::popcount(before));
  }

  void emit_tetrahedron(std::size_t here, const Tetrahedron& tetrahedron,
                        std::vector<Face>& faces) const {
    const auto& c = tetrahedron.corners;
    std::array<bool, 4> in{};
    int insides = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      in[i] = inside(here + step(c[i]));
      insides += in[i] ? 1 : 0;
    }
    const auto cut = [&](std::size_t i, std::size_t j) { return vertex(here, c[i], c[j]); };
    if (insides == 1 || insides == 3) {
      for (const auto& o : kCornerFirst) {
        if (in[o[0]] != (insides == 1)) continue;
        Face face{cut(o[0], o[1]), cut(o[0], o[2]), cut(o[0], o[3])};
        if (insides == 3) std::swap(face[1], face[2]);
        faces.push_back(face);
      }
    } else if (insides == 2) {
      for (const auto& o : kPairFirst) {
        if (!in[o[0]] || !in[o[1]]) continue;
        add_quad({cut(o[0], o[2]), cut(o[0], o[3]), cut(o[1], o[3]), cut(o[1], o[2])}, faces);
      }
    }
  }

  // Cut along the shorter diagonal.
  void add_quad(const std::array<std::uint32_t, 4>& q, std::vector<Face>& faces) const {
    const auto diagonal2 = [&](std::size_t i, std::size_t j) {
      return (mesh.vertices[q[i]] - mesh.vertices[q[j]]).length2();
    };
    if (diagonal2(0, 2) <= diagonal2(1, 3)) {
      faces.insert(faces.end(), {Face{q[0], q[1], q[2]}, Face{q[0], q[2], q[3]}});
    } else {
      faces.insert(faces.end(), {Face{q[0], q[1], q[3]}, Face{q[1], q[2], q[3]}});
    }
  }

  const Field& field_;
  FieldBox box_;
  std::array<std::size_t, 3> count_{};       // lattice points per axis
  std::vector<double> values_;               // [point]
  std::vector<std::uint8_t> masks_;          // [point]
  std::vector<std::uint32_t> first_vertex_;  // [point] of those on its edges
  std::vector<Vec3d> on_edge_;               // [vertex] before it is moved
};

// The representative of each vertex's connected part.
std::vector<std::uint32_t> connected_parts(const TriangleMeshShape& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Face& face : mesh.triangles) {
    for (std::size_t i = 1; i < 3; ++i) {
      const std::uint32_t a = find(face[0]);
      const std::uint32_t b = find(face[i]);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = find(v);
  return parent;
}

TriangleMeshShape largest_part(const TriangleMeshShape& mesh) {
  const std::vector<std::uint32_t> part = connected_parts(mesh);
  std::vector<std::uint32_t> size(part.size(), 0);
  for (const std::uint32_t p : part) ++size[p];
  const auto largest =
      static_cast<std::uint32_t>(std::max_element(size.begin(), size.end()) - size.begin());
  TriangleMeshShape result;
  std::vector<std::uint32_t> moved(part.size(), 0);
  for (std::size_t v = 0; v < part.size(); ++v) {
    if (part[v] != largest) continue;
    moved[v] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(mesh.vertices[v]);
    result.normals.push_back(mesh.normals[v]);
  }
  for (const Face& face : mesh.triangles) {
    if (part[face[0]] != largest) continue;
    result.triangles.push_back({moved[face[0]], moved[face[1]], moved[face[2]]});
  }
  return result;
}

}  // namespace

TriangleMeshShape polygonise(const Field& field, const FieldBox& box) {
  return largest_part(Polygoniser(field, box).mesh);
}

}  // namespace penumbra
