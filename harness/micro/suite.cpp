#include "harness/micro/suite.h"

#include <algorithm>

#include "scenes/core/sampler.h"

namespace penumbra::micro {
namespace {

// Rays from each point.
constexpr std::uint32_t kRaysPerPoint = 16;

}  // namespace

RayMeter::RayMeter(const BenchTile& tile, std::uint64_t seed) : scene_(tile.scene.get()) {
  StreamKey key;
  key.seed = seed;
  for (const ShadingPoint& point : tile.points) {
    ++key.pixel;
    RayBatch batch(kRaysPerPoint * scene_->sampled_lights().size());
    for (const std::uint32_t id : scene_->sampled_lights()) {
      LightProposal proposal;
      if (!proposal.set_up(scene_->lights()[id], LightSampling::Area, point.position,
                           point.geometric_normal)) {
        continue;
      }
      key.component = id;
      const PointSet points(SamplerKind::Stratified, key, kRaysPerPoint);
      for (std::uint32_t i = 0; i < kRaysPerPoint; ++i) {
        const auto sample = proposal.sample(points(i));
        if (sample && dot(sample->wi, point.geometric_normal) > 0.0f) {
          batch.add(point.position, sample->wi);
        }
      }
    }
    if (batch.size() == 0) continue;
    rays_ += batch.size();
    batches_.push_back(std::move(batch));
  }
}

double RayMeter::ns_per_ray() {
  const double start_s = thread_cpu_s();
  for (RayBatch& batch : batches_) scene_->intersect(batch);
  return 1e9 * (thread_cpu_s() - start_s) / static_cast<double>(rays_);
}

BenchTile& Suite::tile(const std::string& scene) {
  std::unique_ptr<BenchTile>& tile = tiles_[scene];
  if (tile == nullptr) tile = std::make_unique<BenchTile>(make_bench_tile(scene));
  return *tile;
}

RayMeter& Suite::ray_meter(const std::string& scene) {
  std::unique_ptr<RayMeter>& meter = meters_[scene];
  if (meter == nullptr) meter = std::make_unique<RayMeter>(tile(scene), config_.seed);
  return *meter;
}

const LightField& Suite::light_field(int lights) {
  return field(std::to_string(lights) + " lights", [&] { return make_light_field(lights); });
}

void Suite::fail(benchmark::State& state, const std::string& fault) const {
  if (!needs_row_) return state.SkipWithError(fault.c_str());
  state.SetLabel("ERROR OCCURRED: '" + fault + "'");
  for (auto _ : state) {
  }
}

int Suite::failures() const {
  return static_cast<int>(std::count_if(faults_.begin(), faults_.end(),
                                        [](const auto& item) { return !item.second.empty(); }));
}

}  // namespace penumbra::micro
