// Every unbiased registered estimator, with its default parameters, against direct light that has a
// closed form.
//
// False alarms: all comparisons of this file together raise one with probability 1e-4 (Sidak, 1000
// tests: k = 5.3). Closed forms are worked out here in double and share no code with the scenes or
// the estimators.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/fixtures.h"

namespace penumbra::fixtures {
namespace {

constexpr double kFamilyLevel = 1e-4;
constexpr int kFamilyTests = 1000;
constexpr std::uint64_t kEstimates = 50'000;
constexpr double kAlbedo = 0.7;

/// Irradiance from a convex one-sided polygon of radiance 1, corners counter-clockwise seen from
/// the point, all above the horizon. Source: Lambert 1760, Photometria; E = 1/2 sum_i angle_i
/// cos(normal, edge plane i).
double polygon_irradiance(const std::vector<Vec3d>& corners, const Vec3d& from,
                          const Vec3d& normal) {
  double sum = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3d a = (corners[i] - from).normalized();
    const Vec3d b = (corners[(i + 1) % corners.size()] - from).normalized();
    const Vec3d across = a.cross(b);
    sum += std::atan2(across.length(), a.dot(b)) * across.normalized().dot(normal);
  }
  return 0.5 * std::abs(sum);
}

std::vector<Vec3d> corners_of(const RectangleShape& r) {
  return {r.origin, r.origin + r.edge_u, r.origin + r.edge_u + r.edge_v, r.origin + r.edge_v};
}

SceneDescription with_materials() {
  SceneDescription scene;
  scene.materials = {lambert("grey", kAlbedo), lambert("black", 0.0)};
  return scene;
}

ShapeDescription light(std::string name, Shape shape, double radiance, bool two_sided = false) {
  ShapeDescription result;
  result.name = std::move(name);
  result.material = 1;
  result.shape = std::move(shape);
  result.emission = EmissionDescription{Rgb(static_cast<float>(radiance)), two_sided};
  return result;
}

PlacedPoint placed(const SceneDescription& description, const Vec3d& position,
                   const Vec3d& normal) {
  PlacedPoint result{std::make_unique<Scene>(description), {}};
  result.point = place(*result.scene, position, normal, normal, 0);
  return result;
}

const Vec3d kUp(0.0, 0.0, 1.0);

/// A point whose estimate is irradiance: E instead of albedo/pi x E.
PlacedPoint probe(const SceneDescription& description, const Vec3d& position, const Vec3d& normal) {
  PlacedPoint result = placed(description, position, normal);
  result.point.material = result.scene->irradiance_material();
  return result;
}

// Runs each estimator with every light sampling where it has that parameter.
void expect_radiance(const PlacedPoint& point, double exact, std::string_view label) {
  for (const EstimatorEntry* entry : all_estimators()) {
    std::vector<ParamSet::Map> variants = {{}};
    for (const ParamSpec& spec : entry->params()) {
      if (spec.name == "light_sampling") {
        variants.clear();
        for (const std::string& choice : spec.choices) variants.push_back({{spec.name, choice}});
      }
    }
    for (const ParamSet::Map& variant : variants) {
      const ParamSet params = params_with(*entry, variant);
      if (!entry->bias_reason(params).empty()) continue;
      const Budget budget = entry->adaptive ? Budget{SamplerKind::Independent, 4, 12}
                                            : Budget{SamplerKind::Independent, 16, 0};
      const RunStatistics run =
          estimate_many(*entry, params, budget, point, exact,
                        test_seed(std::string(label) + std::string(entry->name)), kEstimates);
      EXPECT_TRUE(is_unbiased(run, exact, family_limit(kFamilyLevel, kFamilyTests)))
          << label << ", " << entry->name << ' ' << params.differences(entry->params()) << ": mean "
          << run.mean << ", exact " << exact << ", z " << (run.mean - exact) / run.standard_error()
          << ", uncovered " << run.counters.uncovered << ", non-finite " << run.non_finite;
    }
  }
}

TEST(AnalyticFurnace, DiffusePlaneInALuminousSphereReflectsItsAlbedo) {
  constexpr double kRadiance = 2.0;
  SceneDescription scene = with_materials();
  scene.shapes = {light("sky", SphereShape{{0, 0, 0}, 3.0}, kRadiance, true)};
  const Vec3d tilted = Vec3d(0.3, -0.5, 0.8).normalized();
  expect_radiance(placed(scene, {0, 0, 0}, kUp), kAlbedo * kRadiance, "centre");
  expect_radiance(placed(scene, {1.1, -0.4, 0.7}, tilted), kAlbedo * kRadiance, "off centre");
}

TEST(AnalyticFurnace, OneSidedSphereIsDarkInside) {
  SceneDescription scene = with_materials();
  scene.shapes = {light("sky", SphereShape{{0, 0, 0}, 3.0}, 2.0, false)};
  const PlacedPoint point = placed(scene, {0, 0, 0}, kUp);
  for (const EstimatorEntry* entry : all_estimators()) {
    const RunStatistics run = estimate_many(*entry, params_with(*entry, {}),
                                            {SamplerKind::Independent, 4, 12}, point, 1.0, 1, 1000);
    EXPECT_EQ(run.mean, 0.0) << entry->name;
    EXPECT_EQ(run.variance, 0.0) << entry->name;
  }
}

TEST(AnalyticRectangle, ReflectionIsLambertsPolygonFormula) {
  struct Place {
    const char* label;
    Vec3d position, normal;
  };
  const RectangleShape r{{-0.4, -0.3, 1.5}, {0.3, 1.1, 0.1}, {1.1, -0.3, 0.0}};
  const Place places[] = {
      {"below", {0.2, 0.1, 0.0}, kUp},
      {"aside", {-2.5, 1.0, 0.2}, kUp},
      {"tilted", {0.5, -2.0, 0.0}, Vec3d(-0.2, 0.6, 0.5).normalized()},
      {"near", {0.2, 0.2, 1.45}, kUp},
  };
  SceneDescription scene = with_materials();
  scene.shapes = {light("panel", r, 3.0)};
  for (const Place& p : places) {
    const double exact =
        3.0 * kAlbedo / M_PI * polygon_irradiance(corners_of(r), p.position, p.normal);
    expect_radiance(placed(scene, p.position, p.normal), exact, p.label);
  }
}

TEST(AnalyticRectangle, TwoSidedLightsItsBackAndOneSidedDoesNot) {
  const RectangleShape r{
      {-0.5, -0.5, 1.0}, {1, 0, 0}, {0, 1, 0}};  // normal +z, away from the point
  const Vec3d position(0.1, 0.3, 0.0);
  const double exact = 2.0 * kAlbedo / M_PI * polygon_irradiance(corners_of(r), position, kUp);
  SceneDescription scene = with_materials();
  scene.shapes = {light("panel", r, 2.0, true)};
  expect_radiance(placed(scene, position, kUp), exact, "back");
  expect_radiance(placed(scene, {0.1, 0.3, 2.0}, -kUp), exact, "front");  // mirror image of `back`

  scene.shapes = {light("panel", r, 2.0, false)};
  expect_radiance(placed(scene, {0.1, 0.3, 2.0}, -kUp), exact, "front of one-sided");
  const PlacedPoint behind = placed(scene, position, kUp);
  for (const EstimatorEntry* entry : all_estimators()) {
    const RunStatistics run = estimate_many(
        *entry, params_with(*entry, {}), {SamplerKind::Independent, 4, 12}, behind, 1.0, 1, 1000);
    EXPECT_EQ(run.mean, 0.0) << entry->name;
    EXPECT_EQ(run.counters.rays, 0u) << entry->name;
  }
}

// A sphere wholly above the horizon: E = pi L sin^2(theta) cos(gamma), theta its angular radius,
// gamma the angle of its centre to the normal.
TEST(AnalyticSphere, ReflectionIsThatOfItsCone) {
  struct Place {
    const char* label;
    Vec3d center;
    double radius;
  };
  const Place places[] = {{"overhead", {0, 0, 2}, 0.5},
                          {"aside", {1.5, -1, 1.2}, 0.6},
                          {"near", {0.2, 0, 1.1}, 1.0},
                          {"far", {3, 4, 12}, 0.05}};
  for (const Place& p : places) {
    SceneDescription scene = with_materials();
    scene.shapes = {light("ball", SphereShape{p.center, p.radius}, 5.0)};
    const double d2 = p.center.length2();
    const double irradiance = M_PI * p.radius * p.radius / d2 * p.center.z / std::sqrt(d2);
    expect_radiance(placed(scene, Vec3d(0.0), kUp), 5.0 * kAlbedo / M_PI * irradiance, p.label);
  }
}

// The faces of an axis-aligned cube as rectangles with outward normals.
std::vector<RectangleShape> cube_faces(const Vec3d& low, double side) {
  const Vec3d x(side, 0, 0), y(0, side, 0), z(0, 0, side);
  return {{low, y, x}, {low + z, x, y}, {low, x, z}, {low + y, z, x}, {low, z, y}, {low + x, y, z}};
}

TEST(AnalyticMesh, LuminousCubeIsItsVisibleFacesAsAMeshAndAsRectangles) {
  const Vec3d low(0.3, -0.2, 0.8);
  const std::vector<RectangleShape> faces = cube_faces(low, 0.5);
  double irradiance = 0.0;
  QuadMeshShape mesh;
  SceneDescription as_rectangles = with_materials();
  for (const RectangleShape& face : faces) {
    const std::vector<Vec3d> corners = corners_of(face);
    const bool visible = face.edge_u.cross(face.edge_v).dot(-face.origin) > 0.0;
    if (visible) irradiance += polygon_irradiance(corners, Vec3d(0.0), kUp);
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), corners.begin(), corners.end());
    mesh.quads.push_back({first, first + 1, first + 2, first + 3});
    as_rectangles.shapes.push_back(light("face" + std::to_string(first), face, 2.0));
  }
  const double exact = 2.0 * kAlbedo / M_PI * irradiance;
  SceneDescription as_mesh = with_materials();
  as_mesh.shapes = {light("cube", mesh, 2.0)};
  expect_radiance(placed(as_mesh, Vec3d(0.0), kUp), exact, "mesh");
  expect_radiance(placed(as_rectangles, Vec3d(0.0), kUp), exact, "rectangles");
}

// A light in front of another: the small one hides part of the large one and adds its own light
// there. The exact value is the large polygon without its shadow region plus the small polygon; the
// region is the small rectangle's projection from the point onto the large light's plane.
TEST(AnalyticOverlap, LightInFrontOfALightHidesIt) {
  constexpr double kLarge = 1.0, kSmall = 4.0;
  const RectangleShape large{{-1, -1, 2}, {0, 2, 0}, {2, 0, 0}};
  const RectangleShape small{{-0.2, -0.1, 1}, {0, 0.4, 0}, {0.5, 0, 0}};
  const RectangleShape hidden{small.origin * 2.0, small.edge_u * 2.0, small.edge_v * 2.0};
  const auto irradiance = [](const RectangleShape& r) {
    return polygon_irradiance(corners_of(r), Vec3d(0.0), kUp);
  };
  const double exact =
      kAlbedo / M_PI *
      (kLarge * (irradiance(large) - irradiance(hidden)) + kSmall * irradiance(small));
  SceneDescription scene = with_materials();
  scene.shapes = {light("large", large, kLarge), light("small", small, kSmall)};
  expect_radiance(placed(scene, Vec3d(0.0), kUp), exact, "overlap");
}

// The small light turned away: it only hides.
TEST(AnalyticOverlap, DarkSideOfALightIsAnOccluder) {
  const RectangleShape large{{-1, -1, 2}, {0, 2, 0}, {2, 0, 0}};
  const RectangleShape away{{-0.2, -0.1, 1}, {0.5, 0, 0}, {0, 0.4, 0}};
  const RectangleShape hidden{away.origin * 2.0, away.edge_u * 2.0, away.edge_v * 2.0};
  const double exact = kAlbedo / M_PI *
                       (polygon_irradiance(corners_of(large), Vec3d(0.0), kUp) -
                        polygon_irradiance(corners_of(hidden), Vec3d(0.0), kUp));
  SceneDescription scene = with_materials();
  scene.shapes = {light("large", large, 1.0), light("away", away, 4.0)};
  expect_radiance(placed(scene, Vec3d(0.0), kUp), exact, "away");
}

// Scenes need a shape: one below the horizon of every point hides nothing.
SceneDescription below(SceneDescription scene) {
  scene.shapes.push_back(rectangle("base", 1, {-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, 0.0));
  return scene;
}

SceneDescription under_sky(double radiance) {
  SceneDescription scene = with_materials();
  scene.environment = EnvironmentDescription{"sky", 1, 1, {Rgb(static_cast<float>(radiance))}};
  return scene;
}

TEST(AnalyticEnvironment, DiffusePlaneUnderAConstantSkyReflectsItsAlbedo) {
  const SceneDescription scene = below(under_sky(1.5));
  expect_radiance(placed(scene, Vec3d(0.0), kUp), kAlbedo * 1.5, "plane");
}

// The upper half of the sphere alone, about +y, on grids whose border is the horizon: a plane
// tilted by gamma sees E = pi L (1 + cos gamma)/2.
TEST(AnalyticEnvironment, HemisphereLightsATiltedPlaneByItsShare) {
  constexpr double kRadiance = 2.0;
  for (const std::uint32_t columns : {1u, 6u}) {
    SceneDescription scene = with_materials();
    scene.shapes = {rectangle("base", 1, {-1, -50, -1}, {0, 0, 0.1}, {0.1, 0, 0}, 0.0)};
    const std::uint32_t rows = 2 * columns;
    scene.environment = EnvironmentDescription{"sky", columns, rows, {}};
    for (std::uint32_t i = 0; i < rows * columns; ++i) {
      scene.environment->texels.emplace_back(i < rows * columns / 2 ? float{kRadiance} : 0.0f);
    }
    for (const double gamma : {0.0, 0.7, 2.0}) {
      const Vec3d normal(std::sin(gamma) * 0.6, std::cos(gamma), std::sin(gamma) * 0.8);
      expect_radiance(placed(scene, Vec3d(0.0), normal),
                      kAlbedo * kRadiance * 0.5 * (1.0 + std::cos(gamma)),
                      "columns " + std::to_string(columns) + ", tilt " + std::to_string(gamma));
    }
  }
}

// What hides part of a constant sky takes away its own form factor: of a disc-like ball (R/D)^2
// cos, of a wall Lambert's polygon formula.
TEST(AnalyticEnvironment, BallAndWallHideTheirFormFactor) {
  constexpr double kRadiance = 1.25;
  const Vec3d center(0.5, -0.4, 1.2);
  SceneDescription ball = under_sky(kRadiance);
  ball.shapes.push_back({"ball", 1, SphereShape{center, 0.7}, std::nullopt});
  const double hidden = 0.7 * 0.7 / center.length2() * center.z / center.length();
  expect_radiance(placed(ball, Vec3d(0.0), kUp), kAlbedo * kRadiance * (1.0 - hidden), "ball");

  // A tall long wall, whose dark side faces the point, and the same wall without emission.
  const RectangleShape wall{{1, -30, 0.001}, {0, 60, 0}, {0, 0, 40}};
  const double form_factor = polygon_irradiance(corners_of(wall), Vec3d(0.0), kUp) / M_PI;
  EXPECT_NEAR(form_factor, 0.5, 0.02);  // nearly a half-plane, of which the horizon is one edge
  SceneDescription walled = under_sky(kRadiance);
  walled.shapes = {rectangle("wall", 1, wall.origin, wall.edge_u, wall.edge_v, 0.0)};
  expect_radiance(placed(walled, Vec3d(0.0), kUp), kAlbedo * kRadiance * (1.0 - form_factor),
                  "wall");
  walled.shapes = {light("wall", wall, 3.0)};
  expect_radiance(placed(walled, Vec3d(0.0), kUp), kAlbedo * kRadiance * (1.0 - form_factor),
                  "dark side");
}

// Light without extent is no matter of chance: every estimate is the same, to a few roundings.
TEST(AnalyticPointLight, ReflectionIsExactAndAnOccluderHidesIt) {
  const Vec3d position(0.3, -0.2, 0.1), normal = Vec3d(0.1, 0.2, 0.9).normalized();
  const Vec3d lamp(1.0, 0.5, 1.6), lantern(-0.5, 0.1, 0.8);
  const auto radiance = [&](const Vec3d& at, double intensity) {
    const Vec3d d = at - position;
    return kAlbedo / M_PI * intensity * d.dot(normal) / std::pow(d.length(), 3);
  };
  SceneDescription scene = below(with_materials());
  scene.point_lights = {{"lamp", lamp, Vec3d(2.0)},
                        {"lantern", lantern, Vec3d(0.5)},
                        {"under the horizon", {0, 0, -3}, Vec3d(9.0)}};
  SceneDescription shaded = scene;
  const Vec3d middle = (lamp + position) * 0.5;
  shaded.shapes.push_back(
      rectangle("screen", 1, middle - Vec3d(0.1, 0.1, 0), {0.2, 0, 0}, {0, 0.2, 0}, 0.0));
  SceneDescription behind = scene;  // a screen on the far side of the lamp hides nothing
  behind.shapes.push_back(
      rectangle("screen", 1, lamp + Vec3d(-0.1, -0.1, 0.1), {0.2, 0, 0}, {0, 0.2, 0}, 0.0));
  SceneDescription dark = shaded;
  dark.point_lights.resize(1);
  struct Case {
    const char* label;
    const SceneDescription* scene;
    double exact;
    std::uint64_t rays;  // per estimate
  };
  const double both = radiance(lamp, 2.0) + radiance(lantern, 0.5);
  const Case cases[] = {{"free", &scene, both, 2},
                        {"shaded", &shaded, radiance(lantern, 0.5), 2},
                        {"behind", &behind, both, 2},
                        {"dark", &dark, 0.0, 1}};
  for (const Case& c : cases) {
    const PlacedPoint point = placed(*c.scene, position, normal);
    for (const EstimatorEntry* entry : all_estimators()) {
      const ParamSet params = params_with(*entry, {});
      if (!entry->bias_reason(params).empty()) continue;
      const RunStatistics run = estimate_many(*entry, params, {SamplerKind::Independent, 4, 12},
                                              point, c.exact, test_seed(c.label), 512);
      EXPECT_NEAR(run.mean, c.exact, 2e-6 * c.exact) << c.label << ", " << entry->name;
      // All equal; their running mean has rounding of its own.
      EXPECT_LE(run.variance, 1e-28 * c.exact) << c.label << ", " << entry->name;
      EXPECT_EQ(run.counters.rays, c.rays * run.counters.estimates) << c.label << entry->name;
    }
  }
}

// Sky, panel that hides part of it, and point light: contributions add up.
TEST(AnalyticTogether, SkyPanelAndPointLightAddUp) {
  constexpr double kSky = 0.8, kPanel = 2.5, kIntensity = 1.2;
  const RectangleShape r{{-0.4, -0.3, 1.5}, {0.3, 1.1, 0.1}, {1.1, -0.3, 0.0}};
  const Vec3d lamp(-1.0, 0.6, 0.9);
  SceneDescription scene = under_sky(kSky);
  scene.shapes = {light("panel", r, kPanel)};
  scene.point_lights = {{"lamp", lamp, Vec3d(kIntensity)}};
  const double polygon = polygon_irradiance(corners_of(r), Vec3d(0.0), kUp);
  const double irradiance =
      kSky * (M_PI - polygon) + kPanel * polygon + kIntensity * lamp.z / std::pow(lamp.length(), 3);
  expect_radiance(placed(scene, Vec3d(0.0), kUp), kAlbedo / M_PI * irradiance, "together");
  expect_radiance(probe(scene, Vec3d(0.0), kUp), irradiance, "together, irradiance");
}

TEST(AnalyticIrradiance, RectangleSphereAndSky) {
  const RectangleShape r{{-0.4, -0.3, 1.5}, {0.3, 1.1, 0.1}, {1.1, -0.3, 0.0}};
  const Vec3d aside(-2.5, 1.0, 0.2);
  SceneDescription panel = with_materials();
  panel.shapes = {light("panel", r, 3.0)};
  expect_radiance(probe(panel, aside, kUp), 3.0 * polygon_irradiance(corners_of(r), aside, kUp),
                  "panel");

  const Vec3d center(1.5, -1, 1.2);
  SceneDescription ball = with_materials();
  ball.shapes = {light("ball", SphereShape{center, 0.6}, 5.0)};
  expect_radiance(probe(ball, Vec3d(0.0), kUp),
                  5.0 * M_PI * 0.36 / center.length2() * center.z / center.length(), "ball");

  expect_radiance(probe(below(under_sky(0.75)), Vec3d(0.0), kUp), 0.75 * M_PI, "sky");
}

}  // namespace
}  // namespace penumbra::fixtures
