#include "estimators/mixture/single_technique.h"

#include <algorithm>

#include "estimators/mixture/estimates.h"

namespace penumbra {
namespace {

class SingleTechnique final : public Estimator {
 public:
  SingleTechnique(const Scene& scene, const Budget& budget, Technique technique)
      : budget_(budget),
        technique_(technique),
        mixture_(scene, LightSampling::Area, false, most_samples(scene, budget), Densities::Own),
        counts_(scene.sampled_lights().size() + 2),
        expected_(counts_.size()) {}

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    estimate_tile(
        mixture_, tile, seed, out, [](std::size_t) {},
        [this](const StreamKey& key) { return one_point(key); });
    out.counters.iterations += mixture_.counters().estimates;
  }

 private:
  Rgb one_point(const StreamKey& key) noexcept {
    int component = mixture_.bsdf_component();
    if (technique_ == Technique::Hemisphere) {
      component = mixture_.cone_component();
      // A cone of a right angle.
      mixture_.cone() = {mixture_.point().geometric_normal, 1.0f};
    }
    const auto m = static_cast<std::size_t>(mixture_.components());
    const auto own = static_cast<std::size_t>(component);
    std::fill(counts_.begin(), counts_.end(), 0);
    counts_[own] = budget_.srl() * mixture_.active_lights();
    expected_[own] = counts_[own];
    mixture_.draw(budget_.sampler, key, std::span(counts_).first(m));
    return narrow(own_density_sum(mixture_, std::span(expected_).first(m)));
  }

  Budget budget_;
  Technique technique_;
  Mixture mixture_;
  std::vector<int> counts_;
  std::vector<double> expected_;
};

}  // namespace

std::unique_ptr<Estimator> make_single_technique(const Scene& scene, const Budget& budget,
                                                 Technique technique) {
  return std::make_unique<SingleTechnique>(scene, budget, technique);
}

}  // namespace penumbra
