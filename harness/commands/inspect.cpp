#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "harness/clocks.h"
#include "harness/commands/commands.h"
#include "harness/render.h"
#include "harness/scene_store.h"

namespace penumbra {
namespace {

constexpr int kRepetitions = 5;
constexpr int kSrl = 18;

// Where the time of one `mis` estimate goes: its total, and the same rays traced again alone.
struct TimeSplit {
  std::string sampler;
  double rays_per_estimate{0};
  double total_ns{0};    ///< per estimate
  double queries_ns{0};  ///< per estimate, inside the bare ray queries
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

RenderSettings mis_settings(SamplerKind sampler) {
  RenderSettings settings;
  settings.estimator = find_estimator("mis");
  std::vector<ParamProblem> problems;
  settings.params = resolve_params(settings.estimator->params(), {}, problems);
  settings.budget = {sampler, kSrl, 0};
  settings.spp = 1;
  settings.threads = 1;
  settings.seed = 1;
  return settings;
}

TimeSplit time_split(Scene& scene, const ShadingPoints& points, SamplerKind sampler) {
  const RenderSettings settings = mis_settings(sampler);
  RayRecorder recorder;
  scene.set_recorder(&recorder);
  const RenderResult recorded = render(scene, points, settings);
  scene.set_recorder(nullptr);
  std::vector<double> totals;
  std::vector<double> queries;
  for (int i = 0; i < kRepetitions; ++i) {
    totals.push_back(render(scene, points, settings).time_cpu_s);
    const Stopwatch watch;
    for (RayBatch& batch : recorder.batches) scene.intersect(batch);
    queries.push_back(watch.cpu_s());
  }
  const auto estimates =
      static_cast<double>(std::max<std::uint64_t>(recorded.counters.estimates, 1));
  TimeSplit split;
  split.sampler = std::string(to_string(sampler));
  split.rays_per_estimate = static_cast<double>(recorded.counters.rays) / estimates;
  split.total_ns = median(totals) / estimates * 1e9;
  split.queries_ns = median(queries) / estimates * 1e9;
  return split;
}

// World units of a light without extent, from those of the scene.
Vec3d world_position(const Light& light, const SceneTraits& t) {
  return Vec3d(light.center) / t.scale + t.center;
}

Vec3d world_intensity(const Light& light, const SceneTraits& t) {
  return light.intensity / (t.scale * t.scale);
}

std::string_view type_name(LightType type) {
  switch (type) {
    case LightType::Rectangle:
      return "rectangle";
    case LightType::Sphere:
      return "sphere";
    case LightType::Mesh:
      return "mesh";
    case LightType::Environment:
      return "environment";
    case LightType::Spot:
      return "spot";
    case LightType::Directional:
      return "directional";
    case LightType::Point:
      break;
  }
  return "point";
}

// Half angle in degrees of a cone of 1 - cos = depth.
double half_angle_deg(double depth) {
  return 2.0 * std::asin(std::sqrt(0.5 * depth)) * 180.0 / M_PI;
}

std::string triple(const Vec3d& v) { return fmt::format("({:g}, {:g}, {:g})", v.x, v.y, v.z); }

void print_light(const Light& light, const SceneTraits& t) {
  fmt::print("    {:<12} {:<11} ", light.name, type_name(light.type));
  if (light.type == LightType::Directional) {
    fmt::print("irradiance {} W/m^2 along {}\n", triple(Vec3d(light.irradiance)),
               triple(light.axis));
  } else if (light.is_delta()) {
    fmt::print("intensity {} W/sr at {}", triple(world_intensity(light, t)),
               triple(world_position(light, t)));
    if (light.type == LightType::Spot) {
      fmt::print(" along {}, half angles {:g} and {:g} degrees", triple(light.axis),
                 half_angle_deg(light.inner_depth), half_angle_deg(light.outer_depth));
    }
    fmt::print("\n");
  } else if (light.type == LightType::Environment) {
    const Environment& e = light.environment;
    fmt::print("{} x {} texels, {} W/m^2 over all directions, {:.1f} kB\n", e.columns(), e.rows(),
               triple(e.power()), static_cast<double>(e.memory_bytes()) / 1024.0);
  } else {
    fmt::print("radiance {} W/(m^2 sr), area {:.4g}, {}\n", triple(Vec3d(light.radiance)),
               light.area / (t.scale * t.scale), light.two_sided ? "two-sided" : "one-sided");
  }
}

void print_text(const Scene& scene, double load_s, const ShadingPoints& points,
                const std::vector<TimeSplit>& splits) {
  const SceneTraits& t = scene.traits();
  fmt::print("scene {}  (content {})\n", scene.name(), scene.content_hash());
  fmt::print(
      "  geometry     {} triangles, {} spheres, {:.1f} kB in the ray tracer, loaded in {:.1f} ms\n",
      t.triangles, t.spheres, static_cast<double>(t.ray_scene_bytes) / 1024.0, load_s * 1e3);
  fmt::print("  scale        {} scene units per world unit, centre ({}, {}, {}), diagonal {:.3g}\n",
             t.scale, t.center.x, t.center.y, t.center.z, t.diagonal);
  fmt::print("  materials    {}{}, sharpest glossy lobe alpha {:g}\n", t.materials,
             t.all_diffuse ? ", all diffuse" : "", static_cast<double>(t.min_alpha));
  if (t.textures > 0) {
    fmt::print("  textures     {} on {:.1f} kB of texels, {} shapes with holes\n", t.textures,
               static_cast<double>(t.texture_bytes) / 1024.0, t.masked_shapes);
  }
  fmt::print(
      "  lights       {}: {} rectangles, {} spheres, {} meshes, {} points, {} spots, {} "
      "directional, {} environment\n",
      scene.lights().size(), t.rectangle_lights, t.sphere_lights, t.mesh_lights, t.point_lights,
      t.spot_lights, t.directional_lights, t.has_environment ? "an" : "no");
  for (const Light& light : scene.lights()) print_light(light, t);
  fmt::print(
      "  camera       {} x {}, {:.1f} % of the pixel centres can reflect light\n", points.width,
      points.height,
      100.0 * static_cast<double>(points.valid_count) / static_cast<double>(points.points.size()));
  fmt::print("\none estimate of mis at SRL {}, one thread, medians of {}:\n", kSrl, kRepetitions);
  for (const TimeSplit& s : splits) {
    fmt::print("  {:<12} {:6.0f} ns = {:.0f} ns in ray queries ({:.1f} rays) + {:.0f} ns outside\n",
               s.sampler, s.total_ns, s.queries_ns, s.rays_per_estimate, s.total_ns - s.queries_ns);
  }
}

nlohmann::ordered_json rgb_json(const Vec3d& v) { return {v.x, v.y, v.z}; }

nlohmann::ordered_json light_json(const Light& light, const SceneTraits& t) {
  nlohmann::ordered_json json = {{"name", light.name}, {"type", type_name(light.type)}};
  if (light.type == LightType::Directional) {
    json["direction"] = rgb_json(light.axis);
    json["irradiance"] = rgb_json(Vec3d(light.irradiance));
  } else if (light.is_delta()) {
    json["position"] = rgb_json(world_position(light, t));
    json["intensity"] = rgb_json(world_intensity(light, t));
    if (light.type == LightType::Spot) {
      json["direction"] = rgb_json(light.axis);
      json["inner_angle_deg"] = half_angle_deg(light.inner_depth);
      json["outer_angle_deg"] = half_angle_deg(light.outer_depth);
    }
  } else if (light.type == LightType::Environment) {
    const Environment& e = light.environment;
    json["grid"] = {e.columns(), e.rows()};
    json["power"] = rgb_json(e.power());
    json["memory_bytes"] = e.memory_bytes();
  } else {
    json["radiance"] = rgb_json(Vec3d(light.radiance));
    json["area"] = light.area / (t.scale * t.scale);
    json["two_sided"] = light.two_sided;
  }
  return json;
}

void print_json(const Scene& scene, double load_s, const ShadingPoints& points,
                const std::vector<TimeSplit>& splits) {
  const SceneTraits& t = scene.traits();
  nlohmann::ordered_json json;
  json["scene"] = scene.name();
  json["content_hash"] = scene.content_hash();
  json["load_ms"] = load_s * 1e3;
  json["triangles"] = t.triangles;
  json["spheres"] = t.spheres;
  json["ray_tracer_bytes"] = t.ray_scene_bytes;
  json["scale"] = t.scale;
  json["diagonal"] = t.diagonal;
  json["materials"] = t.materials;
  json["all_diffuse"] = t.all_diffuse;
  json["min_alpha"] = t.min_alpha;
  json["textures"] = t.textures;
  json["texture_bytes"] = t.texture_bytes;
  json["masked_shapes"] = t.masked_shapes;
  json["lights"] = nlohmann::ordered_json::array();
  for (const Light& light : scene.lights()) json["lights"].push_back(light_json(light, t));
  json["point_lights"] = t.point_lights;
  json["spot_lights"] = t.spot_lights;
  json["directional_lights"] = t.directional_lights;
  json["environment"] = t.has_environment;
  json["resolution"] = {points.width, points.height};
  json["valid_points"] = points.valid_count;
  for (const TimeSplit& s : splits) {
    json["mis_estimate"].push_back({{"sampler", s.sampler},
                                    {"srl", kSrl},
                                    {"rays", s.rays_per_estimate},
                                    {"total_ns", s.total_ns},
                                    {"ray_query_ns", s.queries_ns},
                                    {"outside_ns", s.total_ns - s.queries_ns}});
  }
  fmt::print("{}\n", json.dump(2));
}

}  // namespace

int inspect_command(const InspectOptions& options) {
  const Stopwatch watch;
  // A small image is enough for traits and times per estimate.
  const std::unique_ptr<Scene> scene = load_scene(scene_path(options.scene), {{320, 180}});
  const double load_s = watch.wall_s();
  const ShadingPoints points = make_shading_points(*scene, 1, kCameraSeed, 16);
  std::vector<TimeSplit> splits;
  for (const SamplerKind sampler :
       {SamplerKind::Independent, SamplerKind::Stratified, SamplerKind::Sobol}) {
    splits.push_back(time_split(*scene, points, sampler));
  }
  if (options.json) {
    print_json(*scene, load_s, points, splits);
  } else {
    print_text(*scene, load_s, points, splits);
  }
  return kSuccess;
}

}  // namespace penumbra
