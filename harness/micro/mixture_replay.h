#pragma once

#include <deque>
#include <span>
#include <vector>

#include "estimators/alsd/evidence.h"
#include "estimators/mixture/mixture.h"
#include "estimators/pmc_hi/settings.h"
#include "harness/micro/replay.h"

namespace penumbra::micro {

/// Kernels of the estimators of mixtures, on what the records of their estimates say they drew.
class MixtureReplay final : public Replay {
 public:
  MixtureReplay(BenchTile& tile, const EstimatorEntry& entry, const Budget& budget,
                std::uint64_t seed);

 private:
  /// What an estimate finds at its point.
  struct AtPoint {
    std::vector<LightProposal> lights;     // that can contribute
    std::vector<std::uint32_t> light_ids;  // in the scene
    Frame frame;
    BoundBsdf bsdf;
    bool with_cone{false};  // of pmc_hi
  };
  /// Directions that one component drew in one iteration.
  struct Drawn {
    std::size_t estimate;
    std::size_t component;
    std::uint32_t count;
    StreamKey key;
    Cone cone;
  };
  /// Up to a block of directions of one iteration, in the order of their drawing.
  struct Directions {
    std::size_t estimate{0};
    std::size_t count{0}, survivors{0};
    bool lights_only{true};
    VectorBlock wi, survivor_local;
  };
  /// The samples of one iteration, drawn again.
  struct Population {
    std::size_t estimate;
    StreamKey key;
    int n;
    bool last;                                // of its estimate
    std::vector<double> alpha, coefficients;  // [component]
    std::vector<double> weights, density;     // [sample]
    std::unique_ptr<Mixture> mixture{};
    std::unique_ptr<RayBatch> rays{};  // of the samples, traced
  };

  void read_points();
  void read_records(Estimator& estimator);
  void read_iteration(const EstimateRecord& record, std::size_t estimate, std::size_t t,
                      StreamKey key);
  void read_directions(const EstimateRecord& record, std::size_t estimate, std::size_t t);
  void weigh(Population& population, const Cone& cone, std::span<const int> counts);

  void add_set_up();
  void add_point_sets();
  void add_draws();
  void add_densities();
  void add_rays(Estimator& estimator);
  void add_lights_met();
  void add_mixture_pdfs();
  void add_pmc_hi();
  void add_populations_of_pmc_hi();
  void add_alsd();
  void draw(const Drawn& drawn);
  bool light_met(const Population& population, std::size_t sample) const;
  bool may_be_occluded(std::span<const std::uint32_t> lights, const ShadingPoint& point) const;
  bool is_light(const Drawn& drawn) const {
    return drawn.component < points_[drawn.estimate].lights.size();
  }
  bool is_cone(const Drawn& drawn) const {
    return drawn.component > points_[drawn.estimate].lights.size();
  }
  bool own_densities() const { return entry_->shares_in_tile; }

  BenchTile* tile_;
  const EstimatorEntry* entry_;
  Budget budget_;
  std::uint64_t seed_;
  Tile job_;
  std::vector<Rgb> radiance_;
  pmc_hi::Settings settings_;  // of pmc_hi

  std::vector<AtPoint> points_;     // [estimate]
  std::vector<double> luminances_;  // [estimate], from the populations
  std::vector<Drawn> drawn_;
  std::deque<Directions> directions_;
  RecordedRays recorded_;
  std::deque<Population> populations_;
  std::unique_ptr<alsd::Evidence> evidence_;

  Mixture scratch_;
  VariateBlock variates_;
  VectorBlock wi_, f_cos_;
  Block<float> pdf_{};
  std::vector<double> values_;  // [component]
  std::vector<int> counts_;     // [component]
};

}  // namespace penumbra::micro
