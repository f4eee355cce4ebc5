#include "estimators/pmc_hi_plus/settings.h"

#include <vector>

#include "estimators/mixture/estimates.h"

namespace penumbra::pmc_hi_plus {

std::span<const ParamSpec> specs() {
  static const std::vector<ParamSpec> table = {
      light_sampling_param(),
      {.name = "allocation",
       .default_value = std::string("variance"),
       .doc = "further samples go where neighbours found variance, or alike to every estimate",
       .choices = {"variance", "equal"}},
      {.name = "rays",
       .default_value = 64.0,
       .doc = "samples of a component whose single sample has a relative variance of 1",
       .min = 0.0,
       .max = 1e6},
      {.name = "exponent",
       .default_value = 0.4,
       .doc = "of the relative variance, in the number of samples",
       .min = 0.0,
       .max = 1.0},
      {.name = "radius",
       .default_value = std::int64_t{2},
       .doc = "of the neighbourhood [pixels]; 0: other estimates of the pixel alone",
       .min = 0,
       .max = 7},
      {.name = "heuristic",
       .default_value = std::string("power2"),
       .doc = "weights of the components: power with exponent 2, or balance",
       .choices = {"power2", "balance"}},
      {.name = "bsdf_lobes",
       .default_value = std::string("glossy"),
       .doc = "lobes that the BSDF component draws from: glossy ones, or all",
       .choices = {"glossy", "all"}},
      {.name = "bsdf",
       .default_value = 0.5,
       .doc = "share of the BSDF component in the initial samples, where there is a lobe for it",
       .min = 0.0,
       .max = 0.9},
      {.name = "sequence",
       .default_value = std::string("continued"),
       .doc = "further points continue the initial Sobol sequence, or are scrambled afresh",
       .choices = {"continued", "fresh"}},
  };
  return table;
}

Settings read_settings(const ParamSet& params, const Budget& budget) {
  Settings s;
  s.light_sampling = light_sampling_of(params);
  s.heuristic = params.text("heuristic") == "balance" ? Heuristic::Balance : Heuristic::Power2;
  s.glossy_lobes_only = params.text("bsdf_lobes") == "glossy";
  s.continue_sequence = params.text("sequence") == "continued";
  s.allocation = {
      params.text("allocation") == "variance",    params.real("rays"), params.real("exponent"),
      static_cast<int>(params.integer("radius")), params.real("bsdf"), budget.srl_adaptive};
  return s;
}

}  // namespace penumbra::pmc_hi_plus
