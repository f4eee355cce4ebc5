#include <nlohmann/json.hpp>

#include "harness/inspection.h"
#include "harness/inspection_lights.h"

namespace penumbra {
namespace {

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
    json["area"] = world_area(light, t);
    json["two_sided"] = light.two_sided;
  }
  return json;
}

nlohmann::ordered_json work_json(const InspectedWork& w) {
  return {{"samples", w.samples},
          {"rays", w.rays},
          {"lit", w.lit},
          {"time_ns", w.time_ns},
          {"scratch_bytes", w.scratch_bytes}};
}

nlohmann::ordered_json components_json(const InspectedComponents& c) {
  return {{"lights", c.lights},
          {"lights_that_can_contribute", c.lights_that_can},
          {"points_with_components", c.points_that_can},
          {"points_in_mirrors", c.points_in_mirrors},
          {"points_with_occluder", c.points_with_occluder}};
}

}  // namespace

nlohmann::ordered_json inspection_json(const Inspection& inspection) {
  const Scene& scene = *inspection.scene;
  const SceneTraits& t = scene.traits();
  nlohmann::ordered_json json;
  json["scene"] = scene.name();
  json["content_hash"] = scene.content_hash();
  json["geometry"] = t.geometry;
  json["load_ms"] = (inspection.load.read_s + inspection.load.build_s) * 1e3;
  json["load"] = {{"read_ms", inspection.load.read_s * 1e3},
                  {"build_ms", inspection.load.build_s * 1e3},
                  {"ray_tracer_build_ms", inspection.load.ray_scene_s * 1e3},
                  {"peak_bytes", inspection.load.peak_bytes}};
  json["triangles"] = t.triangles;
  json["spheres"] = t.spheres;
  json["ray_tracer_bytes"] = t.ray_scene_bytes;
  json["scale"] = t.scale;
  json["diagonal"] = t.diagonal;
  json["materials"] = t.materials;
  json["all_diffuse"] = t.all_diffuse;
  json["min_alpha"] = t.min_alpha;
  json["lights"] = nlohmann::ordered_json::array();
  for (const Light& light : scene.lights()) json["lights"].push_back(light_json(light, t));
  json["point_lights"] = t.point_lights;
  json["spot_lights"] = t.spot_lights;
  json["directional_lights"] = t.directional_lights;
  json["environment"] = t.has_environment;
  json["resolution"] = {inspection.points.width, inspection.points.height};
  json["valid_points"] = inspection.points.valid_count;
  json["parts"] = nlohmann::ordered_json::array();
  for (const InspectedPart& part : inspection.parts) {
    json["parts"].push_back({{"name", part.name},
                             {"present", part.present},
                             {"why", part.why},
                             {"bytes", part.bytes},
                             {"build_ms", part.build_ms}});
  }
  json["components"] = components_json(inspection.components);
  for (const InspectedEstimator& e : inspection.estimators) {
    json["estimates"].push_back({{"estimator", e.name},
                                 {"srl", e.srl},
                                 {"lean", work_json(e.lean)},
                                 {"keep_all", work_json(e.kept)}});
  }
  for (const NamedCost& cost : inspection.costs) {
    nlohmann::ordered_json row = {{"estimator", cost.estimator}, {"srl", cost.srl}};
    row.update(cost_split_json(cost.split));
    json["costs"].push_back(std::move(row));
  }
  return json;
}

}  // namespace penumbra
