#include "harness/gate/gate_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "harness/config_values.h"
#include "harness/gate/gate_words.h"

namespace penumbra {
namespace {

using Json = nlohmann::ordered_json;

void put(Json& json, const char* key, const std::optional<double>& value) {
  if (value) json[key] = number_to_json(*value);
}

Json effect_json(const GateEffect& effect) {
  return {{"log_ratio", number_to_json(effect.log_ratio)},
          {"standard_error", number_to_json(effect.standard_error)},
          {"ratio", number_to_json(std::exp(effect.log_ratio))},
          {"ratio_lo", number_to_json(std::exp(effect.interval.lo))},
          {"ratio_hi", number_to_json(std::exp(effect.interval.hi))},
          {"change_percent", number_to_json(100 * std::expm1(effect.log_ratio))},
          {"ratio_lower_bound", number_to_json(std::exp(effect.lower))},
          {"ratio_upper_bound", number_to_json(std::exp(effect.upper))},
          {"p_loss", number_to_json(effect.p_loss)}};
}

void put(Json& json, const char* key, const std::optional<GateEffect>& effect) {
  if (effect) json[key] = effect_json(*effect);
}

template <class CellOrSuite>
void put_verdict(Json& json, const CellOrSuite& judged) {
  json["verdict"] = to_string(judged.verdict);
  json["reason"] = to_string(judged.reason);
  json["sentence"] = readable(judged.sentence);
  json["confirmed"] = judged.confirmed;
}

// Without an efficiency the currency has no meaning.
template <class CellOrSuite>
void put_efficiency(Json& json, const CellOrSuite& judged) {
  if (!judged.efficiency) return;
  json["currency"] = to_string(judged.currency);
  put(json, "efficiency", judged.efficiency);
}

Json counters_json(const std::vector<CounterChange>& counters) {
  Json json = Json::array();
  for (const CounterChange& counter : counters) {
    json.push_back({{"name", readable(counter.name)},
                    {"base", number_to_json(counter.base)},
                    {"head", number_to_json(counter.head)},
                    {"ratio", number_to_json(counter.head / counter.base)}});
  }
  return json;
}

Json bias_json(const GateBias& bias) {
  if (const std::string why = bias_skipped(bias); !why.empty()) {
    return {{"tested", false}, {"skipped", readable(why)}};
  }
  Json json = {{"tested", true},
               {"blocks", bias.blocks},
               {"p", number_to_json(bias.p)},
               {"p_over_cells", number_to_json(bias.adjusted_p)}};
  put(json, "relative", bias.relative);
  if (bias.relative_interval) {
    json["relative_lo"] = number_to_json(bias.relative_interval->lo);
    json["relative_hi"] = number_to_json(bias.relative_interval->hi);
  }
  return json;
}

Json cell_json(const GateCell& cell) {
  Json json = {{"name", readable(cell.name)}};
  put_verdict(json, cell);
  json["blocks"] = cell.blocks;
  json["same_images"] = cell.same_images;
  json["same_half_images"] = cell.same_half_images;
  put_efficiency(json, cell);
  if (!cell.no_efficiency.empty()) json["no_efficiency"] = readable(cell.no_efficiency);
  put(json, "efficiency_cpu_time", cell.efficiency_cpu);
  if (cell.lost_time_only) json["lost_time_only"] = true;
  put(json, "error_ratio", cell.error_ratio);
  put(json, "instructions_ratio", cell.instructions_ratio);
  put(json, "rays_ratio", cell.rays_ratio);
  put(json, "cpu_time_ratio", cell.cpu_ratio);
  put(json, "p_eff", cell.p_eff);
  if (cell.detectable) json["detectable_loss_percent"] = number_to_json(100 * *cell.detectable);
  json["counters_moved"] = counters_json(cell.counters);
  json["bias"] = bias_json(cell.bias);
  return json;
}

Json suite_json(const GateSuite& suite) {
  Json json = Json::object();
  put_verdict(json, suite);
  json["cells"] = suite.cells;
  json["blocks"] = suite.blocks;
  put_efficiency(json, suite);
  put(json, "efficiency_cpu_time", suite.efficiency_cpu);
  if (suite.lost_time_only) json["lost_time_only"] = true;
  put(json, "instructions_ratio", suite.instructions_ratio);
  return json;
}

// A build that is no JSON object is kept as text.
Json provenance_json(const GateProvenance& side) {
  Json json = {{"what", readable(side.what)}};
  if (!side.build.empty()) {
    Json build = Json::parse(side.build, nullptr, false);
    if (build.is_object()) {
      json["build"] = std::move(build);
    } else {
      json["build_text"] = readable(side.build);
    }
  }
  json["machine"] = readable(side.machine);
  return json;
}

Json null_control_json(const NullControl& control) {
  Json json = {{"pairs", control.pairs}, {"rejected", control.rejected}};
  put(json, "efficiency_cpu_time", control.cpu_time);
  return json;
}

}  // namespace

nlohmann::ordered_json gate_json(const GateResult& result) {
  Json json;
  json["schema"] = "penumbra-gate";
  json["version"] = kGateJsonVersion;
  json["verdict"] = to_string(result.verdict);
  json["exit_code"] = result.exit_code;
  json["sentence"] = readable(result.sentence);
  json["config"] = {{"name", readable(result.config_name)}, {"file", readable(result.config_file)}};
  json["metric"] = readable(result.metric);
  json["confidence"] = number_to_json(result.confidence);
  json["looks"] = result.looks;
  json["blocks"] = result.blocks;
  json["interleaved"] = result.interleaved;
  json["runs"] = result.runs;
  json["wall_s"] = number_to_json(result.wall_s);
  json["suite"] = suite_json(result.suite);
  json["cells"] = Json::array();
  for (const GateCell& cell : result.cells) json["cells"].push_back(cell_json(cell));
  if (result.null_control) json["null_control"] = null_control_json(*result.null_control);
  json["notes"] = Json::array();
  for (const std::string& note : result.notes) json["notes"].push_back(readable(note));
  json["base"] = provenance_json(result.base);
  json["head"] = provenance_json(result.head);
  return json;
}

}  // namespace penumbra
