#include "harness/gate/gate_adapters.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "harness/gate/gate_words.h"

namespace penumbra {
namespace {

struct Metric {
  std::string name;
  double ratio{1};
  double lo{1}, hi{1};
  GateVerdict verdict{GateVerdict::Pass};
  std::string sentence;
};

void add(std::vector<Metric>& metrics, std::string_view name, const auto& judged) {
  if (!judged.efficiency) return;
  const GateEffect& effect = *judged.efficiency;
  Metric metric{readable(name),
                std::exp(effect.log_ratio),
                std::exp(effect.interval.lo),
                std::exp(effect.interval.hi),
                judged.verdict,
                readable(judged.sentence)};
  if (!std::isfinite(metric.ratio) || !std::isfinite(metric.lo) || !std::isfinite(metric.hi)) {
    return;
  }
  metrics.push_back(std::move(metric));
}

std::vector<Metric> metrics_of(const GateResult& result) {
  std::vector<Metric> metrics;
  add(metrics, kSuiteName, result.suite);
  for (const GateCell& cell : result.cells) add(metrics, cell.name, cell);
  return metrics;
}

}  // namespace

nlohmann::ordered_json github_benchmark_json(const GateResult& result) {
  auto json = nlohmann::ordered_json::array();
  for (const Metric& metric : metrics_of(result)) {
    json.push_back({{"name", metric.name},
                    {"unit", "head/base"},
                    {"value", metric.ratio},
                    {"range", fmt::format("{:.4f} to {:.4f}", metric.lo, metric.hi)},
                    {"extra", fmt::format("{}: {}", to_string(metric.verdict), metric.sentence)}});
  }
  return json;
}

nlohmann::ordered_json bencher_json(const GateResult& result) {
  auto json = nlohmann::ordered_json::object();
  for (const Metric& metric : metrics_of(result)) {
    json[metric.name]["efficiency-ratio"] = {
        {"value", metric.ratio}, {"lower_value", metric.lo}, {"upper_value", metric.hi}};
  }
  return json;
}

}  // namespace penumbra
