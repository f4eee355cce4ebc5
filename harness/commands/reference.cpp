// reference: rendering, extending and publishing the references of a config; advice on noisy ones.

#include "harness/reference.h"

#include <fmt/format.h>

#include "harness/commands/commands.h"
#include "harness/experiment.h"
#include "harness/progress.h"
#include "harness/rank_places.h"
#include "harness/reference_manifest.h"
#include "harness/render.h"
#include "harness/shell_words.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

std::string reference_call(const ConfigOptions& config, const std::string& scene,
                           std::int64_t add_spp) {
  std::string call = "penumbra reference " + shell_quoted(config.config.string());
  for (const std::string& assignment : config.overrides) {
    call += " --set " + shell_quoted(assignment);
  }
  return call + fmt::format(" --scene {} --add-spp {}", shell_quoted(scene), add_spp);
}

// What is wrong with a cell's reference; empty: nothing.
std::string complaint(const EfficiencyRow& row) {
  if (row.verdict == Verdict::Exact || !row.err) return {};
  if (!row.reference_share) return "the error is not above the noise of the reference";
  if (!(*row.reference_share > kShareToWarn)) return {};
  const double percent = 100.0 * *row.reference_share;
  return fmt::format("{:.{}f} % of the MSE is the variance of the reference{}", percent,
                     percent < 10.0 ? 1 : 0,
                     *row.reference_share > kShareToRefuse ? ", too much for an efficiency" : "");
}

}  // namespace

int reference_command(const ReferenceOptions& options) {
  const Ranks& ranks = *options.ranks;
  const ExperimentConfig config = load_config(options.config, ranks);
  if (options.add_spp < 0) {
    throw InputError(fmt::format("--add-spp: at least 0, found {}", options.add_spp));
  }
  const int wanted = options.threads.value_or(config.threads);
  const int threads = wanted == 0 && ranks.is_launched() ? place_ranks(ranks, true).threads
                                                         : resolve_threads(wanted);
  const WorkShare shard = options.shard.empty() ? WorkShare{} : parse_shard(options.shard);
  bool found = options.scene.empty();
  for (std::size_t s = 0; s < config.scenes.size(); ++s) {
    const SceneConfig& scene_config = config.scenes[s];
    if (!options.scene.empty() && scene_config.name != options.scene) continue;
    found = true;
    if (!shard.has(s)) continue;
    const LoadedScene scene = load_scene(scene_config, config.tile, config.quantity);
    Reference reference = provide_reference(scene, threads, options.add_spp, ranks);
    if (!ranks.is_root()) continue;
    if (options.small) reference.file = publish_small_reference(reference.file);
    fmt::print("{}\n", describe(scene_config.name, reference));
  }
  if (!found) throw InputError("the config has no scene \"" + options.scene + "\"");
  return kSuccess;
}

void warn_of_reference_shares(const Experiment& experiment, const std::vector<EfficiencyRow>& rows,
                              const ConfigOptions& config) {
  for (const EfficiencyRow& row : rows) {
    const std::string what = complaint(row);
    if (what.empty()) continue;
    for (std::size_t s = 0; s < experiment.scenes().size(); ++s) {
      const LoadedScene& scene = experiment.scenes()[s];
      const std::optional<Reference>& reference = experiment.references()[s];
      if (scene.config->name != row.scene || !reference || reference->exact()) continue;
      const std::int64_t add =
          spp_to_add(row.reference_share, reference->spp, scene.points.camera_samples);
      warn(fmt::format("{}, {}{} ({}): {}; lower it with: {}", row.scene, row.label,
                       row.params.empty() ? "" : " " + row.params, row.sampler, what,
                       reference_call(config, row.scene, add)));
    }
  }
}

}  // namespace penumbra
