#include "scenes/core/generated/generated.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "scenes/core/generated/isosurface.h"

namespace penumbra {
namespace {

// What a mesh of indexed triangles is, topologically.
struct Topology {
  std::size_t unmatched_edges{0};    // not shared by exactly two faces in opposite directions
  std::size_t non_disc_vertices{0};  // whose faces do not form one ring
  std::size_t parts{0};
  long euler_characteristic{0};

  bool closed_manifold() const { return unmatched_edges == 0 && non_disc_vertices == 0; }
  /// Of one closed part: chi = 2 - 2 genus.
  long genus() const { return (2 - euler_characteristic) / 2; }
};

// Directed edges by the vertex that they start at, each with the third corner of its face.
class Edges {
 public:
  explicit Edges(const TriangleMeshShape& mesh) : first_(mesh.vertices.size() + 1, 0) {
    for (const auto& t : mesh.triangles) {
      for (const std::uint32_t v : t) ++first_[v + 1];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    edges_.resize(mesh.triangles.size() * 3);
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const auto& t : mesh.triangles) {
      for (std::size_t i = 0; i < 3; ++i) {
        edges_[next[t[i]]++] = {t[(i + 1) % 3], t[(i + 2) % 3]};
      }
    }
  }

  struct Edge {
    std::uint32_t to, third;
  };
  std::span<const Edge> from(std::uint32_t vertex) const {
    return std::span(edges_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }
  /// Edges from one vertex to another; 1 in a sound mesh where there is an edge.
  std::size_t count(std::uint32_t vertex, std::uint32_t to) const {
    const auto edges = from(vertex);
    return static_cast<std::size_t>(
        std::count_if(edges.begin(), edges.end(), [&](const Edge& e) { return e.to == to; }));
  }
  std::uint32_t third(std::uint32_t vertex, std::uint32_t to) const {
    const auto edges = from(vertex);
    return std::find_if(edges.begin(), edges.end(), [&](const Edge& e) { return e.to == to; })
        ->third;
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<Edge> edges_;
};

// Whether the faces around a vertex form one ring.
bool is_disc(const Edges& edges, std::uint32_t vertex) {
  const auto around = edges.from(vertex);
  if (around.empty()) return false;
  std::size_t faces = 0;
  std::uint32_t at = around[0].to;
  do {
    at = edges.third(vertex, at);
    ++faces;
  } while (at != around[0].to && faces <= around.size());
  return faces == around.size();
}

std::size_t connected_parts(const Edges& edges, std::size_t vertices) {
  std::size_t parts = 0;
  std::vector<bool> seen(vertices, false);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (seen[v]) continue;
    ++parts;
    std::vector<std::uint32_t> open{v};
    while (!open.empty()) {
      const std::uint32_t u = open.back();
      open.pop_back();
      if (seen[u]) continue;
      seen[u] = true;
      for (const Edges::Edge& e : edges.from(u)) open.push_back(e.to);
    }
  }
  return parts;
}

Topology topology(const TriangleMeshShape& mesh) {
  Topology result;
  const Edges edges(mesh);
  const auto vertices = static_cast<std::uint32_t>(mesh.vertices.size());
  for (std::uint32_t v = 0; v < vertices; ++v) {
    for (const Edges::Edge& e : edges.from(v)) {
      const bool matched = edges.count(v, e.to) == 1 && edges.count(e.to, v) == 1;
      result.unmatched_edges += matched ? 0 : 1;
    }
  }
  if (result.unmatched_edges > 0) return result;
  for (std::uint32_t v = 0; v < vertices; ++v)
    result.non_disc_vertices += is_disc(edges, v) ? 0 : 1;
  result.parts = connected_parts(edges, vertices);
  const auto faces = static_cast<long>(mesh.triangles.size());
  result.euler_characteristic = static_cast<long>(vertices) - faces * 3 / 2 + faces;
  return result;
}

Vec3d face_vector(const TriangleMeshShape& mesh, const std::array<std::uint32_t, 3>& t) {
  return (mesh.vertices[t[1]] - mesh.vertices[t[0]])
             .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]) *
         0.5;
}

double signed_volume(const TriangleMeshShape& mesh) {
  double volume = 0.0;
  for (const auto& t : mesh.triangles) {
    volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6.0;
  }
  return volume;
}

double area(const TriangleMeshShape& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) sum += face_vector(mesh, t).length();
  return sum;
}

bool same(const TriangleMeshShape& a, const TriangleMeshShape& b) {
  return a.vertices == b.vertices && a.triangles == b.triangles && a.normals == b.normals;
}

void expect_sound(const TriangleMeshShape& mesh, const std::string& name) {
  const Topology shape = topology(mesh);
  EXPECT_TRUE(shape.closed_manifold()) << name << ": " << shape.unmatched_edges << " edges, "
                                       << shape.non_disc_vertices << " vertices";
  EXPECT_EQ(shape.parts, 1u) << name;
  EXPECT_GT(signed_volume(mesh), 0.0) << name << ": normals point outwards";
  ASSERT_EQ(mesh.normals.size(), mesh.vertices.size());
  for (const Vec3& n : mesh.normals) ASSERT_NEAR(n.length(), 1.0f, 1e-5f) << name;
  const double mean_area = area(mesh) / static_cast<double>(mesh.triangles.size());
  std::size_t against = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3d face = face_vector(mesh, t);
    ASSERT_GT(face.length(), 1e-3 * mean_area) << name;
    for (const std::uint32_t v : t) against += face.dot(Vec3d(mesh.normals[v])) <= 0.0 ? 1 : 0;
  }
  // Corners of faces at sharp creases, where one normal serves both sides.
  EXPECT_LT(static_cast<double>(against), 2e-3 * 3.0 * static_cast<double>(mesh.triangles.size()))
      << name;
}

TEST(Isosurface, OfASphereIsTheSphere) {
  const Field sphere = [](const Vec3d& p) { return p.length() - 1.0; };
  const TriangleMeshShape mesh = polygonise(sphere, {Vec3d(-1.2), Vec3d(1.2), 0.05});
  expect_sound(mesh, "sphere");
  EXPECT_EQ(topology(mesh).genus(), 0);
  std::size_t off = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const double distance = std::abs(mesh.vertices[i].length() - 1.0);
    off += distance > 1e-4 ? 1 : 0;
    ASSERT_LT(distance, 0.15 * 0.05 * std::sqrt(3.0)) << "never beyond the edges' margin";
    ASSERT_GT(mesh.vertices[i].normalized().dot(Vec3d(mesh.normals[i])), 0.999);
  }
  EXPECT_LT(off, mesh.vertices.size() / 100) << "the others are moved onto the surface";
  // Flat faces of edges up to h sqrt(3) lose of the order of h^2.
  EXPECT_NEAR(signed_volume(mesh), 4.0 / 3.0 * M_PI, 0.01);
  EXPECT_NEAR(area(mesh), 4.0 * M_PI, 0.02);
}

TEST(Isosurface, OfATorusHasGenusOne) {
  const Field torus = [](const Vec3d& p) {
    return std::hypot(std::hypot(p.x, p.z) - 0.7, p.y) - 0.2;
  };
  const TriangleMeshShape mesh = polygonise(torus, {Vec3d(-1.0), Vec3d(1.0), 0.06});
  expect_sound(mesh, "torus");
  EXPECT_EQ(topology(mesh).genus(), 1);
  EXPECT_NEAR(signed_volume(mesh), 2.0 * M_PI * M_PI * 0.7 * 0.04, 0.02);
}

TEST(Isosurface, OfNoiseIsAClosedManifold) {
  // Signs without any order: every ambiguous case of other methods occurs.
  const Field noise = [](const Vec3d& p) {
    if (p.length() > 1.0) return 1.0;
    const double x = std::sin(p.dot(Vec3d(127.1, 311.7, 74.7))) * 43758.5453;
    return x - std::floor(x) - 0.5;
  };
  const TriangleMeshShape mesh = polygonise(noise, {Vec3d(-1.2), Vec3d(1.2), 0.13});
  const Topology shape = topology(mesh);
  EXPECT_TRUE(shape.closed_manifold());
  EXPECT_EQ(shape.parts, 1u) << "crumbs are left out";
  EXPECT_GT(shape.genus(), 10);
}

TEST(Isosurface, TestsOfTopologyFindDamage) {  // negative control
  const Field sphere = [](const Vec3d& p) { return p.length() - 1.0; };
  const TriangleMeshShape sound = polygonise(sphere, {Vec3d(-1.2), Vec3d(1.2), 0.3});
  TriangleMeshShape hole = sound;
  hole.triangles.pop_back();
  EXPECT_FALSE(topology(hole).closed_manifold());
  TriangleMeshShape turned = sound;
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_FALSE(topology(turned).closed_manifold());
  TriangleMeshShape pinched = sound;  // two far vertices become one
  for (auto& t : pinched.triangles) {
    for (auto& v : t) v = v == 0 ? static_cast<std::uint32_t>(sound.vertices.size() - 1) : v;
  }
  EXPECT_FALSE(topology(pinched).closed_manifold());
}

TEST(Generated, StatueIsASoundSurfaceOfGenusZero) {
  const TriangleMeshShape mesh = generate_statue();
  expect_sound(mesh, "statue");
  EXPECT_EQ(topology(mesh).genus(), 0);
  EXPECT_GE(mesh.triangles.size(), 100000u);
}

TEST(Generated, LanternHasTheSevenOpeningsOfItsDesign) {
  const TriangleMeshShape mesh = generate_lantern();
  expect_sound(mesh, "lantern");
  EXPECT_EQ(topology(mesh).genus(), 6);  // a shell with k openings has genus k - 1
}

TEST(Generated, HighGenusIsAboveFifty) {
  const TriangleMeshShape mesh = generate_high_genus();
  expect_sound(mesh, "high_genus");
  EXPECT_GT(topology(mesh).genus(), 50);
}

TEST(Generated, GivesTheSameBitsOnAnyNumberOfThreads) {
  for (const Generator& generator : kGenerators) {
    const TriangleMeshShape first = generator.generate(0.3);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_TRUE(same(first, generator.generate(0.3))) << generator.name;
  }
}

TEST(Generated, DetailChangesTheTrianglesAndKeepsTheObject) {
  for (const Generator& generator : kGenerators) {
    const TriangleMeshShape coarse = generator.generate(0.4);
    const TriangleMeshShape fine = generator.generate(0.8);
    const double ratio =
        static_cast<double>(fine.triangles.size()) / static_cast<double>(coarse.triangles.size());
    EXPECT_NEAR(ratio, 4.0, 0.6) << generator.name;
    // The coarse lattice cuts through walls that are thinner than its cells.
    EXPECT_NEAR(signed_volume(fine) / signed_volume(coarse), 1.0, 0.1) << generator.name;
    for (const TriangleMeshShape& mesh : {coarse, fine}) {
      EXPECT_TRUE(topology(mesh).closed_manifold()) << generator.name;
    }
  }
}

}  // namespace
}  // namespace penumbra
