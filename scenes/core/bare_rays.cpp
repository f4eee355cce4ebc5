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

  explicit Packets(std::span<const RayBatch> batches) {
    std::size_t used = kLanes;
    for (const RayBatch& batch : batches) {
      for (std::size_t i = 0; i < batch.size(); ++i) {
        if (!is_traceable(batch.origin(i), batch.direction(i))) continue;
        if (used == kLanes) {
          items.push_back({});
          used = 0;
        }
        add(items.back(), used++, batch, i);
      }
    }
  }

  static void add(Item& item, std::size_t lane, const RayBatch& batch, std::size_t i) noexcept {
    item.valid[lane] = -1;
    item.rays.ray.org_x[lane] = batch.ox[i];
    item.rays.ray.org_y[lane] = batch.oy[i];
    item.rays.ray.org_z[lane] = batch.oz[i];
    item.rays.ray.dir_x[lane] = batch.dx[i];
    item.rays.ray.dir_y[lane] = batch.dy[i];
    item.rays.ray.dir_z[lane] = batch.dz[i];
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

  explicit SingleRays(std::span<const RayBatch> batches) {
    for (const RayBatch& batch : batches) {
      for (std::size_t i = 0; i < batch.size(); ++i) {
        if (!is_traceable(batch.origin(i), batch.direction(i))) continue;
        RTCRayHit& ray = items.emplace_back();
        ray.ray.org_x = batch.ox[i], ray.ray.org_y = batch.oy[i], ray.ray.org_z = batch.oz[i];
        ray.ray.dir_x = batch.dx[i], ray.ray.dir_y = batch.dy[i], ray.ray.dir_z = batch.dz[i];
        set_unbounded(ray);
      }
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

Rays packed(std::span<const RayBatch> batches, BareQuery query) {
  if (query == BareQuery::Single) return SingleRays(batches);
  if (query == BareQuery::Packet8) return Packets8(batches);
  return Packets16(batches);
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

BareRays::BareRays(const RayScene& scene, std::span<const RayBatch> batches, BareQuery query)
    : impl_(new Impl{static_cast<RTCScene>(scene.embree_scene()), packed(batches, query)}) {}

BareRays::~BareRays() = default;

std::size_t BareRays::size() const noexcept {
  return std::visit([](const auto& rays) { return rays.size(); }, impl_->rays);
}

std::size_t BareRays::trace() const noexcept {
  return std::visit([&](const auto& rays) { return rays.trace(impl_->scene); }, impl_->rays);
}

}  // namespace penumbra
