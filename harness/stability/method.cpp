#include "harness/stability/method.h"

#include <algorithm>

#include "scenes/core/error.h"

namespace penumbra::stability {
namespace {

Method make_method(const EstimatorEntry& entry, std::string label, ParamSet::Map given) {
  Method method{std::move(label), &entry, std::move(given), {}};
  method.bias_reason = entry.bias_reason(method.params());
  return method;
}

}  // namespace

bool Method::has_param(std::string_view name) const {
  const std::span<const ParamSpec> specs = entry->params();
  return std::any_of(specs.begin(), specs.end(),
                     [&](const ParamSpec& spec) { return spec.name == name; });
}

ParamSet Method::params(const ParamSet::Map& more) const {
  ParamSet::Map all = given;
  for (const auto& [name, value] : more) {
    if (has_param(name)) all[name] = value;
  }
  std::vector<ParamProblem> problems;
  ParamSet result = resolve_params(entry->params(), all, problems);
  PN_CHECK(problems.empty(), "the suite gives valid parameters");
  return result;
}

std::vector<Method> stability_methods(std::span<const EstimatorEntry* const> estimators) {
  std::vector<Method> methods;
  for (const EstimatorEntry* entry : estimators) {
    const std::string name(entry->name);
    methods.push_back(make_method(*entry, name, {}));
    if (methods.back().has_param("light_sampling")) {
      methods.push_back(
          make_method(*entry, name + " sa", {{"light_sampling", std::string("solid_angle")}}));
    }
    if (name == "pmc_hi") {
      methods.push_back(make_method(*entry, name + " literal",
                                    {{"n_min", std::int64_t{0}},
                                     {"cone", std::string("always")},
                                     {"cone_min_hits", std::int64_t{1}},
                                     {"beta_min", 1e-3}}));
    }
  }
  return methods;
}

Budget split_budget(const EstimatorEntry& entry, int srl) {
  // Two initial rays at least: what adapts needs one for each of two components.
  const int initial = entry.adaptive ? std::max(2, srl / 4) : srl;
  return {SamplerKind::Independent, initial, srl - initial};
}

}  // namespace penumbra::stability
