#pragma once

#include <nlohmann/json_fwd.hpp>

#include "harness/render.h"

/// A render and what it cost, for machines.
namespace penumbra {

/// What came before the estimation of one picture.
struct RenderSetup {
  double read_s{0};    ///< file to description
  double build_s{0};   ///< description to scene
  double points_s{0};  ///< primary hits
};

/// What was rendered, work and times of the estimation alone, hash of all bits of the picture, and
/// the build that made it. The keys that rows of measurements.csv have too are named as there.
nlohmann::ordered_json render_json(const Scene& scene, const ShadingPoints& points,
                                   const RenderSettings& settings, const RenderSetup& setup,
                                   const RenderResult& result);

}  // namespace penumbra
