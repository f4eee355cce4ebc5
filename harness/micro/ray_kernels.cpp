// Batch queries by the kind of their rays.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "harness/micro/checks.h"
#include "harness/micro/register.h"
#include "scenes/core/frame.h"
#include "scenes/core/warp.h"

namespace penumbra::micro {
namespace {

enum class RayKind {
  Camera,  // through neighbouring pixels of a block of 8x8
  Cosine,  // cosine-distributed from one point
  Shadow,  // from one point to points of its lights
};

const char* name_of(RayKind kind) {
  switch (kind) {
    case RayKind::Camera:
      return "camera";
    case RayKind::Cosine:
      return "cosine";
    case RayKind::Shadow:
      return "shadow";
  }
  return "";
}

// Pixels of 8x8 blocks spread over the image; a batch goes on from where the last one ended.
std::vector<RayBatch> camera_rays(const BenchTile& tile, std::size_t per_batch) {
  const Camera& camera = tile.scene->camera();
  constexpr int kSide = BenchTile::kSide;
  const int columns = camera.width() / kSide;
  const int rows = camera.height() / kSide;
  std::vector<RayBatch> batches;
  std::size_t pixel = 0;
  for (std::size_t b = 0; b < BenchTile::kPoints; ++b) {
    RayBatch batch(per_batch);
    for (std::size_t i = 0; i < per_batch; ++i, ++pixel) {
      const auto block = static_cast<int>(pixel / BenchTile::kPoints) * 37 % (columns * rows);
      const auto in_block = static_cast<int>(pixel % BenchTile::kPoints);
      const int x = block % columns * kSide + in_block % kSide;
      const int y = block / columns * kSide + in_block / kSide;
      batch.add(camera.position(),
                camera.direction(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
    }
    batches.push_back(std::move(batch));
  }
  return batches;
}

// Draws one direction above a point's surface; nullopt where the kind has none there.
std::optional<Vec3> draw_direction(const Scene& scene, const ShadingPoint& point, RayKind kind,
                                   std::size_t number, const Variates& variates) {
  if (kind == RayKind::Cosine) {
    const Frame frame(point.geometric_normal);
    return frame.to_world(sample_cosine_hemisphere(variates.u)).normalized();
  }
  const auto lights = scene.sampled_lights();
  LightProposal proposal;
  const Light& light = scene.lights()[lights[number % lights.size()]];
  if (!proposal.set_up(light, LightSampling::Area, point.position, point.geometric_normal)) {
    return std::nullopt;
  }
  const auto sample = proposal.sample(variates);
  if (!sample || dot(sample->wi, point.geometric_normal) <= 0.0f) return std::nullopt;
  return sample->wi;
}

std::vector<RayBatch> surface_rays(const BenchTile& tile, RayKind kind, std::size_t per_batch,
                                   std::uint64_t seed) {
  std::vector<RayBatch> batches;
  StreamKey key;
  key.seed = seed;
  for (const ShadingPoint& point : tile.points) {
    ++key.pixel;
    RayBatch batch(per_batch);
    const auto draws = static_cast<std::uint32_t>(8 * per_batch);
    const PointSet points(SamplerKind::Independent, key, draws);
    for (std::uint32_t i = 0; i < draws && batch.size() < per_batch; ++i) {
      const auto wi = draw_direction(*tile.scene, point, kind, i, points(i));
      if (wi) batch.add(point.position, *wi);
    }
    if (batch.size() > 0) batches.push_back(std::move(batch));
  }
  return batches;
}

std::string queries_fault(const Scene& scene, std::vector<RayBatch>& batches) {
  RayBatch alone(1);
  std::vector<RayHit> found, expected;
  for (RayBatch& batch : batches) {
    scene.intersect(batch);
    if (batch.untraced() != 0) return "a ray was left out";
    for (std::size_t i = 0; i < batch.size(); ++i) {
      alone.clear();
      alone.add(batch.origin(i), batch.direction(i));
      scene.intersect(alone);
      found.push_back(batch.hits[i]);
      expected.push_back(alone.hits[0]);
    }
  }
  return hits_fault(found, expected);
}

void time_rays(benchmark::State& state, Suite& suite, const std::string& scene, RayKind kind) {
  const auto per_batch = static_cast<std::size_t>(state.range(0));
  const BenchTile& tile = suite.tile(scene);
  std::vector<RayBatch> batches = kind == RayKind::Camera
                                      ? camera_rays(tile, per_batch)
                                      : surface_rays(tile, kind, per_batch, suite.config().seed);
  if (!suite.passes(state, fmt::format("rays/{}/{}/{}", scene, name_of(kind), per_batch),
                    [&] { return queries_fault(*tile.scene, batches); })) {
    return;
  }
  std::size_t rays = 0;
  for (const RayBatch& batch : batches) rays += batch.size();
  time_kernel(state, {"ray", static_cast<double>(rays), &suite.ray_meter(scene)}, [&] {
    for (RayBatch& batch : batches) tile.scene->intersect(batch);
    benchmark::ClobberMemory();
  });
  state.counters["rays"] = static_cast<double>(rays);
}

}  // namespace

void register_ray_kernels(Suite& suite) {
  for (const std::string& scene : suite.config().scenes) {
    for (const RayKind kind : {RayKind::Camera, RayKind::Cosine, RayKind::Shadow}) {
      auto* family = benchmark::RegisterBenchmark(
          fmt::format("rays/{}/{}", scene, name_of(kind)).c_str(),
          [&suite, scene, kind](benchmark::State& state) { time_rays(state, suite, scene, kind); });
      family->ArgName("per_batch");
      for (const int n : suite.config().rays_per_batch) family->Arg(n);
    }
  }
}

}  // namespace penumbra::micro
