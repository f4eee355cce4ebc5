#include "harness/micro/replay.h"

#include <utility>

namespace penumbra::micro {

void Replay::add(std::string name, std::string unit, std::size_t calls, std::size_t estimates,
                 std::function<void()> run) {
  if (calls == 0) return;
  kernels.push_back({std::move(name), std::move(unit),
                     static_cast<double>(calls) / static_cast<double>(estimates), std::move(run)});
}

int replayed_spp(const EstimatorEntry& entry) { return entry.shares_in_tile ? 8 : 1; }

std::vector<RayBatch> recorded_rays(BenchTile& tile, Estimator& estimator, const Tile& job,
                                    std::uint64_t seed, std::vector<Rgb>& radiance) {
  radiance.resize(job.estimate_count());
  TileOutput out;
  out.radiance = radiance;
  RayRecorder recorder;
  tile.scene->set_recorder(&recorder);
  estimator.estimate(job, seed, out);
  tile.scene->set_recorder(nullptr);
  std::erase_if(recorder.batches, [](const RayBatch& batch) { return batch.size() == 0; });
  return std::move(recorder.batches);
}

}  // namespace penumbra::micro
