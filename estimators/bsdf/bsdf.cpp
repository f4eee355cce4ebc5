// BSDF sampling alone: a baseline that explains the others.
//
// Idea: draw directions from the BSDF's own density p and count the light that they happen to meet:
//   F = (1/n) sum_i f(w_i) / p(w_i),    n = SRL x lights.
// Source: Kajiya 1986, "The rendering equation"; as a technique of its own in Veach and Guibas
// 1995.
//
// Unbiased: the density is positive wherever the BSDF is. Weak case: small lights, which few
// directions meet.

#include "estimators/bsdf/bsdf.h"

#include <memory>

#include "estimators/mixture/estimates.h"

namespace penumbra::bsdf {
namespace {

class BsdfSampling final : public Estimator {
 public:
  BsdfSampling(const Scene& scene, const Budget& budget)
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
    const auto bsdf = static_cast<std::size_t>(mixture_.bsdf_component());
    std::fill(counts_.begin(), counts_.end(), 0);
    counts_[bsdf] = budget_.srl() * mixture_.active_lights();
    expected_[bsdf] = counts_[bsdf];
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
  return std::make_unique<BsdfSampling>(scene, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "bsdf",
    .summary = "directions from the BSDF alone",
    .citation =
        "Veach and Guibas 1995, Optimally combining sampling techniques for Monte Carlo rendering",
    .params = params,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::bsdf
