#include "harness/inspection.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "harness/clocks.h"
#include "harness/commands/commands.h"
#include "harness/scene_store.h"
#include "harness/statistics.h"
#include "scenes/core/images/image_module.h"
#include "scenes/core/models/model_file.h"
#include "scenes/core/module.h"
#include "scenes/core/scene_file.h"

namespace penumbra {
namespace {

constexpr int kRounds = 3;
// Of a cost asked for by itself.
constexpr int kCostRounds = 7;
constexpr std::array<int, 2> kCostResolution = {120, 68};
constexpr int kMostSrl = 18;
// Samples of one rendering, and of one estimate, that are enough to measure.
constexpr double kSamplesOfRendering = 1e6;
constexpr int kSamplesOfEstimate = 64;

double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double total = 0.0;
  double resident = 0.0;
  statm >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

std::size_t peak_resident_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

double heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

// Time and memory of something done once.
struct Cost {
  double seconds{0};
  double bytes{0};
};

template <typename Action>
Cost cost_of(Action action) {
  const double before = resident_bytes();
  const Stopwatch watch;
  action();
  return {watch.wall_s(), std::max(resident_bytes() - before, 0.0)};
}

int srl_for(int lights) { return std::clamp(kSamplesOfEstimate / lights, 4, kMostSrl); }

// An image small enough for scenes of many lights.
std::array<int, 2> resolution_for(int lights) {
  const double samples = srl_for(lights) * static_cast<double>(lights);
  const double side = std::sqrt(std::clamp(kSamplesOfRendering / samples, 576.0, 57600.0) / 144.0);
  return {static_cast<int>(16.0 * side), static_cast<int>(9.0 * side)};
}

int lights_with_density(const SceneDescription& scene) {
  const auto shapes =
      std::count_if(scene.shapes.begin(), scene.shapes.end(),
                    [](const ShapeDescription& s) { return s.emission.has_value(); });
  return std::max(static_cast<int>(shapes) + (scene.environment ? 1 : 0), 1);
}

RenderSettings settings_of(const EstimatorEntry& entry, SamplerKind sampler, int srl) {
  RenderSettings settings;
  settings.estimator = &entry;
  std::vector<ParamProblem> problems;
  settings.params = resolve_params(entry.params(), {}, problems);
  const int initial = entry.adaptive ? std::max(2, srl / 4) : srl;
  settings.budget = {sampler, initial, srl - initial};
  settings.spp = 1;
  settings.threads = 1;
  settings.seed = 1;
  return settings;
}

std::string text_of(const Budget& budget) {
  return budget.srl_adaptive == 0 ? std::to_string(budget.srl_initial)
                                  : fmt::format("{}-{}", budget.srl_initial, budget.srl_adaptive);
}

double estimates_of(const RenderResult& result) {
  return static_cast<double>(std::max<std::uint64_t>(result.counters.estimates, 1));
}

double scratch_bytes(const Scene& scene, const RenderSettings& settings) {
  const double before = heap_bytes();
  const auto estimator = settings.estimator->create(scene, settings.params, settings.budget);
  return heap_bytes() - before;
}

InspectedWork work_of(const Scene& scene, const RenderSettings& settings,
                      const std::vector<RenderResult>& results) {
  const EstimateCounters& counters = results.front().counters;
  const double estimates = estimates_of(results.front());
  std::vector<double> times;
  for (const RenderResult& result : results) times.push_back(result.time_cpu_s / estimates * 1e9);
  return {static_cast<double>(counters.samples) / estimates,
          static_cast<double>(counters.rays) / estimates,
          static_cast<double>(counters.lit) / estimates, median(times),
          scratch_bytes(scene, settings)};
}

// The same work with the scene as it is and with everything kept, interleaved.
InspectedEstimator compare(const Scene& lean, const ShadingPoints& lean_points, const Scene& kept,
                           const ShadingPoints& kept_points, const EstimatorEntry& entry, int srl) {
  const RenderSettings settings = settings_of(entry, SamplerKind::Independent, srl);
  std::vector<RenderResult> lean_results;
  std::vector<RenderResult> kept_results;
  for (int i = 0; i < 3; ++i) {
    lean_results.push_back(render(lean, lean_points, settings));
    kept_results.push_back(render(kept, kept_points, settings));
  }
  return {std::string(entry.name), srl, work_of(lean, settings, lean_results),
          work_of(kept, settings, kept_results)};
}

InspectedComponents components_of(const Scene& scene, const ShadingPoints& points) {
  InspectedComponents result;
  result.lights = static_cast<double>(scene.sampled_lights().size());
  for (const ShadingPoint& point : points.points) {
    if (!point.valid()) continue;
    if (scene.is_mirror(point.material)) {
      ++result.points_in_mirrors;
      continue;
    }
    int able = 0;
    bool hidden = false;
    for (const std::uint32_t id : scene.sampled_lights()) {
      LightProposal proposal;
      if (!proposal.set_up(scene.lights()[id], LightSampling::Area, point.position,
                           point.geometric_normal, scene.keep_all())) {
        continue;
      }
      ++able;
      hidden = hidden || scene.may_be_occluded(id, point);
    }
    result.lights_that_can += able;
    result.points_that_can += able > 0 ? 1 : 0;
    result.points_with_occluder += hidden ? 1 : 0;
  }
  const auto count = static_cast<double>(std::max<std::size_t>(points.valid_count, 1));
  result.lights_that_can /= std::max(count - result.points_in_mirrors, 1.0);
  result.points_that_can /= count;
  result.points_in_mirrors /= count;
  result.points_with_occluder /= count;
  return result;
}

std::string plural(std::size_t count, const std::string& singular, const std::string& more) {
  return fmt::format("{} {}", count, count == 1 ? singular : more);
}

// A part of the lean scene beside the same part where all is kept: an absent one shows what it
// would have cost.
InspectedPart part_of(std::string name, const ScenePart& lean, const ScenePart& kept,
                      std::string why_present, std::string why_absent) {
  const ScenePart& shown = lean.present() ? lean : kept;
  return {std::move(name), lean.present(),
          lean.present() ? std::move(why_present) : std::move(why_absent),
          static_cast<double>(shown.bytes), shown.build_s * 1e3};
}

InspectedPart module_part(const std::string& name, bool was_open, const Cost& cost,
                          std::string why_present, std::string why_absent) {
  return {name, was_open, was_open ? std::move(why_present) : std::move(why_absent),
          was_open ? 0.0 : cost.bytes, was_open ? 0.0 : cost.seconds * 1e3};
}

std::vector<InspectedPart> parts_of(const Scene& lean, const Scene& kept,
                                    const ShadingPoints& lean_points,
                                    const ShadingPoints& kept_points) {
  const SceneParts& l = lean.parts();
  const SceneParts& k = kept.parts();
  std::vector<InspectedPart> parts;
  parts.push_back(part_of("texture system", l.textures, k.textures,
                          plural(l.textures.count, "image", "images") + " on surfaces",
                          "no surface has an image"));
  const bool has_values = !lean_points.surfaces.empty();
  const ShadingPoints& shown = has_values ? lean_points : kept_points;
  parts.push_back({"texture values per point", has_values,
                   has_values ? "looked up once per shading point" : "no surface has an image",
                   static_cast<double>(shown.surfaces.size() * sizeof(SurfaceValues)), 0.0});
  parts.push_back(part_of("alpha filters", l.masks, k.masks,
                          plural(l.masks.count, "shape has", "shapes have") + " holes",
                          "no surface has holes: rays are traced without a callback"));
  parts.push_back(part_of("vertex normals", l.normals, k.normals,
                          plural(l.normals.count, "mesh has", "meshes have") + " them",
                          "no mesh has them"));
  parts.push_back(part_of("texture coordinates", l.uvs, k.uvs,
                          plural(l.uvs.count, "shape has", "shapes have") + " images",
                          "no image needs them"));
  parts.push_back(part_of("environment table", l.environment, k.environment,
                          plural(l.environment.count, "texel", "texels"),
                          "the scene has no environment"));
  parts.push_back(part_of(
      "ray scenes of lights", l.light_crossings, k.light_crossings,
      plural(l.light_crossings.count, "mesh light", "mesh lights") + " of more than 32 triangles",
      "no mesh light of more than 32 triangles"));
  parts.push_back(part_of("loop over delta lights", l.delta_lights, k.delta_lights,
                          plural(l.delta_lights.count, "light", "lights") + " without extent",
                          "no light without extent"));
  return parts;
}

// Loads the scene with a small image, which is enough for traits and times per estimate.
LoadTimes load_measured(const std::filesystem::path& file, bool keep_all, Inspection& result) {
  const Stopwatch watch;
  SceneDescription description = load_description(file, std::nullopt);
  const double read_s = watch.wall_s();
  const int lights = lights_with_density(description);
  result.srl = srl_for(lights);
  description.camera.resolution = resolution_for(lights);
  result.scene = std::make_unique<Scene>(std::move(description), SceneOptions{keep_all});
  return {read_s, watch.wall_s() - read_s, result.scene->traits().ray_scene_build_s,
          peak_resident_bytes()};
}

}  // namespace

Inspection inspect_scene(const std::string& scene, bool keep_all) {
  Inspection result;
  const std::filesystem::path file = scene_path(scene);
  result.load = load_measured(file, keep_all, result);
  const bool images_open = module_is_open("images");
  const bool models_open = module_is_open("models");
  const Cost images = cost_of([] { image_module(); });
  const Cost models = cost_of([] { open_model_importers(); });
  SceneDescription description = load_scene_description(file);  // its warnings have been shown
  description.camera.resolution = {result.scene->camera().width(), result.scene->camera().height()};
  const Scene kept(std::move(description), SceneOptions{true});
  result.points = make_shading_points(*result.scene, 1, kCameraSeed, 16);
  const ShadingPoints kept_points = make_shading_points(kept, 1, kCameraSeed, 16);
  result.parts = {module_part("image module", images_open, images, "opened for this scene",
                              "no image file is read: OpenImageIO is not mapped"),
                  module_part("model importers", models_open, models, "opened for this scene",
                              "no model file is read: Assimp, tinygltf are not mapped")};
  const std::vector<InspectedPart> parts =
      parts_of(*result.scene, kept, result.points, kept_points);
  result.parts.insert(result.parts.end(), parts.begin(), parts.end());
  result.components = components_of(*result.scene, result.points);
  for (const EstimatorEntry* entry : all_estimators()) {
    result.estimators.push_back(
        compare(*result.scene, result.points, kept, kept_points, *entry, result.srl));
    const RenderSettings settings = settings_of(*entry, SamplerKind::Independent, result.srl);
    result.costs.push_back({std::string(entry->name), text_of(settings.budget),
                            measure_cost_split(*result.scene, result.points, settings, kRounds)});
  }
  return result;
}

NamedCost inspect_cost(const std::string& scene, const RenderSettings& settings) {
  const std::filesystem::path file = scene_path(scene);
  const auto load = [&](bool fast_rays) {
    return load_scene(file, kCostResolution, {.keep_all = false, .fast_rays = fast_rays});
  };
  const std::unique_ptr<Scene> robust = load(false);
  const std::unique_ptr<Scene> fast = load(true);
  const ShadingPoints points = make_shading_points(*robust, settings.spp, kCameraSeed, 16);
  return {std::string(settings.estimator->name), text_of(settings.budget),
          measure_cost_split(*robust, points, settings, kCostRounds, fast.get())};
}

}  // namespace penumbra
