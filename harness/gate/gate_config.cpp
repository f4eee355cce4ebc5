#include "harness/gate/gate_config.h"

#include <array>
#include <nlohmann/json.hpp>

#include "harness/config_values.h"
#include "harness/experiment.h"
#include "harness/gate/gate_config_json.h"

namespace penumbra {

using nlohmann::json;
using nlohmann::ordered_json;

namespace {

struct Threshold {
  const char* key;
  double GateThresholds::*member;
};
constexpr std::array<Threshold, 5> kThresholds{{{"noise", &GateThresholds::noise},
                                                {"fail", &GateThresholds::fail},
                                                {"pass", &GateThresholds::pass},
                                                {"instructions", &GateThresholds::instructions},
                                                {"cpu_time", &GateThresholds::cpu_time}}};

void put_thresholds(const GateThresholds& thresholds, ordered_json& json) {
  for (const Threshold& threshold : kThresholds) {
    json[threshold.key] = thresholds.*threshold.member;
  }
}

void take_thresholds(const json& object, GateThresholds& thresholds) {
  for (const Threshold& threshold : kThresholds) {
    take(object, threshold.key, thresholds.*threshold.member);
  }
}

}  // namespace

const GateThresholds& GateConfig::thresholds_of(const std::string& cell) const {
  for (const GateOverride& special : overrides) {
    if (matches_glob(special.cells, cell)) return special.thresholds;
  }
  return thresholds;
}

ordered_json gate_config_json(const GateConfig& gate) {
  ordered_json result;
  result["looks"] = gate.looks;
  result["confidence"] = gate.confidence;
  result["metric"] = gate.metric;
  put_thresholds(gate.thresholds, result);
  result["suite_instructions"] = gate.suite_instructions;
  result["bias_level"] = gate.bias_level;
  result["timeout_s"] = gate.timeout_s;
  for (const GateOverride& special : gate.overrides) {
    ordered_json item = {{"cells", special.cells}, {"reason", special.reason}};
    put_thresholds(special.thresholds, item);
    result["overrides"].push_back(item);
  }
  return result;
}

GateConfig gate_config_of(const json& section) {
  GateConfig gate;
  const json& looks = array_member(section, "looks");
  if (!looks.empty()) gate.looks.clear();
  for (const json& look : looks) {
    if (holds<int>(look)) gate.looks.push_back(look.get<int>());
  }
  take(section, "confidence", gate.confidence);
  take(section, "metric", gate.metric);
  take(section, "suite_instructions", gate.suite_instructions);
  take(section, "bias_level", gate.bias_level);
  take(section, "timeout_s", gate.timeout_s);
  take_thresholds(section, gate.thresholds);
  for (const json& item : array_member(section, "overrides")) {
    GateOverride special;
    special.thresholds = gate.thresholds;
    take(item, "cells", special.cells);
    take(item, "reason", special.reason);
    take_thresholds(item, special.thresholds);
    gate.overrides.push_back(std::move(special));
  }
  return gate;
}

}  // namespace penumbra
