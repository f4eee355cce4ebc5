#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "harness/micro/points.h"

/// The kernels of an estimator's estimates, one after another on the data of real estimates: what
/// each of them takes, and how often an estimate calls it.
namespace penumbra::micro {

/// One kernel of an estimate.
struct ReplayedKernel {
  std::string name;
  std::string unit;     ///< of a call
  double calls{0};      ///< per estimate
  double estimates{0};  ///< whose calls `run` makes
  std::function<void()> run;
};

/// Seeds that estimates are timed with in turn, and whose rays are replayed: a processor learns the
/// way of few rays through a scene by heart.
inline constexpr std::uint64_t kReplayedSeeds = 8;

/// All kernels that are replayed for one estimator, with what they work on.
class Replay {
 public:
  virtual ~Replay() = default;

  std::vector<ReplayedKernel> kernels;
  double samples{0}, rays{0};  ///< per estimate
  /// Why the data is not that of the estimator's own estimates; empty where it is.
  std::string fault;

 protected:
  /// Adds a kernel that is called at all.
  /// @param calls      of all estimates together
  /// @param estimates  whose calls `run` makes
  void add(std::string name, std::string unit, std::size_t calls, std::size_t estimates,
           std::function<void()> run);
};

/// Estimates of a pixel in a replayed tile: alsd learns in the first half of several.
int replayed_spp(const EstimatorEntry& entry);

/// An estimator of mixtures (mis, alsd, pmc_hi) with its default parameters.
/// @param tile  its scene is asked to record rays meanwhile
std::unique_ptr<Replay> replay_mixture(BenchTile& tile, const EstimatorEntry& entry,
                                       const Budget& budget, std::uint64_t seed);

/// mdhi with its default parameters.
std::unique_ptr<Replay> replay_mdhi(BenchTile& tile, const EstimatorEntry& entry,
                                    const Budget& budget, std::uint64_t seed);

/// The rays of all estimates of a tile with kReplayedSeeds seeds from the first on, in the batches
/// of the estimator. They lie one behind the other and are traced from a single batch, as in the
/// estimator: batches of their own would be fetched from memory.
class RecordedRays {
 public:
  RecordedRays() = default;
  /// @param radiance  result, of the first seed
  RecordedRays(BenchTile& tile, Estimator& estimator, const Tile& job, std::uint64_t first_seed,
               std::vector<Rgb>& radiance);

  void trace(const Scene& scene);
  std::size_t size() const noexcept { return rays_.origins.size(); }

 private:
  RayRecorder rays_;
  std::unique_ptr<RayBatch> batch_;
};

}  // namespace penumbra::micro
