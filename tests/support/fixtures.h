#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "estimators/estimator.h"
#include "scenes/core/scene.h"
#include "scenes/core/scene_description.h"

/// Six shading points with known radiance, and runs of many estimates at one point, for the tests
/// of the estimators. Two lights in the plane z = 2 face down, black rectangles in the plane z = 1
/// hide parts of them, and the point is the origin with normal +z. Nothing is below z = 1, so no
/// ray can meet the point's own surface. Source: docs/algorithms.md, section 7.
namespace penumbra::fixtures {

/// Axis-aligned rectangle in a plane of constant z.
struct Box {
  double x0{0}, x1{0}, y0{0}, y1{0};

  bool contains(double x, double y) const { return x > x0 && x < x1 && y > y0 && y < y1; }
};

struct FixtureLight {
  Box box;
  double radiance{0};
};

inline constexpr std::array<FixtureLight, 2> kFixtureLights{{
    {{-0.8, 0.8, 1.5, 2.5}, 1.0},
    {{-1.7, -1.3, -0.7, -0.3}, 10.0},
}};

struct Fixture {
  char id;
  std::string_view summary;
  double diffuse, specular, exponent;  ///< kd, ks, s
  Vec3d mirror;                        ///< unit direction that the lobe reflects to
  std::vector<Box> occluders;
  double printed;  ///< radiance as the specification prints it, six decimals
};

const std::vector<Fixture>& all_fixtures();
/// @param id  'A' to 'F'
const Fixture& fixture(char id);

/// Radiance by the midpoint rule on 1500 x 1500 cells per light, in double, with closed-form
/// visibility: it shares no code with the estimators. The shadows' edges lie on cell borders.
/// Computed once per fixture.
double exact_radiance(const Fixture& fixture);

/// A scene with one shading point. Scenes are not movable, hence the pointer.
struct PlacedPoint {
  std::unique_ptr<Scene> scene;
  ShadingPoint point;
};

PlacedPoint build(const Fixture& fixture);

/// A point of a scene given in world coordinates; the scene recentres and rescales them.
/// @param normal, wo  unit
ShadingPoint place(const Scene& scene, const Vec3d& position, const Vec3d& normal, const Vec3d& wo,
                   std::uint32_t material);

/// Parallelogram, emitting when `radiance` is positive.
ShapeDescription rectangle(std::string name, std::uint32_t material, const Vec3d& origin,
                           const Vec3d& edge_u, const Vec3d& edge_v, double radiance,
                           bool two_sided = false);
MaterialDescription lambert(std::string name, double reflectance);

/// Parameters of an estimator with some set; stops the program when one is refused.
ParamSet params_with(const EstimatorEntry& entry, const ParamSet::Map& given);

/// Estimates of one point. Moments by Welford; `square_error` is about the exact value.
struct RunStatistics {
  std::uint64_t n{0};
  double mean{0}, variance{0};
  double variance_of_mean{0};  ///< from means over the pixels where these are correlated
  double mean_square_error{0};
  std::uint64_t non_finite{0};
  std::uint64_t negative{0};  ///< of an estimator that may not be
  EstimateCounters counters;

  double standard_error() const;
  double bias(double exact) const { return mean / exact - 1.0; }
  /// Relative mean square error times samples per estimate: the unit of the specification's table.
  double cost(double exact) const;
};

/// Makes `count` independent estimates of one point through the public interface: 256 pixels see
/// the same point, each with as many estimates as needed.
/// @param exact  about which errors are squared
RunStatistics estimate_many(const EstimatorEntry& entry, const ParamSet& params,
                            const Budget& budget, const PlacedPoint& placed, double exact,
                            std::uint64_t seed, std::uint64_t count);

/// The unbiasedness test of all positive and negative cases: all estimates finite and not negative,
/// nothing uncovered, mean within `limit` standard errors of the exact value (and float rounding,
/// for estimators without variance).
bool is_unbiased(const RunStatistics& run, double exact, double limit);

/// Two-sided normal quantile at which `tests` independent tests raise a false alarm with
/// probability `family_level` in all (Sidak).
double family_limit(double family_level, int tests);

/// Seed from a text, e.g. a test's full name (FNV-1a, 64 bits).
std::uint64_t seed_from(std::string_view text);
/// Seed from the running test's name and a label.
std::uint64_t test_seed(std::string_view label);

}  // namespace penumbra::fixtures
