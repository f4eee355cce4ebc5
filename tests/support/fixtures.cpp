#include "tests/support/fixtures.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>
#include <map>

#include "scenes/core/error.h"

namespace penumbra::fixtures {
namespace {

constexpr double kLightHeight = 2.0;
constexpr double kOccluderHeight = 1.0;
constexpr int kQuadratureCells = 1500;

// BRDF times cosine for a unit direction, straight from the specification.
double reflected(const Fixture& f, const Vec3d& wi) {
  const double cosine = std::max(0.0, f.mirror.dot(wi));
  const double lobe = f.specular > 0.0 ? f.specular * (f.exponent + 2.0) / (2.0 * M_PI) *
                                             std::pow(cosine, f.exponent)
                                       : 0.0;
  return (f.diffuse / M_PI + lobe) * wi.z;
}

bool is_hidden(const Fixture& f, const Vec3d& on_light) {
  const double t = kOccluderHeight / kLightHeight;
  for (const Box& box : f.occluders) {
    if (box.contains(on_light.x * t, on_light.y * t)) return true;
  }
  return false;
}

double radiance_from(const Fixture& f, const FixtureLight& light) {
  const double step_x = (light.box.x1 - light.box.x0) / kQuadratureCells;
  const double step_y = (light.box.y1 - light.box.y0) / kQuadratureCells;
  double sum = 0.0;
  for (int j = 0; j < kQuadratureCells; ++j) {
    double row = 0.0;
    for (int i = 0; i < kQuadratureCells; ++i) {
      const Vec3d p(light.box.x0 + (i + 0.5) * step_x, light.box.y0 + (j + 0.5) * step_y,
                    kLightHeight);
      if (is_hidden(f, p)) continue;
      const double r2 = p.length2();
      const Vec3d wi = p / std::sqrt(r2);
      row += reflected(f, wi) * wi.z / r2;  // the light faces -z: its cosine is wi.z
    }
    sum += row;
  }
  return light.radiance * sum * step_x * step_y;
}

Rgb grey(double value) { return Rgb(static_cast<float>(value)); }

// Facing down: edge_u x edge_v = -z.
ShapeDescription facing_down(std::string name, std::uint32_t material, const Box& box, double z,
                             double radiance) {
  return rectangle(std::move(name), material, {box.x0, box.y0, z}, {0.0, box.y1 - box.y0, 0.0},
                   {box.x1 - box.x0, 0.0, 0.0}, radiance);
}

// Variance of the mean of all estimates, [pixel][estimate], whose pixels depend on each other: from
// the means over all pixels of one estimate index.
double variance_of_tile_mean(const std::vector<Rgb>& radiance, std::size_t spp, double mean) {
  PN_CHECK(spp > 1, "one estimate of each pixel tells nothing of its spread");
  std::vector<double> means(spp, 0.0);
  const double pixels = static_cast<double>(radiance.size() / spp);
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    means[i % spp] += static_cast<double>(radiance[i].x) / pixels;
  }
  double squares = 0.0;
  for (const double m : means) squares += (m - mean) * (m - mean);
  return squares / static_cast<double>((spp - 1) * spp);
}

}  // namespace

const std::vector<Fixture>& all_fixtures() {
  const Vec3d up(0.0, 0.0, 1.0);
  const Vec3d to_large = Vec3d(0.0, 1.0, 1.0).normalized();
  const Vec3d to_nothing = Vec3d(1.0, -0.2, 0.8).normalized();
  static const std::vector<Fixture> table = {
      {'A', "open diffuse", 0.5, 0.0, 1.0, up, {}, 0.039850},
      {'B',
       "small light 10 % visible",
       0.5,
       0.0,
       1.0,
       up,
       {{-0.85, -0.67, -0.35, -0.15}},
       0.018539},
      {'C',
       "large light 20 % strip, small hidden",
       0.5,
       0.0,
       1.0,
       up,
       {{-0.4, 0.4, 0.75, 1.15}, {-0.9, -0.6, -0.4, -0.1}},
       0.002054},
      {'D', "glossy reflects large light", 0.05, 0.45, 200.0, to_large, {}, 0.298214},
      {'E', "glossy reflects nothing", 0.05, 0.45, 200.0, to_nothing, {}, 0.003985},
      {'F', "rough glossy reflects large light", 0.05, 0.45, 20.0, to_large, {}, 0.120316},
  };
  return table;
}

const Fixture& fixture(char id) {
  for (const Fixture& f : all_fixtures()) {
    if (f.id == id) return f;
  }
  PN_CHECK(false, "fixtures are A to F");
  return all_fixtures().front();
}

double exact_radiance(const Fixture& f) {
  static std::map<char, double> known;
  const auto found = known.find(f.id);
  if (found != known.end()) return found->second;
  double sum = 0.0;
  for (const FixtureLight& light : kFixtureLights) sum += radiance_from(f, light);
  return known[f.id] = sum;
}

PlacedPoint build(const Fixture& f) {
  SceneDescription scene;
  scene.name = std::string("fixture_") + f.id;
  scene.materials.push_back(lambert("black", 0.0));
  scene.materials.push_back({"receiver", PhongMaterial{grey(f.diffuse), grey(f.specular),
                                                       static_cast<float>(f.exponent)}});
  scene.shapes.push_back(
      facing_down("large", 0, kFixtureLights[0].box, kLightHeight, kFixtureLights[0].radiance));
  scene.shapes.push_back(
      facing_down("small", 0, kFixtureLights[1].box, kLightHeight, kFixtureLights[1].radiance));
  for (const Box& box : f.occluders) {
    scene.shapes.push_back(facing_down("occluder" + std::to_string(scene.shapes.size()), 0, box,
                                       kOccluderHeight, 0.0));
  }
  PlacedPoint placed{std::make_unique<Scene>(scene), {}};
  const Vec3d wo(-f.mirror.x, -f.mirror.y, f.mirror.z);
  placed.point = place(*placed.scene, Vec3d(0.0), Vec3d(0.0, 0.0, 1.0), wo, 1);
  return placed;
}

ShadingPoint place(const Scene& scene, const Vec3d& position, const Vec3d& normal, const Vec3d& wo,
                   std::uint32_t material) {
  ShadingPoint point;
  point.position = Vec3((position - scene.traits().center) * scene.traits().scale);
  point.geometric_normal = Vec3(normal);
  point.shading_normal = Vec3(normal);
  point.wo = Vec3(wo);
  point.material = material;
  return point;
}

ShapeDescription rectangle(std::string name, std::uint32_t material, const Vec3d& origin,
                           const Vec3d& edge_u, const Vec3d& edge_v, double radiance,
                           bool two_sided) {
  ShapeDescription shape;
  shape.name = std::move(name);
  shape.material = material;
  shape.shape = RectangleShape{origin, edge_u, edge_v};
  if (radiance > 0.0) shape.emission = EmissionDescription{grey(radiance), two_sided};
  return shape;
}

MaterialDescription lambert(std::string name, double reflectance) {
  return {std::move(name), LambertMaterial{grey(reflectance)}};
}

ParamSet params_with(const EstimatorEntry& entry, const ParamSet::Map& given) {
  std::vector<ParamProblem> problems;
  ParamSet result = resolve_params(entry.params(), given, problems);
  PN_CHECK(problems.empty(), "a test gives valid parameters");
  return result;
}

double RunStatistics::standard_error() const { return std::sqrt(variance_of_mean); }

double RunStatistics::cost(double exact) const {
  return mean_square_error / (exact * exact) * static_cast<double>(counters.samples) /
         static_cast<double>(counters.estimates);
}

RunStatistics estimate_many(const EstimatorEntry& entry, const ParamSet& params,
                            const Budget& budget, const PlacedPoint& placed, double exact,
                            std::uint64_t seed, std::uint64_t count) {
  constexpr int kSide = 16;
  constexpr std::uint64_t kPixels = std::uint64_t{kSide} * kSide;
  const std::vector<ShadingPoint> points(kPixels, placed.point);
  Tile tile;
  tile.width = kSide;
  tile.height = kSide;
  tile.image_width = kSide;
  tile.spp = static_cast<int>((count + kPixels - 1) / kPixels);
  tile.points = points;
  std::vector<Rgb> radiance(tile.estimate_count(), Rgb(std::numeric_limits<float>::quiet_NaN()));
  TileOutput out;
  out.radiance = radiance;
  entry.create(*placed.scene, params, budget)->estimate(tile, seed, out);

  RunStatistics run;
  run.counters = out.counters;
  double sum_of_squares = 0.0;
  for (const Rgb& value : radiance) {
    const auto x = static_cast<double>(value.x);
    if (!std::isfinite(x)) {
      ++run.non_finite;
      continue;
    }
    run.negative += x < 0.0 && !entry.may_be_negative ? 1u : 0u;
    ++run.n;
    const double step = x - run.mean;
    run.mean += step / static_cast<double>(run.n);
    sum_of_squares += step * (x - run.mean);
    run.mean_square_error += (x - exact) * (x - exact);
  }
  run.variance = sum_of_squares / static_cast<double>(run.n - 1);
  run.mean_square_error /= static_cast<double>(run.n);
  run.variance_of_mean =
      entry.correlates_pixels
          ? variance_of_tile_mean(radiance, static_cast<std::size_t>(tile.spp), run.mean)
          : run.variance / static_cast<double>(run.n);
  return run;
}

bool is_unbiased(const RunStatistics& run, double exact, double limit) {
  // Rounding of densities and radiance in float is common to all estimates: no number of them
  // averages it away. A dozen roundings of 2^-24 each.
  const double rounding = 12.0 * 0x1p-24 * std::abs(exact);
  return run.non_finite == 0 && run.negative == 0 && run.counters.uncovered == 0 &&
         std::abs(run.mean - exact) <= limit * run.standard_error() + rounding;
}

double family_limit(double family_level, int tests) {
  // 1 - (1 - level)^(1/tests), halved for the two sides.
  const double each = -std::expm1(std::log1p(-family_level) / tests);
  return boost::math::quantile(boost::math::complement(boost::math::normal(), 0.5 * each));
}

std::uint64_t seed_from(std::string_view text) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : text) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 1099511628211u;
  }
  return hash;
}

std::uint64_t test_seed(std::string_view label) {
  const ::testing::TestInfo* test = ::testing::UnitTest::GetInstance()->current_test_info();
  PN_CHECK(test != nullptr, "seeds are made inside a test");
  std::string text = std::string(test->test_suite_name()) + "." + test->name();
  text += "/";
  text += label;
  return seed_from(text);
}

}  // namespace penumbra::fixtures
