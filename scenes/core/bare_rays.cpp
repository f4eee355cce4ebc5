#include "scenes/core/bare_rays.h"

#include <variant>
#include <vector>

#include "scenes/core/embree_calls.h"

namespace penumbra {
namespace {

// Rays of one kind of packet. A packet is copied before it is traced, because Embree writes into
// it; that is the set-up which every ray needs.
template <typename Packet, std::size_t kLanes>
struct Packets {
  struct Item {
    Packet rays;
    alignas(64) int valid[kLanes];
  };
  std::vector<Item> items;

  explicit Packets(const RayRecorder& recorded) {
    std::size_t used = kLanes;
    for (std::size_t i = 0; i < recorded.origins.size(); ++i) {
      if (!is_traceable(recorded.origins[i], recorded.directions[i])) continue;
      if (used == kLanes) {
        items.push_back({});
        used = 0;
      }
      add(items.back(), used++, recorded.origins[i], recorded.directions[i]);
    }
  }

  static void add(Item& item, std::size_t lane, const Vec3& origin,
                  const Vec3& direction) noexcept {
    item.valid[lane] = -1;
    item.rays.ray.org_x[lane] = origin.x;
    item.rays.ray.org_y[lane] = origin.y;
    item.rays.ray.org_z[lane] = origin.z;
    item.rays.ray.dir_x[lane] = direction.x;
    item.rays.ray.dir_y[lane] = direction.y;
    item.rays.ray.dir_z[lane] = direction.z;
    set_unbounded(item.rays, lane);
  }

  std::size_t size() const noexcept {
    std::size_t count = 0;
    for (const Item& item : items) {
      for (const int valid : item.valid) count += valid != 0 ? 1 : 0;
    }
    return count;
  }

  std::size_t trace(RTCScene scene) const noexcept {
    IntersectCall call;
    std::size_t hits = 0;
    for (const Item& item : items) {
      Packet rays = item.rays;
      call.trace(item.valid, scene, rays);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        hits += (item.valid[lane] != 0) & (rays.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID);
      }
    }
    return hits;
  }
};

struct SingleRays {
  std::vector<RTCRayHit> items;

  explicit SingleRays(const RayRecorder& recorded) {
    for (std::size_t i = 0; i < recorded.origins.size(); ++i) {
      const Vec3& origin = recorded.origins[i];
      const Vec3& direction = recorded.directions[i];
      if (!is_traceable(origin, direction)) continue;
      RTCRayHit& ray = items.emplace_back();
      ray.ray.org_x = origin.x, ray.ray.org_y = origin.y, ray.ray.org_z = origin.z;
      ray.ray.dir_x = direction.x, ray.ray.dir_y = direction.y, ray.ray.dir_z = direction.z;
      set_unbounded(ray);
    }
  }

  std::size_t size() const noexcept { return items.size(); }

  std::size_t trace(RTCScene scene) const noexcept {
    IntersectCall call;
    std::size_t hits = 0;
    for (const RTCRayHit& item : items) {
      RTCRayHit ray = item;
      call.trace(scene, ray);
      hits += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
    return hits;
  }
};

using Packets8 = Packets<RTCRayHit8, 8>;
using Packets16 = Packets<RTCRayHit16, 16>;
using Rays = std::variant<SingleRays, Packets8, Packets16>;

Rays packed(const RayRecorder& rays, BareQuery query) {
  if (query == BareQuery::Single) return SingleRays(rays);
  if (query == BareQuery::Packet8) return Packets8(rays);
  return Packets16(rays);
}

}  // namespace

std::string_view to_string(BareQuery query) {
  if (query == BareQuery::Single) return "single";
  return query == BareQuery::Packet8 ? "packets of 8" : "packets of 16";
}

struct BareRays::Impl {
  RTCScene scene;
  Rays rays;
};

BareRays::BareRays(const RayScene& scene, const RayRecorder& rays, BareQuery query)
    : impl_(new Impl{static_cast<RTCScene>(scene.embree_scene()), packed(rays, query)}) {}

BareRays::~BareRays() = default;

std::size_t BareRays::size() const noexcept {
  return std::visit([](const auto& rays) { return rays.size(); }, impl_->rays);
}

std::size_t BareRays::trace() const noexcept {
  return std::visit([&](const auto& rays) { return rays.trace(impl_->scene); }, impl_->rays);
}

}  // namespace penumbra
