// Uniform directions over the hemisphere: the plainest baseline, which knows nothing.
//
// Idea: draw directions uniformly over the hemisphere of the geometric normal,
//   F = (2 pi/n) sum_i f(w_i),    n = SRL x lights.
// Source: Kajiya 1986, "The rendering equation".
//
// Unbiased: no light comes from below the horizon. Weak case: small lights and narrow lobes, which
// few directions meet.

#include "estimators/uniform/uniform.h"

#include "estimators/mixture/single_technique.h"

namespace penumbra::uniform {
namespace {

std::span<const ParamSpec> params() { return {}; }

std::string bias_reason(const ParamSet&) { return {}; }

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet&, const Budget& budget) {
  return make_single_technique(scene, budget, Technique::Hemisphere);
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
