#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "estimators/estimator.h"
#include "harness/commands/commands.h"
#include "harness/metrics.h"
#include "harness/project_root.h"
#include "harness/stability/stability_case.h"
#include "scenes/core/scene_file.h"

namespace penumbra {
namespace {

using Json = nlohmann::ordered_json;

Json value_json(const ParamValue& value) {
  return std::visit([](const auto& v) { return Json(v); }, value);
}

ParamSet defaults_of(const EstimatorEntry& entry) {
  std::vector<ParamProblem> problems;
  return resolve_params(entry.params(), {}, problems);
}

std::string allowed_text(const ParamSpec& spec) {
  if (!spec.choices.empty()) return fmt::format("{}", fmt::join(spec.choices, " | "));
  if (std::holds_alternative<bool>(spec.default_value)) return "true | false";
  return fmt::format("{:g} to {:g}", spec.min, spec.max);
}

Json presets_json(const EstimatorEntry& entry) {
  Json list = Json::array();
  for (const Preset& preset : presets_of(entry)) {
    Json params = Json::object();
    for (const auto& [name, value] : preset.params) params[name] = value_json(value);
    list.push_back({{"name", preset.name},
                    {"doc", preset.doc},
                    {"sampler", preset.sampler},
                    {"params", params}});
  }
  return list;
}

Json estimators_json() {
  Json list = Json::array();
  for (const EstimatorEntry* entry : all_estimators()) {
    const std::string bias = entry->bias_reason(defaults_of(*entry));
    Json params = Json::array();
    for (const ParamSpec& spec : entry->params()) {
      Json param = {
          {"name", spec.name}, {"default", value_json(spec.default_value)}, {"doc", spec.doc}};
      if (!spec.choices.empty()) param["choices"] = spec.choices;
      if (std::isfinite(spec.min)) param["min"] = spec.min;
      if (std::isfinite(spec.max)) param["max"] = spec.max;
      params.push_back(param);
    }
    list.push_back({{"name", entry->name},
                    {"summary", entry->summary},
                    {"citation", entry->citation},
                    {"unbiased", bias.empty()},
                    {"bias_reason", bias},
                    {"adaptive", entry->adaptive},
                    {"shares_in_tile", entry->shares_in_tile},
                    {"correlates_pixels", entry->correlates_pixels},
                    {"may_be_negative", entry->may_be_negative},
                    {"min_srl", entry->min_srl},
                    {"params", params},
                    {"presets", presets_json(*entry)}});
  }
  return list;
}

void print_estimators() {
  for (const EstimatorEntry* entry : all_estimators()) {
    const std::string bias = entry->bias_reason(defaults_of(*entry));
    fmt::print("{}  {}\n", entry->name, entry->summary);
    fmt::print("    {}\n", entry->citation);
    fmt::print("    {}; SRL {}, at least {}{}{}{}\n",
               bias.empty() ? "unbiased with its defaults" : "biased: " + bias,
               entry->adaptive ? "A-B (initial-adaptive)" : "A", entry->min_srl,
               entry->shares_in_tile ? "; shares within tiles" : "",
               entry->correlates_pixels ? "; errors of neighbouring pixels are correlated" : "",
               entry->may_be_negative ? "; estimates may be negative" : "");
    for (const ParamSpec& spec : entry->params()) {
      fmt::print("    {:<16} {:<18} {}\n{:37}{}\n", spec.name, "= " + to_string(spec.default_value),
                 spec.doc, "", allowed_text(spec));
    }
    for (const Preset& preset : presets_of(*entry)) {
      std::string values;
      for (const auto& [name, value] : preset.params) {
        values += fmt::format(", {} = {}", name, to_string(value));
      }
      fmt::print("    preset {:<9} {}{}\n{:37}{}\n", preset.name, preset.sampler, values, "",
                 preset.doc);
    }
    fmt::print("\n");
  }
}

Json scenes_json() {
  Json list = Json::array();
  for (const std::string& name : scene_names(project_root())) {
    const SceneSummary scene = read_scene_summary(scene_path(name));
    list.push_back({{"name", name},
                    {"summary", scene.summary},
                    {"resolution", scene.resolution},
                    {"shapes", scene.shapes}});
  }
  return list;
}

Json metrics_json() {
  Json list = Json::array();
  for (const MetricInfo& metric : metric_table()) {
    list.push_back({{"name", metric.name},
                    {"label", metric.label},
                    {"unit", metric.unit},
                    {"formula", metric.formula},
                    {"epsilon", metric.epsilon},
                    {"lower_is_better", metric.lower_is_better},
                    {"diagnostic", metric.diagnostic}});
  }
  return list;
}

Json stability_json() {
  Json list = Json::array();
  for (const stability::StabilityCase& c : stability::stability_cases()) {
    list.push_back({{"name", c.name},
                    {"ids", c.ids},
                    {"summary", c.summary},
                    {"parameter", c.parameter},
                    {"values", c.values},
                    {"answer", c.answer}});
  }
  return list;
}

void print_stability() {
  for (const stability::StabilityCase& c : stability::stability_cases()) {
    fmt::print("{:<18} {}\n{:19}{}: {:g} to {:g} in {} steps; answer: {}\n", c.name, c.summary, "",
               c.parameter, c.values.front(), c.values.back(), c.values.size(), c.answer);
  }
}

}  // namespace

int list_command(const ListOptions& options) {
  const bool all = options.what == "all";
  if (options.json) {
    Json json;
    if (all || options.what == "estimators") json["estimators"] = estimators_json();
    if (all || options.what == "scenes") json["scenes"] = scenes_json();
    if (all || options.what == "metrics") json["metrics"] = metrics_json();
    if (all || options.what == "stability") json["stability"] = stability_json();
    fmt::print("{}\n", json.dump(2));
    return kSuccess;
  }
  if (all || options.what == "estimators") {
    if (all) fmt::print("ESTIMATORS\n");
    print_estimators();
  }
  if (all || options.what == "scenes") {
    if (all) fmt::print("SCENES\n");
    for (const Json& scene : scenes_json()) {
      fmt::print("{:<22} {}\n", scene["name"].get<std::string>(),
                 scene["summary"].get<std::string>());
    }
    if (all) fmt::print("\n");
  }
  if (all || options.what == "metrics") {
    if (all) fmt::print("METRICS\n");
    for (const MetricInfo& metric : metric_table()) {
      fmt::print("{:<16} {}\n{:17}{}{}; [{}], {} is better{}\n", metric.name, metric.label, "",
                 metric.formula,
                 metric.epsilon.empty() ? "" : fmt::format("; eps = {}", metric.epsilon),
                 metric.unit, metric.lower_is_better ? "lower" : "higher",
                 metric.diagnostic ? "; diagnostic, decides no verdict" : "");
    }
    fmt::print(
        "x the image, A and B the halves of the reference, r = (A+B)/2. FLIP is not among them: no "
        "maintained implementation is packaged for Debian; measure the EXR files of runs/ with its "
        "authors' tool.\n");
  }
  if (all || options.what == "stability") {
    if (all) fmt::print("\nSTABILITY CASES\n");
    print_stability();
  }
  return kSuccess;
}

}  // namespace penumbra
