#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "scenes/core/vec.h"

namespace penumbra {

/// What a ray met first.
struct RayHit {
  static constexpr std::uint32_t kMiss = 0xffffffffu;
  std::uint32_t geometry{kMiss};  ///< index in the order of addition to the RayScene
  std::uint32_t primitive{0};
  float u{0}, v{0};   ///< barycentric (triangle), bilinear (quad) or Embree's own (subdivision)
                      ///< coordinates
  float distance{0};  ///< along the ray; infinite for a miss
  Vec3 normal{0.0f};  ///< geometric, right-handed, any length

  bool hit() const noexcept { return geometry != kMiss; }
};

/// Whether a ray is finite and has a direction. Embree's traversal relies on it: what is not finite
/// overflows its stack, and a ray without a direction meets everything and nothing.
inline bool is_traceable(const Vec3& origin, const Vec3& direction) noexcept {
  // Products with 0 are 0 exactly where all are finite.
  const Vec3 zeros = origin * 0.0f + direction * 0.0f;
  const bool has_direction = (direction.x != 0.0f) | (direction.y != 0.0f) | (direction.z != 0.0f);
  return (zeros.x + zeros.y + zeros.z == 0.0f) & has_direction;
}

/// Rays to be traced together, structure of arrays. One per estimator thread; the capacity is fixed
/// when it is made, so that filling it allocates nothing.
class RayBatch {
 public:
  explicit RayBatch(std::size_t capacity);

  void clear() noexcept { count_ = 0; }
  std::size_t size() const noexcept { return count_; }
  std::size_t capacity() const noexcept { return ox.size() - kPadding; }

  /// Adds a ray. A ray that is not finite or has no direction is never traced: it counts as a miss,
  /// and `untraced` tells.
  void add(const Vec3& origin, const Vec3& direction) noexcept {
    const std::size_t i = count_++;
    ox[i] = origin.x, oy[i] = origin.y, oz[i] = origin.z;
    dx[i] = direction.x, dy[i] = direction.y, dz[i] = direction.z;
  }

  Vec3 origin(std::size_t i) const noexcept { return {ox[i], oy[i], oz[i]}; }
  Vec3 direction(std::size_t i) const noexcept { return {dx[i], dy[i], dz[i]}; }

  /// Rays that the last query left out because they are not finite or have no direction: the fault
  /// of whoever made them.
  std::size_t untraced() const noexcept { return untraced_; }

  static constexpr std::size_t kPadding = 16;  ///< spare lanes behind the last ray, for packets
  std::vector<float> ox, oy, oz, dx, dy, dz;
  std::vector<RayHit> hits;  ///< [ray]; written by RayScene::intersect

 private:
  friend class RayScene;

  std::size_t count_{0};
  std::size_t untraced_{0};
};

/// Keeps every ray that passes through a scene's batch query, to trace the same rays again alone
/// (BareRays). For one thread.
struct RayRecorder {
  std::vector<Vec3> origins, directions;  ///< [ray]
  std::vector<std::size_t> batch_sizes;   ///< rays of each batch that has any

  void add(const RayBatch& batch) {
    if (batch.size() > 0) batch_sizes.push_back(batch.size());
    for (std::size_t i = 0; i < batch.size(); ++i) {
      origins.push_back(batch.origin(i));
      directions.push_back(batch.direction(i));
    }
  }
};

/// Decides which hits of a surface with holes count.
class HitFilter {
 public:
  virtual ~HitFilter() = default;

  /// Whether the surface exists at a place; called from many threads.
  /// @param geometry, primitive, u, v  as in RayHit
  virtual bool exists(std::uint32_t geometry, std::uint32_t primitive, float u,
                      float v) const noexcept = 0;
};

/// Geometry and closest-hit queries: the one place, with
/// bare_rays.h, that knows Embree. Works with Embree 3 and 4.
class RayScene {
 public:
  /// What the scene is asked for.
  enum class Query : std::uint8_t {
    Closest,    ///< `intersect`
    Crossings,  ///< `visit_crossings`
  };

  enum class Precision : std::uint8_t {
    Robust,  ///< watertight edges, and no hits lost far from the origin
    Fast,    ///< for measurements: misses 12 to 20 % of rays far from the origin
  };

  explicit RayScene(Query query = Query::Closest, Precision precision = Precision::Robust);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Each returns the geometry's index. Data is copied.
  /// @param filter  of a surface with holes; must outlive the scene
  std::uint32_t add_triangles(std::span<const Vec3> vertices,
                              std::span<const std::uint32_t> indices,
                              const HitFilter* filter = nullptr);
  std::uint32_t add_quads(std::span<const Vec3> vertices, std::span<const std::uint32_t> indices,
                          const HitFilter* filter = nullptr);
  std::uint32_t add_sphere(const Vec3& center, float radius);
  /// Catmull-Clark surface of a control cage; rays meet its tessellation. Edges of the cage that
  /// bound one face only become smooth curves.
  /// @param face_sizes  corners of each face
  /// @param level       segments of the tessellation per edge of the cage; per edge and half in
  ///                    faces that are not quadrilaterals
  std::uint32_t add_subdivision(std::span<const Vec3> vertices,
                                std::span<const std::uint32_t> face_sizes,
                                std::span<const std::uint32_t> indices, int level);
  /// Builds the acceleration structure; nothing can be added afterwards.
  void commit();

  /// Fills `batch.hits` with the closest hit of each ray beyond its origin, and states how many
  /// rays it left out.
  void intersect(RayBatch& batch) const noexcept;

  /// Normal of the limit surface at a hit on a subdivision surface, right-handed, any length; 0
  /// where the surface has none.
  Vec3 subdivision_normal(const RayHit& hit) const noexcept;

  /// Calls visit(distance, normal) for every triangle that a ray crosses beyond its origin, in no
  /// particular order; the normal is geometric and has any length. From any number of threads,
  /// without allocation. Only with Query::Crossings.
  /// @param direction  unit
  template <typename Visit>
  void visit_crossings(const Vec3& origin, const Vec3& direction, Visit visit) const noexcept {
    for_each_crossing(
        origin, direction,
        [](void* self, float distance, const Vec3& normal) {
          (*static_cast<Visit*>(self))(distance, normal);
        },
        &visit);
  }

  /// Bytes of the acceleration structure and geometry, as Embree reports its allocations.
  std::size_t memory_bytes() const noexcept;

  /// The RTCScene, for the other files of the ray tracer.
  void* embree_scene() const noexcept;

  /// "Embree 3.13.5" and the like.
  static std::string version();

 private:
  using VisitCrossing = void (*)(void* self, float distance, const Vec3& normal);
  void for_each_crossing(const Vec3& origin, const Vec3& direction, VisitCrossing visit,
                         void* self) const noexcept;

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Moves a ray's origin off the surface it lies on, by a distance that follows the floating-point
/// grid and so needs no scene-dependent epsilon.
/// @param normal  unit, on the side the ray leaves to
/// Source: Waechter and Binder 2019, "A fast and robust method for avoiding self-intersection".
Vec3 offset_ray_origin(const Vec3& position, const Vec3& normal) noexcept;

}  // namespace penumbra
