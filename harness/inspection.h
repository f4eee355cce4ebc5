#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "harness/cost_split.h"
#include "harness/render.h"

/// What a scene has, what it does not need, and what leaving that out saves: measured against the
/// same scene with everything kept.
namespace penumbra {

/// What loading a scene cost.
struct LoadTimes {
  double read_s{0.0};         ///< file to description
  double build_s{0.0};        ///< description to scene
  double ray_scene_s{0.0};    ///< part of `build_s` in Embree's own build
  std::size_t peak_bytes{0};  ///< largest resident size of the process so far
};

/// A part of the program or the scene that not every scene needs.
struct InspectedPart {
  std::string name;
  bool present{false};
  std::string why;     ///< in one clause
  double bytes{0};     ///< that it takes, or would take
  double build_ms{0};  ///< that building it took, or would have taken
};

/// Components of mixtures at the points that can reflect light, means over those.
struct InspectedComponents {
  double lights{0};             ///< with a density over directions
  double lights_that_can{0};    ///< of them, that can contribute at a point
  double points_that_can{0};    ///< share of points where any of them can
  double points_in_mirrors{0};  ///< share of points without a component
  double points_with_occluder{
      0};  ///< share of points where something may hide a light: pmc_hi's cone
};

/// One estimator at a point, means.
struct InspectedWork {
  double samples{0}, rays{0}, lit{0};  ///< per estimate
  double time_ns{0};                   ///< CPU, median of repetitions, per estimate
  double scratch_bytes{0};             ///< of an estimator object

  /// Samples drawn for one that brings light.
  double samples_per_lit() const { return samples / lit; }
  double rays_per_lit() const { return rays / lit; }
};

struct InspectedEstimator {
  std::string name;
  int srl{0};
  InspectedWork lean, kept;
};

struct Inspection {
  std::unique_ptr<Scene> scene;
  ShadingPoints points;  ///< one per pixel of a small image
  LoadTimes load;
  std::vector<InspectedPart> parts;
  InspectedComponents components;
  int srl{0};  ///< of `estimators` and `costs`
  std::vector<InspectedEstimator> estimators;
  std::vector<NamedCost> costs;  ///< independent points
};

/// @param keep_all  inspect the scene with everything kept; nothing is compared then
Inspection inspect_scene(const std::string& scene, bool keep_all);

/// Where the time of one estimator goes in a scene.
/// @param settings  for one thread
NamedCost inspect_cost(const std::string& scene, const RenderSettings& settings);

/// For people and for machines.
std::string inspection_text(const Inspection& inspection);
nlohmann::ordered_json inspection_json(const Inspection& inspection);

}  // namespace penumbra
