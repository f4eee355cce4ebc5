#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "harness/build_info.h"
#include "harness/commands/commands.h"
#include "harness/inspection.h"

namespace penumbra {
namespace {

int inspect_cost_command(const InspectOptions& options) {
  RenderOptions cost;
  cost.estimator = options.estimator;
  cost.srl = options.srl;
  cost.sampler = options.sampler;
  cost.spp = options.spp;
  cost.params = options.params;
  cost.threads = 1;
  const NamedCost measured = inspect_cost(options.scene, render_settings(cost));
  if (!options.json) {
    fmt::print("{}", cost_splits_text({measured}));
    return kSuccess;
  }
  nlohmann::ordered_json json = {{"scene", options.scene},        {"estimator", measured.estimator},
                                 {"srl", measured.srl},           {"sampler", cost.sampler},
                                 {"commit", build_info().commit}, {"flags", build_info().flags}};
  json.update(cost_split_json(measured.split));
  fmt::print("{}\n", json.dump(2));
  return kSuccess;
}

}  // namespace

int inspect_command(const InspectOptions& options) {
  if (!options.estimator.empty()) return inspect_cost_command(options);
  const Inspection inspection = inspect_scene(options.scene, options.keep_all);
  if (options.json) {
    fmt::print("{}\n", inspection_json(inspection).dump(2));
  } else {
    fmt::print("{}", inspection_text(inspection));
  }
  return kSuccess;
}

}  // namespace penumbra
