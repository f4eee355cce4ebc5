#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "estimators/estimator.h"
#include "scenes/core/block.h"

/// The multi-sample mixture that the estimators share: one component per light (or one for all
/// lights), one for the BSDF, and an optional cone. It draws directions, evaluates the components'
/// densities for each, and traces them as one batch. What weights the samples get is the
/// estimator's business. Delta lights are no components: their light is added apart.
namespace penumbra {

/// Double-precision RGB, for sums and weights.
using RgbSum = Vec3d;

inline RgbSum widen(const Rgb& c) noexcept { return {c.x, c.y, c.z}; }
inline Rgb narrow(const RgbSum& c) noexcept {
  return {static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)};
}
inline double luminance(const RgbSum& c) noexcept {
  return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
}

/// Uniform directions about an axis; inactive while `one_minus_cos` is 0.
struct Cone {
  Vec3 axis{0.0f, 0.0f, 1.0f};  ///< unit
  float one_minus_cos{0.0f};    ///< of the half angle

  bool active() const noexcept { return one_minus_cos > 0.0f; }
  /// [rad]; 0 when inactive
  double half_angle() const noexcept;
  /// Density 1/(2 pi (1 - cos beta)) inside, 0 outside [1/sr].
  float pdf_w(const Vec3& wi) const noexcept;
};

/// Which densities a sample gets.
enum class Densities : std::uint8_t {
  All,  ///< of every component: samples stand for light from all lights
  Own,  ///< of the component that drew it: a light's samples stand for light from that light only
};

/// Components are numbered lights first (those that can contribute at the point), then BSDF, then
/// cone.
class Mixture {
 public:
  /// @param lights_as_one  one component that draws a light uniformly, instead of one per light;
  ///                       needs all densities
  /// @param max_samples    largest number of samples kept at a time
  Mixture(const Scene& scene, LightSampling light_sampling, bool lights_as_one,
          std::size_t max_samples, Densities densities = Densities::All);

  /// Binds the mixture to a point: sets up the lights that can contribute there and drops the cone
  /// and all samples.
  /// @param record  filled with all that is drawn at this point, unless nullptr
  void set_up(const ShadingPoint& point, EstimateRecord* record = nullptr) noexcept;

  const ShadingPoint& point() const noexcept { return point_; }

  /// Reflected light of the delta lights at the point [W/(m^2 sr)], exact, with one ray for each
  /// that is above the horizon.
  Rgb delta_radiance() noexcept;

  /// Lights with a density that can contribute at the point; where there is none, there is nothing
  /// to draw.
  int active_lights() const noexcept { return static_cast<int>(active_.size()); }
  /// Scene index of active light i.
  std::uint32_t light_index(int i) const noexcept {
    return active_ids_[static_cast<std::size_t>(i)];
  }

  int light_components() const noexcept { return lights_as_one_ ? 1 : last_light_ - first_light_; }
  int bsdf_component() const noexcept { return light_components(); }
  int cone_component() const noexcept { return light_components() + 1; }
  int components() const noexcept { return light_components() + 2; }

  /// Leaves only active light i in the mixture: its samples and light that arrives from it. The
  /// BSDF component then has random numbers of its own per light. -1 restores all lights.
  void restrict_to_light(int i) noexcept;

  Cone& cone() noexcept { return cone_; }

  /// Draws counts[k] directions from component k, traces those that can contribute and appends them
  /// to the samples. A direction that meets no light's surface, lies below the horizon or has black
  /// f has value 0 and is not kept.
  /// @param key     seed, pixel, estimate and iteration; the component is filled in
  /// @param counts  [component]
  void draw(SamplerKind sampler, StreamKey key, std::span<const int> counts) noexcept;

  void clear_samples() noexcept { size_ = 0; }
  std::size_t size() const noexcept { return size_; }
  const Vec3& wi(std::size_t i) const noexcept { return wi_[i]; }
  /// Integrand: arriving radiance x BSDF x cosine.
  const Rgb& f(std::size_t i) const noexcept { return f_[i]; }
  int component(std::size_t i) const noexcept { return component_[i]; }
  /// Density of the component that drew sample i [1/sr].
  float own_pdf(std::size_t i) const noexcept { return own_pdf_[i]; }
  /// Density of every component in the direction of sample i [1/sr]; its own is the one it was
  /// drawn with. Only with Densities::All.
  std::span<const float> pdfs(std::size_t i) const noexcept {
    const auto m = static_cast<std::size_t>(components());
    return {&pdfs_[i * max_components_], m};
  }

  EstimateCounters& counters() noexcept { return counters_; }

  /// The record given to set_up, with the iterations and samples drawn so far; or nullptr.
  EstimateRecord* record() noexcept { return record_; }
  /// States the weight of sample i in the record; nothing without one.
  void record_weight(std::size_t i, double weight) noexcept {
    if (record_ != nullptr) record_->samples[record_index_[i]].weight = weight;
  }
  /// Multiplies the recorded weights of samples [first, last).
  void scale_recorded_weights(std::size_t first, std::size_t last, double factor) noexcept;

 private:
  StreamKey stream(StreamKey key, int component) const noexcept;
  void draw_component(SamplerKind sampler, const StreamKey& key, int component, int count) noexcept;
  void draw_light(const LightProposal& light, std::size_t count) noexcept;
  void draw_any_light(std::size_t count) noexcept;
  void draw_bsdf(std::size_t count) noexcept;
  void draw_cone(std::size_t count) noexcept;
  void fill_light_pdfs() noexcept;
  std::size_t list_survivors() noexcept;
  void keep_block() noexcept;
  void trace(std::size_t first) noexcept;
  void begin_record(EstimateRecord* record) noexcept;
  void record_draw(std::span<const int> counts) noexcept;
  void record_block() noexcept;
  void record_traced(std::size_t i, bool lit) noexcept;
  std::size_t recorded_component(int component) const noexcept;
  const LightProposal& proposal(int component) const noexcept {
    return active_[static_cast<std::size_t>(first_light_ + component)];
  }

  const Scene* scene_;
  LightSampling light_sampling_;
  bool lights_as_one_;
  Densities densities_;
  std::size_t max_components_;

  // The point.
  ShadingPoint point_;
  Frame frame_{Vec3(0.0f, 0.0f, 1.0f)};
  BoundBsdf bsdf_;
  std::vector<LightProposal> active_;
  std::vector<std::uint32_t> active_ids_;
  int first_light_{0}, last_light_{0};
  bool restricted_{false};
  Cone cone_;

  // The directions at hand, lane by lane: drawn, then thinned out to those that can contribute.
  struct Drawn {
    std::size_t count{0};
    bool lights_only{true};  // no direction of another component
    VariateBlock variates;
    VectorBlock wi, wi_local;
    Block<float> own_pdf{}, any_light_pdf{};
    Block<int> component{};
    Block<std::uint32_t> survivors{};
    VectorBlock survivor_local, f_cos;
    Block<float> bsdf_pdf{};
  };
  Drawn drawn_;
  std::vector<Block<float>> light_pdfs_;  // [light component][lane]

  // The samples, structure of arrays.
  std::size_t size_{0};
  std::vector<Vec3> wi_;
  std::vector<Rgb> f_;
  std::vector<int> component_;
  std::vector<float> own_pdf_;
  std::vector<float> pdfs_;  // [sample][max_components_]
  RayBatch rays_;

  // Delta lights.
  std::vector<std::uint32_t> delta_ids_;
  struct DeltaRay {
    float distance;
    Rgb reflected;  // without occlusion
  };
  std::vector<DeltaRay> delta_rays_;
  RayBatch delta_batch_;

  EstimateCounters counters_;
  EstimateRecord* record_{nullptr};
  std::vector<std::size_t> record_index_;                       // [sample]
  std::array<std::size_t, kBlock + kLaneGroup> record_lane_{};  // [lane of the block at hand]
};

/// Density of the mixture with coefficients c_k at one sample: K = sum_k c_k h_k [1/sr].
inline double mixture_pdf_w(std::span<const float> pdfs,
                            std::span<const double> coefficients) noexcept {
  double sum = 0.0;
  for (std::size_t k = 0; k < pdfs.size(); ++k)
    sum += coefficients[k] * static_cast<double>(pdfs[k]);
  return sum;
}

/// Sum over samples [first, mixture.size()) of f/K with K = sum_k (n_k/N) h_k: N times the
/// balance-heuristic estimate. A sample with f > 0 and K = 0 is counted as uncovered and adds
/// nothing.
RgbSum balance_sum(Mixture& mixture, std::size_t first,
                   std::span<const double> coefficients) noexcept;

/// Samples that one estimate draws at most: the size to make a mixture with.
inline std::size_t most_samples(const Scene& scene, const Budget& budget) noexcept {
  return static_cast<std::size_t>(budget.srl()) * std::max<std::size_t>(scene.lights().size(), 1);
}

/// Counts of the shared MIS layout: half of each light's shadow rays for the light, the other half
/// pooled for the BSDF; an odd one goes to the light.
/// @param counts  [component]; filled for light components and BSDF, cone 0
/// @return the sum of the counts
int shared_mis_counts(int srl, int active_lights, int light_components,
                      std::span<int> counts) noexcept;

/// Sum over all samples of f/(n_k h_k) with their own densities only: an estimate by techniques
/// that stand for disjoint parts of the light.
/// @param expected  [component] number of samples, or its expectation where counts are random
RgbSum own_density_sum(Mixture& mixture, std::span<const double> expected) noexcept;

/// Counts with expectation N p_k that differ from it by less than 1: systematic sampling of the
/// cumulative distribution with one offset.
/// @param pmf     >= 0, sum 1
/// @param total   N
/// @param offset  uniform in [0, 1)
/// @param counts  result, same length as pmf, sum N
void systematic_counts(std::span<const double> pmf, int total, double offset,
                       std::span<int> counts) noexcept;

/// Light sampling by itself: chooses SRL x active lights samples among the lights by systematic
/// sampling of a pmf and weights them with it.
/// @param mixture  with Densities::Own
/// @param pmf      [active light], sum 1
/// @param counts, expected  scratch, at least `mixture.components()` long; expected[l] is n P_l
/// then
/// @return the estimate
RgbSum chosen_lights_estimate(Mixture& mixture, const Budget& budget, StreamKey key,
                              std::span<const double> pmf, std::span<int> counts,
                              std::span<double> expected) noexcept;

/// Makes estimate s of a pixel: binds the mixture to its point, adds the light of delta lights to
/// what `one_point` returns and stores the sum, 0 where the point is not valid.
/// @param one_point  called with the key of the estimate where there are lights to draw from;
///                   returns their radiance
template <typename OnePoint>
void estimate_one(Mixture& mixture, const Tile& tile, std::uint64_t seed, int pixel, int s,
                  TileOutput& out, OnePoint one_point) noexcept {
  const std::size_t i = static_cast<std::size_t>(pixel) * static_cast<std::size_t>(tile.spp) +
                        static_cast<std::size_t>(s);
  out.radiance[i] = Rgb(0.0f);
  const ShadingPoint& point = tile.point(pixel, s);
  if (!point.valid()) return;
  ++mixture.counters().estimates;
  mixture.set_up(point, out.recorder != nullptr ? out.recorder->begin(pixel, s) : nullptr);
  out.radiance[i] = mixture.delta_radiance();
  if (mixture.active_lights() == 0) return;
  StreamKey key;
  key.seed = seed;
  key.pixel = tile.pixel_index(pixel);
  key.estimate = static_cast<std::uint32_t>(s);
  out.radiance[i] += one_point(key);
}

/// Makes the estimates of a tile in the order of its output and adds up the counters.
/// @param before_point  called with the index of every estimate, also of those that are 0
/// @param one_point     as in estimate_one
template <typename BeforePoint, typename OnePoint>
void estimate_tile(Mixture& mixture, const Tile& tile, std::uint64_t seed, TileOutput& out,
                   BeforePoint before_point, OnePoint one_point) noexcept {
  mixture.counters() = {};
  std::size_t i = 0;
  for (int pixel = 0; pixel < tile.pixel_count(); ++pixel) {
    for (int s = 0; s < tile.spp; ++s, ++i) {
      before_point(i);
      estimate_one(mixture, tile, seed, pixel, s, out, one_point);
    }
  }
  out.counters += mixture.counters();
}

/// The parameter `light_sampling` and its value: how directions towards a light are drawn.
ParamSpec light_sampling_param();
LightSampling light_sampling_of(const ParamSet& params);

}  // namespace penumbra
