#include "scenes/core/models/mesh_tools.h"

#include <algorithm>
#include <numeric>
#include <system_error>
#include <utility>

#include "scenes/core/error.h"
#include "scenes/core/file_bytes.h"

namespace penumbra {
namespace {

/// Twice the vector area: Newell's sum, relative to the first corner against cancellation.
Vec3d newell_normal(std::span<const Vec3d> corners) {
  Vec3d normal(0.0);
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    normal += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  }
  return normal;
}

double turn(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& normal) {
  return (b - a).cross(c - b).dot(normal);
}

bool is_convex(std::span<const Vec3d> corners, const Vec3d& normal) {
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (turn(corners[i], corners[(i + 1) % n], corners[(i + 2) % n], normal) < 0.0) return false;
    // A star turns left at every corner as well, but its fan turns back.
    if (i + 2 < n &&
        (corners[i + 1] - corners[0]).cross(corners[i + 2] - corners[0]).dot(normal) < 0.0) {
      return false;
    }
  }
  return true;
}

bool contains(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& p, const Vec3d& normal) {
  return (b - a).cross(p - a).dot(normal) >= 0.0 && (c - b).cross(p - b).dot(normal) >= 0.0 &&
         (a - c).cross(p - c).dot(normal) >= 0.0;
}

/// Cuts off one ear after the other; where none is left (a polygon that crosses itself), the next
/// corner, so that the surface stays closed.
void clip_ears(std::span<const Vec3d> corners, const Vec3d& normal,
               std::vector<std::array<std::uint32_t, 3>>& out) {
  std::vector<std::uint32_t> ring(corners.size());
  std::iota(ring.begin(), ring.end(), 0u);
  const auto is_ear = [&](std::size_t i) {
    const std::size_t n = ring.size();
    const std::uint32_t ia = ring[(i + n - 1) % n], ib = ring[i], ic = ring[(i + 1) % n];
    const Vec3d &a = corners[ia], &b = corners[ib], &c = corners[ic];
    if (turn(a, b, c, normal) <= 0.0) return false;
    return std::none_of(ring.begin(), ring.end(), [&](std::uint32_t k) {
      const Vec3d& p = corners[k];
      return k != ia && k != ib && k != ic && p != a && p != b && p != c &&
             contains(a, b, c, p, normal);
    });
  };
  while (ring.size() > 3) {
    std::size_t ear = 0;
    while (ear < ring.size() && !is_ear(ear)) ++ear;
    if (ear == ring.size()) ear = 1;
    const std::size_t n = ring.size();
    out.push_back({ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  out.push_back({ring[0], ring[1], ring[2]});
}

}  // namespace

void model_error(const std::filesystem::path& file, const std::string& message) {
  throw InputError(file.string() + ": error: " + message);
}

void model_error(const std::filesystem::path& file, int line, const std::string& message) {
  throw InputError(file.string() + ":" + std::to_string(line) + ": error: " + message);
}

bool triangulate(std::span<const Vec3d> corners, std::vector<std::array<std::uint32_t, 3>>& out) {
  if (corners.size() == 3) {
    out.push_back({0, 1, 2});
    return true;
  }
  const Vec3d normal = newell_normal(corners);
  if (normal == Vec3d(0.0)) return true;
  if (corners.size() == 4) {
    // Of a quadrilateral that is not flat or not convex, the diagonal whose triangles agree best.
    const double d02 = std::min(turn(corners[0], corners[1], corners[2], normal),
                                turn(corners[2], corners[3], corners[0], normal));
    const double d13 = std::min(turn(corners[1], corners[2], corners[3], normal),
                                turn(corners[3], corners[0], corners[1], normal));
    if (d02 >= d13) {
      out.insert(out.end(), {{0, 1, 2}, {0, 2, 3}});
    } else {
      out.insert(out.end(), {{0, 1, 3}, {1, 2, 3}});
    }
    return true;
  }
  if (is_convex(corners, normal)) {
    for (std::uint32_t i = 1; i + 1 < corners.size(); ++i) out.push_back({0, i, i + 1});
    return true;
  }
  if (corners.size() > kMaxConcaveCorners) return false;
  clip_ears(corners, normal, out);
  return true;
}

bool has_area(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  // As in a scene file: an area below this part of the longest side squared is rounding.
  constexpr double kMinRelativeArea = 1e-14;
  const Vec3d ab = b - a, bc = c - b, ca = a - c;
  const double longest2 = std::max({ab.length2(), bc.length2(), ca.length2()});
  return 0.5 * ab.cross(bc).length() > kMinRelativeArea * longest2;
}

bool has_repeats(std::span<const std::uint32_t> corners) {
  std::vector<std::uint32_t> sorted(corners.begin(), corners.end());
  std::sort(sorted.begin(), sorted.end());
  return std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end();
}

std::string UniqueNames::settle(const std::string& wanted) {
  std::string name = wanted;
  if (taken_.insert(name).second) return name;
  // Going on from the last number keeps many shapes of one name from taking for ever.
  int& number = last_.try_emplace(wanted, 1).first->second;
  do {
    name = wanted + "." + std::to_string(++number);
  } while (!taken_.insert(name).second);
  return name;
}

void ModelBuilder::add_mesh(const std::string& name, std::uint32_t material, TriangleMeshShape mesh,
                            const std::optional<EmissionDescription>& emission,
                            std::size_t left_out) {
  const std::size_t found = mesh.triangles.size() + left_out;
  std::erase_if(mesh.triangles, [&](const std::array<std::uint32_t, 3>& t) {
    return !has_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  });
  const std::string unique = unique_name(name);
  if (mesh.triangles.empty()) {
    warn("shape \"" + unique + "\": no face has an area; it is left out");
    return;
  }
  if (mesh.triangles.size() < found) {
    warn("shape \"" + unique + "\": " + std::to_string(found - mesh.triangles.size()) + " of " +
         std::to_string(found) + " triangles have no area and are left out");
  }
  model_.shapes.push_back({unique, material, std::move(mesh), emission});
}

void ModelBuilder::add_cage(const std::string& name, std::uint32_t material, SubdivisionShape cage,
                            const std::optional<EmissionDescription>& emission) {
  model_.shapes.push_back({unique_name(name), material, std::move(cage), emission});
}

TextureDescription ModelBuilder::texture(const std::filesystem::path& image,
                                         const std::string& place, const std::string& use) {
  TextureDescription texture;
  std::error_code ignored;
  texture.file = std::filesystem::absolute(image, ignored).lexically_normal().string();
  if (!std::filesystem::is_regular_file(texture.file, ignored)) {
    throw InputError(place + ": error: " + use + ": the image file " + texture.file +
                     " does not exist");
  }
  std::string& hash = hashes_[texture.file];
  if (hash.empty()) hash = hash_file(texture.file);
  texture.content_hash = hash;
  return texture;
}

Model ModelBuilder::take() {
  if (model_.shapes.empty()) model_error(file_, "has no face with an area");
  return std::move(model_);
}

}  // namespace penumbra
