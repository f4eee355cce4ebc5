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

#include "estimators/mixture/single_technique.h"

namespace penumbra::bsdf {
namespace {

std::span<const ParamSpec> params() { return {}; }

std::string bias_reason(const ParamSet&) { return {}; }

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet&, const Budget& budget) {
  return make_single_technique(scene, budget, Technique::Bsdf);
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
