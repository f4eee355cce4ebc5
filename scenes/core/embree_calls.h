#pragma once

// The two versions of Embree differ in the header's folder and in the last arguments of the
// queries. Only the files of the ray tracer include this.
#if PENUMBRA_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cstddef>
#include <limits>

#include "scenes/core/vec.h"

namespace penumbra {

/// A query for closest hits with the flags that all of the project's rays have.
struct IntersectCall {
#if PENUMBRA_EMBREE_MAJOR >= 4
  RTCIntersectArguments arguments;
  IntersectCall() noexcept { rtcInitIntersectArguments(&arguments); }
  void trace(const int* valid, RTCScene scene, RTCRayHit8& rays) noexcept {
    rtcIntersect8(valid, scene, &rays, &arguments);
  }
  void trace(const int* valid, RTCScene scene, RTCRayHit16& rays) noexcept {
    rtcIntersect16(valid, scene, &rays, &arguments);
  }
  void trace(RTCScene scene, RTCRayHit& ray) noexcept { rtcIntersect1(scene, &ray, &arguments); }
#else
  RTCIntersectContext context;
  IntersectCall() noexcept { rtcInitIntersectContext(&context); }
  void trace(const int* valid, RTCScene scene, RTCRayHit8& rays) noexcept {
    rtcIntersect8(valid, scene, &context, &rays);
  }
  void trace(const int* valid, RTCScene scene, RTCRayHit16& rays) noexcept {
    rtcIntersect16(valid, scene, &context, &rays);
  }
  void trace(RTCScene scene, RTCRayHit& ray) noexcept { rtcIntersect1(scene, &context, &ray); }
#endif
};

/// Everything of a ray but its origin and direction: from the origin on, without end.
inline void set_unbounded(RTCRayHit& ray) noexcept {
  ray.ray.tnear = 0.0f;
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.time = 0.0f;
  ray.ray.mask = 0xffffffffu;
  ray.ray.flags = 0;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

/// The same for a lane of a packet.
template <typename Packet>
void set_unbounded(Packet& packet, std::size_t lane) noexcept {
  packet.ray.tnear[lane] = 0.0f;
  packet.ray.tfar[lane] = std::numeric_limits<float>::infinity();
  packet.ray.time[lane] = 0.0f;
  packet.ray.mask[lane] = 0xffffffffu;
  packet.ray.flags[lane] = 0;
  packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
  packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
}

}  // namespace penumbra
