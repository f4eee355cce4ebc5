#include "harness/micro/replay.h"

#include <algorithm>
#include <utility>

namespace penumbra::micro {

void Replay::add(std::string name, std::string unit, std::size_t calls, std::size_t estimates,
                 std::function<void()> run) {
  if (calls == 0) return;
  kernels.push_back({std::move(name), std::move(unit),
                     static_cast<double>(calls) / static_cast<double>(estimates),
                     static_cast<double>(estimates), std::move(run)});
}

int replayed_spp(const EstimatorEntry& entry) { return entry.shares_in_tile ? 8 : 1; }

RecordedRays::RecordedRays(BenchTile& tile, Estimator& estimator, const Tile& job,
                           std::uint64_t first_seed, std::vector<Rgb>& radiance) {
  RayRecorder recorder;
  // The first seed last, whose radiance stays.
  for (std::uint64_t i = kReplayedSeeds; i-- > 0;) {
    radiance.assign(job.estimate_count(), Rgb(0.0f));
    TileOutput out;
    out.radiance = radiance;
    tile.scene->set_recorder(&recorder);
    estimator.estimate(job, first_seed + i, out);
    tile.scene->set_recorder(nullptr);
  }
  std::size_t largest = 0;
  for (const RayBatch& batch : recorder.batches) {
    if (batch.size() == 0) continue;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      rays_.push_back({batch.origin(i), batch.direction(i)});
    }
    sizes_.push_back(batch.size());
    largest = std::max(largest, batch.size());
  }
  batch_ = std::make_unique<RayBatch>(largest);
}

void RecordedRays::trace(const Scene& scene) {
  const Ray* ray = rays_.data();
  for (const std::size_t size : sizes_) {
    batch_->clear();
    for (std::size_t i = 0; i < size; ++i, ++ray) batch_->add(ray->origin, ray->direction);
    scene.intersect(*batch_);
  }
}

}  // namespace penumbra::micro
