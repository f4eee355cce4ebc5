#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "estimators/params.h"
#include "scenes/core/scene.h"
#include "scenes/core/shading_point.h"

/// The cases of `penumbra stability`: small scenes and shading points with a known answer, swept
/// along one parameter from harmless to extreme.
namespace penumbra::stability {

/// Side of the tile that a step's points fill [pixels].
inline constexpr int kTileSide = 8;
inline constexpr std::size_t kTilePoints = std::size_t{kTileSide} * kTileSide;

/// One step of a sweep, ready to be estimated.
struct StabilityStep {
  double value{0};  ///< of the parameter
  std::unique_ptr<Scene> scene;
  std::vector<ShadingPoint> points;  ///< kTilePoints of them, often all the same
  std::vector<double> exact;         ///< [point] reflected radiance, the same in all channels
  /// How much a relative error of coordinates or directions is magnified in the answer: distance
  /// over size of a tiny light. Geometry and directions have 24 bits, so that the answer itself is
  /// known to this many times 2^-24 only (`tolerance_of`, verdict.h).
  double condition{1};
  ParamSet::Map params;  ///< the swept parameter of estimators, where it is one of theirs

  /// Whether no light arrives, so that every estimate has to be 0.
  bool is_dark() const;
};

struct StabilityCase {
  std::string_view name;
  std::string_view ids;        ///< rows of the specification that it stands for, such as "L1 L2"
  std::string_view summary;    ///< one clause
  std::string_view parameter;  ///< what is swept, with its unit
  std::string_view answer;     ///< where the exact value comes from
  std::vector<double> values;  ///< from harmless to extreme
  StabilityStep (*build)(double value){nullptr};
  /// Parameter of estimators that the sweep sets; empty: it changes the scene. Estimators without
  /// it are left out of the case.
  std::string_view swept_param{};
  int srl{16};  ///< shadow rays per light
};

/// All cases, in the order of tables and pictures.
std::span<const StabilityCase> stability_cases();

std::vector<std::string> stability_case_names();

/// `count` values from `from` to `to` at equal ratios, both ends exact.
std::vector<double> log_steps(double from, double to, int count);

/// The same, with one more value behind the last: the limit itself.
std::vector<double> log_steps_then(double from, double to, int count, double limit);

// Of cases_*.cpp.
std::vector<StabilityCase> light_cases();
std::vector<StabilityCase> distribution_cases();
std::vector<StabilityCase> surface_cases();
std::vector<StabilityCase> geometry_cases();
std::vector<StabilityCase> visibility_cases();

}  // namespace penumbra::stability
