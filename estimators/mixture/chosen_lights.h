#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimators/mixture/estimates.h"

/// Light sampling alone, from few of many lights: only those that get samples are set up.
namespace penumbra {

/// A light that an estimate draws from.
struct ChosenLight {
  std::uint32_t light;  ///< scene index
  int count;            ///< samples, >= 1
  double expected;      ///< E[count], from which the actual count differs by less than 1
};

/// Samples of one estimate where a parameter limits them.
/// @param limit  0: SRL x lights that have a density
/// @throws InputError as most_samples
std::size_t limited_samples(const Scene& scene, const Budget& budget, std::int64_t limit);

/// The parameter for it.
ParamSpec samples_param(std::int64_t default_value);

/// The sum over chosen lights l of sum_j f_l(w_lj) / (E[n_l] h_l(w_lj)), where f_l is the light
/// that arrives from l. Unbiased where E[n_l] > 0 for every light that can contribute.
class ChosenLights {
 public:
  /// @param samples  of one estimate
  ChosenLights(const Scene& scene, LightSampling light_sampling, SamplerKind sampler,
               std::size_t samples)
      : scene_(&scene),
        samples_(static_cast<int>(samples)),
        sampler_(sampler),
        mixture_(scene, light_sampling, false, samples, Densities::Own) {
    chosen_.reserve(std::min(samples, scene.sampled_lights().size()));
    lights_.reserve(chosen_.capacity());
    counts_.resize(chosen_.capacity() + 2);
    expected_.resize(counts_.size());
  }

  int samples() const noexcept { return samples_; }

  /// Makes the estimates of a tile.
  /// @param choose  called as choose(point, surface, offset, chosen) with an offset uniform in [0,
  /// 1)
  ///                for systematic sampling; appends lights, each at most once, to the empty
  ///                `chosen`, whose capacity is min(samples, lights); the sum of the counts is at
  ///                most `samples()`
  template <typename Choose>
  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out, Choose choose) noexcept {
    mixture_.counters() = {};
    mixture_.set_clock(out.clock);
    for (int pixel = 0; pixel < tile.pixel_count(); ++pixel) {
      for (int s = 0; s < tile.spp; ++s) estimate_one(tile, seed, pixel, s, out, choose);
    }
    mixture_.enter(EstimateStage::Outside);
    mixture_.counters().iterations = mixture_.counters().estimates;
    out.counters += mixture_.counters();
  }

 private:
  template <typename Choose>
  void estimate_one(const Tile& tile, std::uint64_t seed, int pixel, int s, TileOutput& out,
                    Choose choose) noexcept {
    Rgb& radiance =
        out.radiance[static_cast<std::size_t>(pixel) * static_cast<std::size_t>(tile.spp) +
                     static_cast<std::size_t>(s)];
    radiance = Rgb(0.0f);
    const ShadingPoint& point = tile.point(pixel, s);
    if (!point.valid()) return;
    mixture_.enter(EstimateStage::SetUp);
    ++mixture_.counters().estimates;
    StreamKey key;
    key.seed = seed;
    key.pixel = tile.pixel_index(pixel);
    key.estimate = static_cast<std::uint32_t>(s);
    chosen_.clear();
    const SurfaceValues* surface = tile.surface(pixel, s);
    if (!scene_->is_mirror(point.material)) choose(point, surface, offset(key), chosen_);
    set_up(point, surface, out.recorder != nullptr ? out.recorder->begin(pixel, s) : nullptr);
    radiance = mixture_.exact_radiance();
    if (mixture_.active_lights() > 0) radiance += draw_and_sum(key);
  }

  static double offset(StreamKey key) noexcept;
  void set_up(const ShadingPoint& point, const SurfaceValues* surface,
              EstimateRecord* record) noexcept;
  Rgb draw_and_sum(const StreamKey& key) noexcept;

  const Scene* scene_;
  int samples_;
  SamplerKind sampler_;
  Mixture mixture_;
  std::vector<ChosenLight> chosen_;
  std::vector<std::uint32_t> lights_;
  std::vector<int> counts_;
  std::vector<double> expected_;
};

}  // namespace penumbra
