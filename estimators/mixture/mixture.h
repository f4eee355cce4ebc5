#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "estimators/estimator.h"
#include "estimators/mixture/exact_light.h"
#include "estimators/mixture/many_lights.h"
#include "scenes/core/block.h"
#include "scenes/core/independent_points.h"
#include "scenes/core/warp.h"

/// The multi-sample mixture that the estimators share: one component per light (or one for all
/// lights), one for the BSDF, and an optional cone. It draws directions, evaluates the components'
/// densities for each, and traces them as one batch. What weights the samples get is the
/// estimator's business. Delta lights are no components: their light is added apart.
///
/// Components that can not contribute at a point are left out by rules that depend on scene and
/// point alone (unless the scene keeps all): lights below the horizon, seen from behind or black;
/// in a mirror all of them.
namespace penumbra {

/// Uniform directions about an axis; inactive while `one_minus_cos` is 0.
struct Cone {
  Vec3 axis{0.0f, 0.0f, 1.0f};  ///< unit
  float one_minus_cos{0.0f};    ///< of the half angle

  bool active() const noexcept { return one_minus_cos > 0.0f; }
  /// [rad]; 0 when inactive
  double half_angle() const noexcept {
    return 2.0 * std::asin(std::sqrt(0.5 * static_cast<double>(one_minus_cos)));
  }
  /// Density 1/(2 pi (1 - cos beta)) inside, 0 outside [1/sr].
  float pdf_w(const Vec3& wi) const noexcept {
    if (!active()) return 0.0f;
    // By the chord |wi - axis| <= 2 sin(beta/2): exact where the cosine of a narrow cone rounds to
    // 1.
    return (wi - axis).length2() <= 2.0f * one_minus_cos ? uniform_cone_pdf_w(one_minus_cos) : 0.0f;
  }
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

  /// Draws an environment by its compensated density from now on. Sound only with all densities and
  /// together with samples of the BSDF component, which have to find what that density leaves out.
  void compensate_environment();

  /// Binds the mixture to a point: sets up the lights that can contribute there and drops the cone
  /// and all samples. At the same point components have the same numbers again.
  /// @param surface  values of the point's textures; nullptr: factors of 1
  /// @param record   filled with all that is drawn at this point, after what it holds, unless
  ///                 nullptr
  void set_up(const ShadingPoint& point, const SurfaceValues* surface = nullptr,
              EstimateRecord* record = nullptr) noexcept {
    set_up(point, surface, record, scene_->sampled_lights());
  }
  /// The same with some of the lights that have a density.
  /// @param lights  scene indices, each at most once; active lights keep their order
  void set_up(const ShadingPoint& point, const SurfaceValues* surface, EstimateRecord* record,
              std::span<const std::uint32_t> lights) noexcept;

  const ShadingPoint& point() const noexcept { return point_; }

  /// From the next point on, the BSDF component draws from glossy lobes alone: lights that are all
  /// sampled leave nothing to the diffuse lobe.
  void leave_out_diffuse_samples() noexcept { glossy_lobes_only_ = true; }
  /// Whether the BSDF component has a glossy lobe to draw from at the point.
  bool has_glossy_lobe() const noexcept { return bsdf_.glossy_probability() > 0.0f; }

  /// The part of the radiance at the point that needs no sampling [W/(m^2 sr)] (ExactLight).
  Rgb exact_radiance() noexcept;

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
  /// @param first   [component] points of its set to leave out, because they were drawn before;
  ///                empty: none
  void draw(SamplerKind sampler, const StreamKey& key, std::span<const int> counts,
            std::span<const int> first = {}) noexcept;

  /// Draws candidates as `draw` draws samples, but traces none. Their f lacks the arriving
  /// radiance. With any sampler but the independent one a component's candidates lie along a curve
  /// (curve_points.h), in their order.
  void propose(SamplerKind sampler, const StreamKey& key, std::span<const int> counts) noexcept;
  /// Luminance of candidate i's integrand if nothing hid the lights that lie along it (of all of
  /// them together). Positive wherever f can be: a target to choose by.
  float unshadowed(std::size_t i) const noexcept { return unshadowed_[i]; }
  std::span<const float> unshadowed() const noexcept { return unshadowed_; }
  /// Leaves the chosen candidates only, in their order, as samples, and traces them. Of what
  /// samples have, the densities of other components than their own are gone.
  /// @param chosen  ascending, each once
  /// @param count   samples that they stand for, for the counters
  void trace_chosen(std::span<const std::uint32_t> chosen, std::uint64_t count) noexcept;

  void clear_samples() noexcept {
    size_ = 0;
    dropped_ = 0;
    std::fill(dropped_alone_.begin(), dropped_alone_.end(), 0);
  }
  std::size_t size() const noexcept { return size_; }
  Vec3 wi(std::size_t i) const noexcept { return wi_[i]; }
  /// Directions of all samples, with room for a whole group of lanes behind the last.
  const VectorArray& directions() const noexcept { return wi_; }
  /// Integrand: arriving radiance x BSDF x cosine.
  const Rgb& f(std::size_t i) const noexcept { return f_[i]; }
  int component(std::size_t i) const noexcept { return component_[i]; }
  /// Density of the component that drew sample i [1/sr].
  float own_pdf(std::size_t i) const noexcept { return own_pdf_[i]; }
  /// Density of component k in the direction of sample i [1/sr]; its own is the one it was drawn
  /// with. Only with Densities::All.
  float pdf_w(std::size_t i, int k) const noexcept {
    return many_ == nullptr ? pdfs_[static_cast<std::size_t>(k) * stride_ + i]
                            : pdf_w_of_many(i, k);
  }
  /// Calls visit(k, pdf) in ascending order for every component whose density at sample i is not 0,
  /// and perhaps for others. Only with Densities::All.
  template <typename Visit>
  void for_each_pdf_w(std::size_t i, Visit visit) const noexcept {
    if (many_ == nullptr) {
      for (int k = 0; k < components(); ++k) visit(k, pdf_w(i, k));
      return;
    }
    for (const LightDensity& d : many_->sample(i)) visit(static_cast<int>(d.component), d.pdf_w);
    visit(bsdf_component(), many_->bsdf[i]);
    visit(cone_component(), many_->cone[i]);
  }
  /// Density of the mixture with coefficients c_k, K = sum_k c_k h_k, at samples [first, size()).
  /// @param coefficients  [component]
  /// @param density       result for each of those samples, with room for a group of lanes more
  /// [1/sr]
  void mixture_pdfs_w(std::size_t first, std::span<const double> coefficients,
                      std::span<double> density) const noexcept;

  /// From now on `draw` also keeps the densities of the directions that are no samples: control
  /// variates do not vanish where f does. Memory for them is allocated here. Only with
  /// Densities::All.
  void keep_dropped();
  /// Directions since `clear_samples` that were drawn but are no samples, and that more than one
  /// component may have drawn.
  std::size_t dropped() const noexcept { return dropped_; }
  /// Density of component k in dropped direction i [1/sr].
  float dropped_pdf_w(std::size_t i, int k) const noexcept {
    return dropped_pdfs_[static_cast<std::size_t>(k) * stride_ + i];
  }
  /// Number of draws of component k besides, which no other component could have made: towards no
  /// light, or no direction at all. The latter, a draw of the BSDF below the horizon for one,
  /// belong to the component's density, which integrates to 1 only with them.
  int dropped_alone(int k) const noexcept { return dropped_alone_[static_cast<std::size_t>(k)]; }

  EstimateCounters& counters() noexcept { return counters_; }

  /// Names the clock that is told of stages from now on; nullptr: none. `draw` leaves it at
  /// EstimateStage::Weigh.
  void set_clock(StageClock* clock) noexcept { clock_ = clock; }
  void enter(EstimateStage stage) noexcept { enter_stage(clock_, stage); }

  /// The record given to set_up, with the iterations and samples drawn so far; or nullptr.
  EstimateRecord* record() noexcept { return record_; }
  /// Place of sample i among the record's samples; only with a record.
  std::size_t record_place(std::size_t i) const noexcept { return record_index_[i]; }
  /// States the weight of sample i in the record; nothing without one.
  void record_weight(std::size_t i, double weight) noexcept {
    if (record_ != nullptr) record_->samples[record_index_[i]].weight = weight;
  }
  /// Multiplies the recorded weights of samples [first, last).
  void scale_recorded_weights(std::size_t first, std::size_t last, double factor) noexcept;

 private:
  void list_active_lights(const ShadingPoint& point,
                          std::span<const std::uint32_t> candidates) noexcept;
  std::uint32_t stream(int component) const noexcept;
  std::uint64_t draw_all(SamplerKind sampler, const StreamKey& key, std::span<const int> counts,
                         std::span<const int> first) noexcept;
  void draw_points(SamplerKind sampler, int component, std::uint32_t first,
                   std::uint32_t count) noexcept;
  void place_runs_along_curves() noexcept;
  void keep_unshadowed(std::size_t survivors) noexcept;
  template <typename Fill>
  void add_runs(int component, std::uint32_t count, Fill fill) noexcept;
  void draw_directions() noexcept;
  struct Run;
  void draw_any_light(const Run& run) noexcept;
  bool sees_compensated() const noexcept;
  void draw_cone(const Run& run) noexcept;
  void fill_light_pdfs() noexcept;
  void fill_pdf_of_all_as_one() noexcept;
  void fill_pdfs_of_many() noexcept;
  void keep_pdfs_of_many(std::size_t survivors) noexcept;
  float pdf_w_of_many(std::size_t i, int k) const noexcept;
  void mixture_pdfs_of_many(std::size_t first, std::span<const double> coefficients,
                            std::span<double> density) const noexcept;
  template <typename Visit>
  void for_each_met(const Vec3& wi, Visit visit) noexcept;
  std::size_t evaluate_lanes() noexcept;
  template <class T>
  void pack(const Block<T>& of_lanes, std::size_t survivors, T* of_samples) const noexcept;
  void keep_block() noexcept;
  void keep_pdfs(std::size_t survivors) noexcept;
  void keep_dropped_pdfs(std::size_t survivors) noexcept;
  float lane_pdf_w(std::size_t lane, int k) const noexcept;
  template <bool kEnvironment, bool kSelects>
  void trace(std::size_t first) noexcept;
  bool from_wanted_light(std::size_t sample, std::int32_t light) const noexcept;
  std::size_t drawn_light(std::size_t sample) const noexcept;
  void begin_record(EstimateRecord* record) noexcept;
  void record_draw(std::span<const int> counts) noexcept;
  void record_block() noexcept;
  void record_traced(std::size_t i, bool lit) noexcept;
  void record_not_chosen(std::span<const std::uint32_t> chosen) noexcept;
  std::size_t recorded_component(int component) const noexcept;
  const LightProposal& proposal(int component) const noexcept {
    return active_[static_cast<std::size_t>(first_light_ + component)];
  }

  const Scene* scene_;
  LightSampling light_sampling_;
  bool lights_as_one_;
  bool glossy_lobes_only_{false};
  Densities densities_;
  std::size_t max_components_;

  // The point.
  ShadingPoint point_;
  Frame frame_{Vec3(0.0f, 0.0f, 1.0f)};
  BoundBsdf bsdf_;
  std::vector<LightProposal> active_;
  std::vector<std::uint32_t> active_ids_;
  int first_light_{0}, last_light_{0};
  std::unique_ptr<CompensatedDensity> compensated_;  // of the environment, where it is asked for
  int compensated_light_{-1};                        // active light that is drawn by it
  bool restricted_{false};
  Cone cone_;

  // Neighbouring lanes of one component.
  struct Run {
    int component{0};
    std::uint32_t first{0}, count{0};
    std::uint32_t set_size{0};  // of the points that the run is a part of
  };

  // The directions at hand, lane by lane: drawn, then thinned out to those that can contribute.
  struct Drawn {
    std::size_t count{0};
    std::size_t runs{0};
    std::array<Run, kBlock> run;  // by component
    bool lights_only{true};       // no direction of another component
    StreamKey key;                // of the iteration
    bool independent{false};      // points are made for all lanes at once, by key and `points`
    bool along_curve{false};      // and then moved to their places on a curve
    bool candidates{false};       // not traced at once
    PointLanes points;
    Block<float> position{};  // along the curve, within a point's piece
    VariateBlock variates;
    VectorBlock wi, wi_local;
    Block<float> own_pdf{}, any_light_pdf{};
    Block<int> component{};
    Block<int> light{};  // active light that was drawn, where all lights are one component
    VectorBlock f_cos;
    Block<float> bsdf_pdf{}, cone_pdf{};
    Block<std::uint32_t> survivors{};  // lanes
  };
  Drawn drawn_;
  std::vector<Block<float>> light_pdfs_;  // [light component][lane]

  // The samples, structure of arrays.
  std::size_t size_{0};
  VectorArray wi_;
  std::vector<Rgb> f_;
  std::vector<int> component_;
  std::vector<int> light_;  // active light that a light's sample was drawn for
  std::vector<float> own_pdf_;
  std::vector<float> unshadowed_;     // of candidates
  std::size_t stride_;                // of pdfs_
  std::vector<float> pdfs_;           // [component][sample]; empty with many lights
  std::unique_ptr<ManyLights> many_;  // instead, with many lights
  bool keeps_dropped_{false};
  std::size_t dropped_{0};
  std::vector<float> dropped_pdfs_;  // [component][dropped]
  std::vector<int> dropped_alone_;   // [component]
  RayBatch rays_;
  // The loops over traced rays, chosen once per scene.
  using Trace = void (Mixture::*)(std::size_t) noexcept;
  Trace trace_all_ = &Mixture::trace<false, false>;
  Trace trace_selected_ = &Mixture::trace<false, true>;

  ExactLight exact_;

  EstimateCounters counters_;
  StageClock* clock_{nullptr};
  EstimateRecord* record_{nullptr};
  std::vector<std::size_t> record_index_;                       // [sample]
  std::array<std::size_t, kBlock + kLaneGroup> record_lane_{};  // [lane of the block at hand]
};

// A value of each lane on the list of survivors.
template <class T>
void Mixture::pack(const Block<T>& of_lanes, std::size_t survivors, T* of_samples) const noexcept {
  for (std::size_t i = 0; i < survivors; ++i) of_samples[i] = of_lanes[drawn_.survivors[i]];
}

// Lights that can be met along wi, in ascending order, and perhaps others.
template <typename Visit>
void Mixture::for_each_met(const Vec3& wi, Visit visit) noexcept {
  if (many_ == nullptr || restricted_) {
    const auto last = static_cast<std::size_t>(last_light_);
    for (auto l = static_cast<std::size_t>(first_light_); l < last; ++l) visit(l);
    return;
  }
  if (!many_->built) {
    many_->grid.build(active_);
    many_->built = true;
  }
  many_->grid.for_each(wi, visit);
}

}  // namespace penumbra
