#include "estimators/pmc_hi/settings.h"

#include <algorithm>
#include <vector>

#include "estimators/mixture/estimates.h"
#include "scenes/core/error.h"

namespace penumbra::pmc_hi {
namespace {

// Position of a parameter's value among its declared choices; enums are declared in the same order.
template <typename Enum>
Enum choice(const ParamSet& params, std::string_view name) {
  for (const ParamSpec& spec : specs()) {
    if (spec.name != name) continue;
    const auto found = std::find(spec.choices.begin(), spec.choices.end(), params.text(name));
    return static_cast<Enum>(found - spec.choices.begin());
  }
  PN_CHECK(false, "the parameter is declared");
  return Enum{};
}

ParamSpec text(std::string name, std::vector<std::string> choices, std::string doc) {
  ParamSpec spec{.name = std::move(name), .default_value = choices.front(), .doc = std::move(doc)};
  spec.choices = std::move(choices);
  return spec;
}

ParamSpec number(std::string name, ParamValue value, double min, double max, std::string doc) {
  return {.name = std::move(name),
          .default_value = std::move(value),
          .doc = std::move(doc),
          .choices = {},
          .min = min,
          .max = max};
}

}  // namespace

std::span<const ParamSpec> specs() {
  static const std::vector<ParamSpec> table = {
      light_sampling_param(),
      text("light_mode", {"per_light", "all_as_one"},
           "one component per light, or one that draws a light uniformly"),
      text("schedule", {"populations", "two_stage"},
           "adaptive rays in iterations of `population` samples; or base_iterations of them to "
           "adapt "
           "and one large iteration with the rest"),
      number("base_iterations", std::int64_t{1}, 0, 1024,
             "adaptive populations of the first of two stages; 0 draws all adaptive rays at once"),
      number("population", std::int64_t{0}, 0, 65536,
             "samples per adaptive iteration; 0 means twice the number of components"),
      {.name = "adapt",
       .default_value = true,
       .doc = "false: all rays in the initial iteration, nothing is learned"},
      text("initial", {"equal", "mis_split"},
           "first weights: equal, or half BSDF and half lights as the shared layout of mis"),
      text("rounding", {"largest_remainder", "systematic", "multinomial"},
           "how N alpha becomes counts"),
      text("denominator", {"counts", "alpha"}, "mixture density from n_k/N or from alpha_k"),
      number("n_min", std::int64_t{1}, 0, 16,
             "samples that every component but the cone gets in every iteration; 0 is the literal "
             "paper"),
      number("alpha_floor", 0.0, 0.0, 0.5,
             "smallest weight of every component but the cone, for the alpha denominator"),
      text("update", {"tag", "rb"},
           "Eq. 6 by the component that drew a sample, or Rao-Blackwellised over all components"),
      text("memory", {"last", "cumulative"},
           "weights learned from the last or from all iterations"),
      text("combine", {"average", "sqrt", "last", "adaptive_only", "inverse_variance", "pooled"},
           "how iterations become one estimate; the last two are biased"),
      text("sequence", {"fresh", "continued"},
           "every iteration's points are scrambled afresh, or continue the first one's set "
           "(biased)"),
      text("cone", {"needed", "always", "never"},
           "where the cone is a component: at points with something between them and a light that "
           "can contribute, everywhere (the literal paper), or nowhere"),
      number("alpha_cone", 0.2, 0.0, 0.9, "weight of the cone when it enters the mixture"),
      number("cone_min_hits", std::int64_t{2}, 1, 64,
             "samples with positive weight that a cone needs; 1 is the literal paper"),
      text("beta_rule",
           {"rms_angle", "chord", "spherical_std", "per_axis_std", "circular_std", "mean_angle"},
           "the cone's half angle from the weighted directions"),
      number("beta_scale", 1.0, 0.01, 10.0, "factor on the cone's half angle"),
      number("beta_min", 0.02, 1e-6, 1.5, "smallest half angle of the cone [rad]"),
      number("beta_max", 1.5707963267948966, 1e-3, 3.141592653589793,
             "largest half angle of the cone [rad]"),
  };
  return table;
}

Settings read_settings(const ParamSet& params) {
  Settings s;
  s.light_sampling = light_sampling_of(params);
  s.lights_as_one = params.text("light_mode") == "all_as_one";
  s.two_stage = params.text("schedule") == "two_stage";
  s.base_iterations = static_cast<int>(params.integer("base_iterations"));
  s.population = static_cast<int>(params.integer("population"));
  s.adapt = params.boolean("adapt");
  s.initial = choice<Initial>(params, "initial");
  s.rounding = choice<Rounding>(params, "rounding");
  s.denominator = choice<Denominator>(params, "denominator");
  s.n_min = static_cast<int>(params.integer("n_min"));
  s.alpha_floor = params.real("alpha_floor");
  s.update = choice<Update>(params, "update");
  s.cumulative = params.text("memory") == "cumulative";
  s.combine = choice<Combine>(params, "combine");
  s.continue_sequence = params.text("sequence") == "continued";
  s.cone = choice<ConeUse>(params, "cone");
  s.alpha_cone = params.real("alpha_cone");
  s.cone_min_hits = static_cast<int>(params.integer("cone_min_hits"));
  s.cone_rules = {choice<BetaRule>(params, "beta_rule"), params.real("beta_scale"),
                  params.real("beta_min"), params.real("beta_max")};
  return s;
}

namespace {

// Equal weights and at least as many samples as components: rounded counts are at least n_min and
// have mean N alpha, but multinomial ones can be anything.
std::string bias_without_adaptation(const Settings& s) {
  if (s.initial == Initial::MisSplit || s.rounding != Rounding::Multinomial) return {};
  const bool raised = s.n_min > 0;
  if (s.denominator == Denominator::Alpha) {
    return raised ? "counts raised to n_min with alpha in the denominator" : "";
  }
  return raised ? "" : "counts in the denominator while a component can get none";
}

}  // namespace

std::string bias_reason(const ParamSet& params) {
  const Settings s = read_settings(params);
  if (s.combine == Combine::InverseVariance) {
    return "combination weights come from the estimates that they combine";
  }
  if (s.combine == Combine::Pooled) {
    return "later kernels of the pooled denominator depend on earlier samples";
  }
  if (!s.adapt) return bias_without_adaptation(s);
  if (s.continue_sequence) {
    return "points continue a set whose own first points decided how it goes on";
  }
  const bool fixed_counts = s.rounding == Rounding::LargestRemainder;
  if (s.denominator == Denominator::Alpha) {
    if (fixed_counts) return "deterministic counts with alpha in the denominator";
    if (s.n_min > 0) return "counts raised to n_min with alpha in the denominator";
    if (s.alpha_floor <= 0.0) return "a component whose weight reaches 0 is never revived";
    return {};
  }
  if (s.n_min == 0) {
    return fixed_counts ? "a component whose weight reaches 0 is never revived"
                        : "counts in the denominator while a component can get none";
  }
  return {};
}

void check_budget(const Settings& s, const Budget& budget, std::size_t lights) {
  const int components = s.lights_as_one ? 2 : static_cast<int>(lights) + 1;
  if (s.alpha_floor * components > 1.0) {
    throw InputError("pmc_hi: alpha_floor = " + std::to_string(s.alpha_floor) + " for " +
                     std::to_string(components) +
                     " components leaves less than nothing to adapt, " + "at most " +
                     std::to_string(1.0 / components) + " is allowed");
  }
  // Random numbers are keyed by the iteration in 12 bits.
  constexpr std::size_t kMaxIterations = 4095;
  const std::size_t smallest = s.population > 0 ? static_cast<std::size_t>(s.population) : 4;
  const std::size_t most = static_cast<std::size_t>(budget.srl_adaptive) * lights / smallest;
  if (s.adapt && !s.two_stage && most > kMaxIterations) {
    throw InputError("pmc_hi: a population of " + std::to_string(smallest) + " makes " +
                     std::to_string(most) + " iterations of " +
                     std::to_string(budget.srl_adaptive) + " adaptive rays per light, at most " +
                     std::to_string(kMaxIterations) + " are allowed");
  }
  if (s.n_min == 0 || lights == 0) return;
  // The tightest point has one light that can contribute: SRL samples for two components. Where
  // more lights can, the samples grow faster than the components.
  const int needed = 2 * s.n_min;
  const std::string where = "pmc_hi: n_min = " + std::to_string(s.n_min) + " needs ";
  const int initial = s.adapt ? budget.srl_initial : budget.srl();
  if (initial < needed) {
    throw InputError(where + "at least " + std::to_string(needed) +
                     " initial shadow rays per light, found " + std::to_string(initial));
  }
  if (s.adapt && budget.srl_adaptive > 0 && budget.srl_adaptive < needed) {
    throw InputError(where + "at least " + std::to_string(needed) +
                     " adaptive shadow rays per light, found " +
                     std::to_string(budget.srl_adaptive));
  }
  // Every iteration has at least a population or all adaptive rays. The automatic population, twice
  // the components, holds n_min = 2 always and more for few lights only.
  const int population =
      s.population > 0 ? s.population : 2 * (components + (s.cone == ConeUse::Always ? 1 : 0));
  const bool in_populations =
      s.adapt && (!s.two_stage || s.base_iterations > 0) && budget.srl_adaptive > 0;
  if (in_populations && population < s.n_min * components) {
    throw InputError(where + "a population of at least " + std::to_string(s.n_min * components) +
                     " for " + std::to_string(components) + " components, found " +
                     std::to_string(population));
  }
}

}  // namespace penumbra::pmc_hi
