#include "harness/render.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "harness/clocks.h"
#include "harness/commands/commands.h"
#include "harness/config_values.h"
#include "harness/exr.h"
#include "harness/map_strips.h"
#include "harness/picture.h"
#include "harness/pixel_record.h"
#include "harness/plan.h"
#include "harness/progress.h"
#include "harness/project_root.h"
#include "harness/render_json.h"
#include "harness/scene_store.h"
#include "scenes/core/error.h"
#include "scenes/core/suggest.h"

namespace penumbra {
namespace {

// As the schema of experiments has them.
constexpr int kMaxSpp = 1'000'000;
constexpr float kMaxExposure = 30.0f;

const EstimatorEntry& estimator_of(const std::string& name) {
  if (const EstimatorEntry* entry = find_estimator(name)) return *entry;
  std::vector<std::string> names;
  for (const EstimatorEntry* entry : all_estimators()) names.emplace_back(entry->name);
  throw InputError("--estimator: unknown estimator \"" + name + "\"" + did_you_mean(name, names));
}

// A JSON scalar, or else the text itself.
ParamValue value_of(const std::string& text) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  return (json.is_discarded() ? std::nullopt : param_from_json(json)).value_or(text);
}

// "name=value" with the type that the parameter declares.
ParamSet params_of(const EstimatorEntry& entry, const std::vector<std::string>& assignments) {
  ParamSet::Map given;
  for (const std::string& assignment : assignments) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos) {
      throw InputError("--set: expected name=value, found \"" + assignment + "\"");
    }
    given[assignment.substr(0, equals)] = value_of(assignment.substr(equals + 1));
  }
  std::vector<ParamProblem> problems;
  ParamSet params = resolve_params(entry.params(), given, problems);
  std::string message;
  for (const ParamProblem& problem : problems) {
    message += (message.empty() ? "--set " : "\n--set ") + problem.name + ": " + problem.message;
  }
  if (!problems.empty()) throw InputError(message);
  return params;
}

Quantity quantity_of(const std::string& name) {
  if (const std::optional<Quantity> quantity = parse_quantity(name)) return *quantity;
  throw InputError("--quantity: unknown quantity \"" + name + "\"; allowed: radiance, irradiance");
}

std::unique_ptr<Scene> load_timed(const RenderOptions& options, RenderSetup& setup) {
  std::optional<std::array<int, 2>> resolution;
  if (options.resolution.size() == 2) resolution = {options.resolution[0], options.resolution[1]};
  const Stopwatch watch;
  SceneDescription description = load_description(scene_path(options.scene), resolution);
  setup.read_s = watch.wall_s();
  auto scene = std::make_unique<Scene>(std::move(description), SceneOptions{options.keep_all});
  setup.build_s = watch.wall_s() - setup.read_s;
  return scene;
}

void write_picture(const RenderOptions& options, const Scene& scene, const ShadingPoints& points,
                   const RenderResult& result) {
  const Image picture =
      add_images(result.width, result.height, result.radiance, seen_emission(scene, points));
  if (options.out.extension() == ".png") {
    write_png_rgb(options.out, picture, options.exposure);
  } else {
    std::vector<ExrLayer> layers = {{"", picture}, {"reflected", result.image()}};
    for (std::size_t m = 0; m < result.maps.size(); ++m) {
      layers.push_back({result.map_infos[m].name, result.maps[m]});
    }
    write_exr(options.out, layers,
              {{"estimator", options.estimator},
               {"quantity", options.quantity},
               {"spp", std::to_string(options.spp)},
               {"srl", options.srl},
               {"seed", std::to_string(options.seed)},
               {"geometry", scene.traits().geometry},
               {"scene_hash", scene.content_hash()}});
  }
  if (options.maps.empty()) return;
  if (result.maps.empty()) throw InputError("--maps: this estimator has no maps");
  write_map_strips(options.maps, result, scene.name() + ", " + options.estimator);
}

std::string summary_line(const RenderOptions& options, const RenderResult& result) {
  return fmt::format("{}: {} x {}, {} estimates, {:.1f} rays per estimate, {:.2f} s ({:.2f} s CPU)",
                     options.out.string(), result.width, result.height, result.counters.estimates,
                     static_cast<double>(result.counters.rays) /
                         static_cast<double>(std::max<std::uint64_t>(result.counters.estimates, 1)),
                     result.time_wall_s, result.time_cpu_s);
}

}  // namespace

std::filesystem::path scene_path(const std::string& scene) {
  if (std::filesystem::is_regular_file(scene)) return scene;
  const std::filesystem::path file = project_root() / "scenes" / scene / "scene.json";
  if (std::filesystem::exists(file)) return file;
  const std::vector<std::string> names = scene_names(project_root());
  throw InputError("unknown scene \"" + scene + "\": neither a file nor one of the scenes" +
                   did_you_mean(scene, names));
}

RenderSettings render_settings(const RenderOptions& options) {
  const EstimatorEntry& entry = estimator_of(options.estimator);
  const std::optional<SamplerKind> sampler = parse_sampler_kind(options.sampler);
  if (!sampler) {
    throw InputError("--sampler: unknown sampler \"" + options.sampler +
                     "\"; allowed: independent, stratified, sobol");
  }
  Srl srl = parse_srl(options.srl);
  if (srl.split && !entry.adaptive) {
    throw InputError("--srl: \"" + options.srl + "\" is split, but " + std::string(entry.name) +
                     " does not adapt; give one number");
  }
  if (srl.total() < entry.min_srl) {
    throw InputError(fmt::format("--srl: {} needs at least {}, found {}", entry.name, entry.min_srl,
                                 srl.total()));
  }
  if (!srl.split) srl = split_srl(srl.total(), entry.adaptive);
  if (options.spp < 1 || options.spp > kMaxSpp) {
    throw InputError(fmt::format("--spp: expected 1 to {}, found {}", kMaxSpp, options.spp));
  }
  // Also not NaN.
  if (!(std::abs(options.exposure) <= kMaxExposure)) {
    throw InputError(fmt::format("--exposure: expected -{0} to {0} stops, found {1}", kMaxExposure,
                                 options.exposure));
  }
  RenderSettings settings;
  settings.estimator = &entry;
  settings.params = params_of(entry, options.params);
  settings.budget = {*sampler, srl.initial, srl.adaptive};
  settings.spp = options.spp;
  settings.seed = options.seed;
  settings.threads = resolve_threads(options.threads);
  settings.maps = !options.maps.empty() || options.out.extension() == ".exr";
  return settings;
}

int render_command(const RenderOptions& options) {
  const std::string extension = options.out.extension().string();
  if (extension != ".exr" && extension != ".png") {
    throw InputError("-o: expected a file ending in .exr or .png, found \"" + options.out.string() +
                     "\"");
  }
  const RenderSettings settings = render_settings(options);
  const Quantity quantity = quantity_of(options.quantity);
  RenderSetup setup;
  const std::unique_ptr<Scene> scene = load_timed(options, setup);
  const Stopwatch points_watch;
  const ShadingPoints points = make_shading_points(*scene, settings.spp, kCameraSeed, 16, quantity);
  setup.points_s = points_watch.wall_s();
  RenderResult result = render(*scene, points, settings);
  write_picture(options, *scene, points, result);
  note(summary_line(options, result));
  if (options.json) {
    fmt::print("{}\n", render_json(*scene, points, settings, setup, result).dump(2));
  }
  if (result.bad_count > 0) {
    find_causes(*scene, points, settings, result);
    for (const BadEstimate& bad : result.bad) warn(describe(bad));
    warn(fmt::format("{} estimates are not finite or negative", result.bad_count));
  }
  return result.bad_count > 0 ? kRunFailure : kSuccess;
}

}  // namespace penumbra
