#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "estimators/estimator.h"
#include "scenes/core/float_mode.h"
#include "scenes/core/scene.h"
#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"

/// A small scene with every kind of shape, and its image by any estimator.
namespace penumbra::test {

/// The scene of scenes_support with a glossy floor, in a unit and with radiance of choice.
inline SceneDescription estimator_scene(double radiance_scale, double unit = 1.0,
                                        const Vec3d& shift = Vec3d(0.0)) {
  SceneDescription scene = small_scene();
  scene.materials[1] = {"phong", PhongMaterial{Rgb(0.2f), Rgb(0.5f), 40.0f}};
  scene.shapes[0].material = 1;
  const auto point = [&](Vec3d& p) { p = p * unit + shift; };
  point(scene.camera.position);
  point(scene.camera.look_at);
  for (ShapeDescription& s : scene.shapes) {
    if (s.emission) s.emission->radiance *= static_cast<float>(radiance_scale);
    if (auto* rectangle = std::get_if<RectangleShape>(&s.shape)) {
      point(rectangle->origin);
      rectangle->edge_u *= unit;
      rectangle->edge_v *= unit;
    } else if (auto* ball = std::get_if<SphereShape>(&s.shape)) {
      point(ball->center);
      ball->radius *= unit;
    } else if (auto* mesh = std::get_if<TriangleMeshShape>(&s.shape)) {
      for (Vec3d& v : mesh->vertices) point(v);
    } else {
      for (Vec3d& v : std::get<QuadMeshShape>(s.shape).vertices) point(v);
    }
  }
  return scene;
}

struct EstimatorImage {
  std::vector<Rgb> radiance;  ///< [tile][pixel][estimate]
  std::vector<float> maps;
  EstimateCounters counters;
};

inline EstimatorImage image_of(const EstimatorEntry& entry, const Scene& scene,
                               Denormals denormals = Denormals::Kept) {
  constexpr int kSpp = 2;
  const Budget budget = entry.adaptive ? Budget{SamplerKind::Stratified, 4, 12}
                                       : Budget{SamplerKind::Stratified, 16, 0};
  const ShadingPoints points = make_shading_points(scene, 1, 7, 16);
  const auto estimator = entry.create(scene, fixtures::params_with(entry, {}), budget);
  EstimatorImage image;
  const DenormalMode mode(denormals);
  for (const TileRect& rect : points.tiles) {
    Tile tile{rect.x0, rect.y0, rect.width, rect.height, points.width, 1, kSpp, points.of(rect)};
    std::vector<Rgb> radiance(tile.estimate_count());
    std::vector<float> maps(tile.estimate_count() * estimator->maps().size());
    TileOutput out{radiance, maps, {}};
    estimator->estimate(tile, 3, out);
    image.radiance.insert(image.radiance.end(), radiance.begin(), radiance.end());
    image.maps.insert(image.maps.end(), maps.begin(), maps.end());
    image.counters += out.counters;
  }
  return image;
}

inline bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}

/// One test per registered estimator.
class EveryEstimator : public ::testing::TestWithParam<const EstimatorEntry*> {};

inline std::string estimator_name(const ::testing::TestParamInfo<const EstimatorEntry*>& info) {
  return std::string(info.param->name);
}

}  // namespace penumbra::test
