#include "harness/render_json.h"

#include <nlohmann/json.hpp>

#include "harness/build_info.h"

namespace penumbra {

nlohmann::ordered_json render_json(const Scene& scene, const ShadingPoints& points,
                                   const RenderSettings& settings, const RenderSetup& setup,
                                   const RenderResult& result) {
  nlohmann::ordered_json json;
  json["scene"] = scene.name();
  json["content_hash"] = scene.content_hash();
  json["geometry"] = scene.traits().geometry;
  json["triangles"] = scene.traits().triangles;
  json["lights"] = scene.lights().size();
  json["estimator"] = settings.estimator->name;
  json["sampler"] = to_string(settings.budget.sampler);
  json["spp"] = settings.spp;
  json["srl"] = settings.budget.srl();
  json["srl_initial"] = settings.budget.srl_initial;
  json["srl_adaptive"] = settings.budget.srl_adaptive;
  json["seed"] = settings.seed;
  json["width"] = result.width;
  json["height"] = result.height;
  json["valid_points"] = points.valid_count;
  json["threads"] = settings.threads;
  json["estimates"] = result.counters.estimates;
  json["samples"] = result.counters.samples;
  json["candidates"] = result.counters.candidates;
  json["rays"] = result.counters.rays;
  json["lit"] = result.counters.lit;
  json["iterations"] = result.counters.iterations;
  json["nonfinite"] = result.bad_count;
  json["time_wall_s"] = result.time_wall_s;
  json["time_cpu_s"] = result.time_cpu_s;
  json["time_prepare_s"] = result.time_prepare_s;
  json["instructions"] = nullptr;
  if (result.instructions > 0) json["instructions"] = result.instructions;
  json["load"] = {{"read_ms", setup.read_s * 1e3},
                  {"build_ms", setup.build_s * 1e3},
                  {"ray_tracer_build_ms", scene.traits().ray_scene_build_s * 1e3},
                  {"points_ms", setup.points_s * 1e3}};
  json["image_hash"] = result.radiance_hash();
  json["build"] = build_json();
  return json;
}

}  // namespace penumbra
