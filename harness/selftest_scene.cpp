#include "harness/selftest_scene.h"

#include <array>
#include <cmath>
#include <numbers>

#include "harness/scene_store.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr double kReflectance = 0.5;
constexpr double kRadiance = 4;

SceneDescription description(int side) {
  SceneDescription scene;
  scene.name = "selftest";
  scene.camera = {{0, 2, 3}, {0, 0, 0}, {0, 1, 0}, 30, {side, side}};
  scene.materials = {{"grey", LambertMaterial{Rgb(static_cast<float>(kReflectance))}},
                     {"black", LambertMaterial{Rgb(0.0f)}}};
  ShapeDescription floor{"floor", 0, RectangleShape{{-4, 0, 4}, {8, 0, 0}, {0, 0, -8}}, {}};
  // Beside what the camera sees, and so never seen itself.
  ShapeDescription light{"light", 1, RectangleShape{{-1.45, 0.35, -0.3}, {0.4, 0, 0}, {0, 0, 0.6}},
                         EmissionDescription{Rgb(static_cast<float>(kRadiance)), false}};
  scene.shapes = {floor, light};
  return scene;
}

/// Irradiance from a rectangle of radiance 1 that is wholly above the horizon.
/// Source: Lambert 1760, "Photometria": half the sum over edges of the angle that the edge spans
/// times the cosine between the normals of the surface and of the plane through point and edge.
double irradiance(const Light& light, const Vec3d& from, const Vec3d& normal) {
  const Vec3d origin(light.origin);
  const Vec3d u(light.edge_u);
  const Vec3d v(light.edge_v);
  const std::array<Vec3d, 4> corners{origin - from, origin + u - from, origin + u + v - from,
                                     origin + v - from};
  double sum = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3d& a = corners[i];
    const Vec3d& b = corners[(i + 1) % corners.size()];
    const Vec3d across = a.cross(b);
    const double length = across.length();
    if (length > 0) sum += std::atan2(length, a.dot(b)) * across.dot(normal) / length;
  }
  return 0.5 * std::abs(sum);
}

}  // namespace

AnalyticScene::AnalyticScene(int side)
    : scene_(description(side)), points_(make_shading_points(scene_, 1, kCameraSeed, side)) {
  PN_CHECK(points_.tiles.size() == 1, "one tile holds the image, so its points are row-major");
  const Light& light = scene_.lights()[0];
  for (const ShadingPoint& point : points_.points) {
    PN_CHECK(point.valid() && point.light == kNoLight, "every pixel shows the floor");
    const double reflected = kReflectance * std::numbers::inv_pi * kRadiance *
                             irradiance(light, Vec3d(point.position), Vec3d(point.shading_normal));
    exact_.emplace_back(reflected);
    exact_mean_ += reflected / static_cast<double>(points_.points.size());
  }
}

RenderResult AnalyticScene::render(std::string_view estimator, int spp, int srl, std::uint64_t seed,
                                   double energy) const {
  RenderSettings settings;
  settings.estimator = find_estimator(estimator);
  PN_CHECK(settings.estimator != nullptr, "the estimator is registered");
  std::vector<ParamProblem> problems;
  settings.params = resolve_params(settings.estimator->params(), {}, problems);
  settings.budget = {SamplerKind::Independent, srl, 0};
  settings.spp = spp;
  settings.seed = seed;
  settings.threads = 1;
  RenderResult result = penumbra::render(scene_, points_, settings);
  if (result.bad_count > 0) {
    throw RunError("selftest: \"" + std::string(estimator) + "\" made " +
                   std::to_string(result.bad_count) + " estimates not finite or negative");
  }
  if (energy != 1) {
    for (Vec3d& value : result.radiance) value *= energy;
  }
  return result;
}

double AnalyticScene::mean_square_error(const RenderResult& result) const {
  double sum = 0;
  for (std::size_t i = 0; i < exact_.size(); ++i) {
    const Vec3d error = result.radiance[i] - exact_[i];
    sum += error.dot(error);
  }
  return sum / (3.0 * static_cast<double>(exact_.size()));
}

double AnalyticScene::mean_error(const RenderResult& result) const {
  double sum = 0;
  for (std::size_t i = 0; i < exact_.size(); ++i) {
    const Vec3d error = result.radiance[i] - exact_[i];
    sum += error.x + error.y + error.z;
  }
  return sum / (3.0 * static_cast<double>(exact_.size()));
}

}  // namespace penumbra
