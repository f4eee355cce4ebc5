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
  rays_ = std::move(recorder);
  const auto largest = std::max_element(rays_.batch_sizes.begin(), rays_.batch_sizes.end());
  batch_ = std::make_unique<RayBatch>(largest == rays_.batch_sizes.end() ? 0 : *largest);
}

void RecordedRays::trace(const Scene& scene) {
  std::size_t ray = 0;
  for (const std::size_t size : rays_.batch_sizes) {
    batch_->clear();
    for (std::size_t i = 0; i < size; ++i, ++ray) {
      batch_->add(rays_.origins[ray], rays_.directions[ray]);
    }
    scene.intersect(*batch_);
  }
}

}  // namespace penumbra::micro
