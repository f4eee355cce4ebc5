#include "scenes/core/ray_batch.h"

#include <algorithm>
#include <atomic>
#include <string>

#include "scenes/core/embree_calls.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr int kLanes = 8;

// What a query for crossings hands to the filter function. Its first member is what Embree passes
// on.
struct CrossingContext {
#if PENUMBRA_EMBREE_MAJOR >= 4
  RTCRayQueryContext context;
  CrossingContext() noexcept { rtcInitRayQueryContext(&context); }
#else
  RTCIntersectContext context;
  CrossingContext() noexcept { rtcInitIntersectContext(&context); }
#endif
  void (*visit)(void* self, float distance, const Vec3& normal){nullptr};
  void* self{nullptr};

  void trace(RTCScene scene, RTCRayHit* ray) noexcept {
#if PENUMBRA_EMBREE_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context;
    rtcIntersect1(scene, ray, &arguments);
#else
    rtcIntersect1(scene, &context, ray);
#endif
  }
};

// Tells of a hit and rejects it, so that the ray goes on to the next.
void report_crossing(const RTCFilterFunctionNArguments* call) {
  auto* query = static_cast<CrossingContext*>(static_cast<void*>(call->context));
  const unsigned int n = call->N;
  for (unsigned int i = 0; i < n; ++i) {
    if (call->valid[i] == 0) continue;
    call->valid[i] = 0;
    query->visit(query->self, RTCRayN_tfar(call->ray, n, i),
                 Vec3(RTCHitN_Ng_x(call->hit, n, i), RTCHitN_Ng_y(call->hit, n, i),
                      RTCHitN_Ng_z(call->hit, n, i)));
  }
}

void throw_embree_error(void*, RTCError code, const char* message) {
  throw RunError("Embree error " + std::to_string(static_cast<int>(code)) + ": " +
                 (message != nullptr ? message : ""));
}

// Embree calls it for every hit of a geometry that has it, with as many lanes as it likes.
void filter_hits(const RTCFilterFunctionNArguments* arguments) {
  const auto& filter = *static_cast<const HitFilter*>(arguments->geometryUserPtr);
  RTCHitN* const hits = arguments->hit;
  const unsigned lanes = arguments->N;
  for (unsigned i = 0; i < lanes; ++i) {
    if (arguments->valid[i] != -1) continue;
    const bool exists =
        filter.exists(RTCHitN_geomID(hits, lanes, i), RTCHitN_primID(hits, lanes, i),
                      RTCHitN_u(hits, lanes, i), RTCHitN_v(hits, lanes, i));
    if (!exists) arguments->valid[i] = 0;
  }
}

}  // namespace

struct RayScene::Impl {
  RTCDevice device{nullptr};
  RTCScene scene{nullptr};
  Query query{Query::Closest};
  std::uint32_t geometries{0};
  bool committed{false};
  std::atomic<std::ptrdiff_t> bytes{0};

  static bool count_memory(void* self, ssize_t change, bool) {
    static_cast<Impl*>(self)->bytes += change;
    return true;
  }

  std::uint32_t attach(RTCGeometry geometry) {
    PN_CHECK(!committed, "geometry is added before commit");
    if (query == Query::Crossings) {
      rtcSetGeometryIntersectFilterFunction(geometry, report_crossing);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, geometries);
    rtcReleaseGeometry(geometry);
    return geometries++;
  }

  // @param stride  floats from one vertex to the next, at least 3; those behind the third are 0
  static void set_vertices(RTCGeometry geometry, std::span<const Vec3> vertices,
                           std::size_t stride = 3) {
    auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                          RTC_FORMAT_FLOAT3, stride * sizeof(float),
                                                          vertices.size()));
    for (const Vec3& vertex : vertices) {
      for (std::size_t i = 0; i < stride; ++i) *v++ = i < 3 ? vertex[static_cast<int>(i)] : 0.0f;
    }
  }

  // @param per_item  numbers in an item of the buffer
  static void set_numbers(RTCGeometry geometry, RTCBufferType type, RTCFormat format,
                          std::size_t per_item, std::span<const std::uint32_t> numbers) {
    auto* n = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, type, 0, format, per_item * sizeof(std::uint32_t), numbers.size() / per_item));
    std::copy(numbers.begin(), numbers.end(), n);
  }

  std::uint32_t add_indexed(RTCGeometryType type, RTCFormat index_format, std::size_t corners,
                            std::span<const Vec3> vertices, std::span<const std::uint32_t> indices,
                            const HitFilter* filter) {
    RTCGeometry geometry = rtcNewGeometry(device, type);
    set_vertices(geometry, vertices);
    set_numbers(geometry, RTC_BUFFER_TYPE_INDEX, index_format, corners, indices);
    if (filter != nullptr) {
      // Embree hands the pointer on as it is; it does not write through it.
      rtcSetGeometryUserData(geometry, const_cast<HitFilter*>(filter));
      rtcSetGeometryIntersectFilterFunction(geometry, filter_hits);
    }
    return attach(geometry);
  }
};

RayScene::RayScene(Query query, Precision precision) : impl_(std::make_unique<Impl>()) {
  impl_->query = query;
  impl_->device = rtcNewDevice(nullptr);
  if (impl_->device == nullptr) {
    throw RunError("Embree device creation failed, error " +
                   std::to_string(static_cast<int>(rtcGetDeviceError(nullptr))));
  }
  rtcSetDeviceErrorFunction(impl_->device, throw_embree_error, nullptr);
  rtcSetDeviceMemoryMonitorFunction(impl_->device, Impl::count_memory, impl_.get());
  impl_->scene = rtcNewScene(impl_->device);
  if (precision == Precision::Robust) rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
}

RayScene::~RayScene() {
  if (impl_->scene != nullptr) rtcReleaseScene(impl_->scene);
  if (impl_->device != nullptr) {
    rtcSetDeviceMemoryMonitorFunction(impl_->device, nullptr, nullptr);
    rtcReleaseDevice(impl_->device);
  }
}

std::uint32_t RayScene::add_triangles(std::span<const Vec3> vertices,
                                      std::span<const std::uint32_t> indices,
                                      const HitFilter* filter) {
  return impl_->add_indexed(RTC_GEOMETRY_TYPE_TRIANGLE, RTC_FORMAT_UINT3, 3, vertices, indices,
                            filter);
}

std::uint32_t RayScene::add_quads(std::span<const Vec3> vertices,
                                  std::span<const std::uint32_t> indices, const HitFilter* filter) {
  return impl_->add_indexed(RTC_GEOMETRY_TYPE_QUAD, RTC_FORMAT_UINT4, 4, vertices, indices, filter);
}

std::uint32_t RayScene::add_sphere(const Vec3& center, float radius) {
  RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                        RTC_FORMAT_FLOAT4, 4 * sizeof(float), 1));
  for (int axis = 0; axis < 3; ++axis) v[axis] = center[axis];
  v[3] = radius;
  return impl_->attach(geometry);
}

std::uint32_t RayScene::add_subdivision(std::span<const Vec3> vertices,
                                        std::span<const std::uint32_t> face_sizes,
                                        std::span<const std::uint32_t> indices, int level) {
  RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_SUBDIVISION);
  // Embree reads four floats of a vertex and asserts that all are sound: with a stride of three,
  // the fourth of the last vertex would lie behind the buffer.
  Impl::set_vertices(geometry, vertices, 4);
  Impl::set_numbers(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, 1, indices);
  Impl::set_numbers(geometry, RTC_BUFFER_TYPE_FACE, RTC_FORMAT_UINT, 1, face_sizes);
  rtcSetGeometrySubdivisionMode(geometry, 0, RTC_SUBDIVISION_MODE_SMOOTH_BOUNDARY);
  rtcSetGeometryTessellationRate(geometry, static_cast<float>(level));
  return impl_->attach(geometry);
}

void RayScene::commit() {
  rtcCommitScene(impl_->scene);
  impl_->committed = true;
}

void RayScene::intersect(RayBatch& batch) const noexcept {
  PN_ASSERT(impl_->committed);
  IntersectCall call;
  const std::size_t count = batch.size();
  std::size_t traced = 0;
  alignas(32) RTCRayHit8 packet;
  alignas(32) int valid[kLanes];
  for (std::size_t first = 0; first < count; first += kLanes) {
    // Lanes behind the last ray read the batch's padding and are switched off.
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t i = first + lane;
      const bool on = (i < count) & is_traceable(batch.origin(i), batch.direction(i));
      valid[lane] = on ? -1 : 0;
      traced += on ? 1u : 0u;
      packet.ray.org_x[lane] = batch.ox[i];
      packet.ray.org_y[lane] = batch.oy[i];
      packet.ray.org_z[lane] = batch.oz[i];
      packet.ray.dir_x[lane] = batch.dx[i];
      packet.ray.dir_y[lane] = batch.dy[i];
      packet.ray.dir_z[lane] = batch.dz[i];
      set_unbounded(packet, lane);
    }
    call.trace(valid, impl_->scene, packet);
    for (std::size_t lane = 0; lane < kLanes && first + lane < count; ++lane) {
      RayHit& hit = batch.hits[first + lane];
      hit.geometry = packet.hit.geomID[lane];
      hit.primitive = packet.hit.primID[lane];
      hit.u = packet.hit.u[lane];
      hit.v = packet.hit.v[lane];
      hit.distance = packet.ray.tfar[lane];
      hit.normal = Vec3(packet.hit.Ng_x[lane], packet.hit.Ng_y[lane], packet.hit.Ng_z[lane]);
    }
  }
  batch.untraced_ = count - traced;
}

Vec3 RayScene::subdivision_normal(const RayHit& hit) const noexcept {
  // Derivatives are computed four floats at a time.
  alignas(16) float position[4];
  alignas(16) float along_u[4];
  alignas(16) float along_v[4];
  rtcInterpolate1(rtcGetGeometry(impl_->scene, hit.geometry), hit.primitive, hit.u, hit.v,
                  RTC_BUFFER_TYPE_VERTEX, 0, position, along_u, along_v, 3);
  return cross(Vec3(along_u[0], along_u[1], along_u[2]), Vec3(along_v[0], along_v[1], along_v[2]));
}

void RayScene::for_each_crossing(const Vec3& origin, const Vec3& direction, VisitCrossing visit,
                                 void* self) const noexcept {
  PN_ASSERT(impl_->committed && impl_->query == Query::Crossings);
  if (!is_traceable(origin, direction)) return;
  RTCRayHit ray;
  ray.ray.org_x = origin.x, ray.ray.org_y = origin.y, ray.ray.org_z = origin.z;
  ray.ray.dir_x = direction.x, ray.ray.dir_y = direction.y, ray.ray.dir_z = direction.z;
  set_unbounded(ray);
  CrossingContext query;
  query.visit = visit;
  query.self = self;
  query.trace(impl_->scene, &ray);
}

std::size_t RayScene::memory_bytes() const noexcept {
  return static_cast<std::size_t>(impl_->bytes.load());
}

void* RayScene::embree_scene() const noexcept { return impl_->scene; }

std::string RayScene::version() { return "Embree " RTC_VERSION_STRING; }

static_assert(RayHit::kMiss == RTC_INVALID_GEOMETRY_ID);

}  // namespace penumbra
