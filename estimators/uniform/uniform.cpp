// Uniform directions over the hemisphere: the plainest baseline, which knows nothing.
//
// Idea: draw directions uniformly over the hemisphere of the geometric normal,
//   F = (2 pi/n) sum_i f(w_i),    n = SRL x lights.
// Source: Kajiya 1986, "The rendering equation".
//
// Unbiased: no light comes from below the horizon. Weak case: small lights and narrow lobes, which
// few directions meet.

#include "estimators/uniform/uniform.h"

#include <memory>

#include "estimators/mixture/estimates.h"

namespace penumbra::uniform {
namespace {

class UniformSampling final : public Estimator {
 public:
  UniformSampling(const Scene& scene, const Budget& budget)
      : budget_(budget),
        mixture_(scene, LightSampling::Area, false, most_samples(scene, budget), Densities::Own),
        counts_(scene.lights().size() + 2),
        expected_(counts_.size()) {}

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    estimate_tile(
        mixture_, tile, seed, out, [](std::size_t) {},
        [this](const StreamKey& key) { return one_point(key); });
    out.counters.iterations += mixture_.counters().estimates;
  }

 private:
  Rgb one_point(const StreamKey& key) noexcept {
    const auto m = static_cast<std::size_t>(mixture_.components());
    const auto hemisphere = static_cast<std::size_t>(mixture_.cone_component());
    std::fill(counts_.begin(), counts_.end(), 0);
    counts_[hemisphere] = budget_.srl() * mixture_.active_lights();
    expected_[hemisphere] = counts_[hemisphere];
    // A cone of a right angle.
    mixture_.cone() = {mixture_.point().geometric_normal, 1.0f};
    mixture_.draw(budget_.sampler, key, std::span(counts_).first(m));
    return narrow(own_density_sum(mixture_, std::span(expected_).first(m)));
  }

  Budget budget_;
  Mixture mixture_;
  std::vector<int> counts_;
  std::vector<double> expected_;
};

std::span<const ParamSpec> params() { return {}; }

std::string bias_reason(const ParamSet&) { return {}; }

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet&, const Budget& budget) {
  return std::make_unique<UniformSampling>(scene, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "uniform",
    .summary = "uniform directions over the hemisphere",
    .citation = "Kajiya 1986, The rendering equation",
    .params = params,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::uniform
