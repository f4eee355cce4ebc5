#include "scenes/core/scene.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "scenes/core/error.h"
#include "scenes/core/normalise.h"
#include "tests/core/trace.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using test::to_scene;
using test::trace;

TEST(Scene, ShadingPointsLieOnTheRayAndFaceTheViewer) {
  test::TestRandom random;
  const Scene scene(test::small_scene());
  int points = 0;
  int backs = 0;
  for (int i = 0; i < 30000; ++i) {
    const Vec3 origin = random.direction() * 1.5f;
    const Vec3d target(random.uniform(-1.0, 1.0), random.uniform(-0.4, 0.4),
                       random.uniform(-1.0, 1.0));
    const Vec3 direction = (Vec3(target) - origin).normalized();
    const RayHit hit = trace(scene, origin, direction);
    if (!hit.hit()) continue;
    const ShadingPoint p = scene.shading_point(hit, origin, direction);
    const Vec3 on_ray = origin + direction * hit.distance;
    const float slope = -dot(p.geometric_normal, direction);
    ASSERT_GE(slope, 0.0f);
    ASSERT_LT((p.position - on_ray).length(), 2e-4f + 4e-6f / slope) << "u+v=" << hit.u + hit.v;
    ASSERT_NEAR(p.geometric_normal.length(), 1.0f, 1e-6f);
    ASSERT_GT(std::abs(dot(p.geometric_normal, hit.normal.normalized())), 0.9999f);
    ASSERT_EQ(p.shading_normal, p.geometric_normal);
    ASSERT_EQ(p.wo, -direction);
    // The offset goes to the side of the viewer.
    ASSERT_GT(dot(p.position - on_ray, p.geometric_normal), -4e-6f);
    backs += dot(hit.normal, direction) > 0.0f ? 1 : 0;
    ++points;
  }
  EXPECT_GT(points, 10000);
  EXPECT_GT(backs, 500);
}

TEST(Scene, SecondHalfOfAQuadrilateralHasItsOwnPlane) {
  SceneDescription description;
  description.materials = {test::lambert(0.5f)};
  QuadMeshShape quads;
  quads.vertices = {{-1, 0, 1}, {1, 0, 1}, {1, 0.5, -1}, {-1, 0, -1}};
  quads.quads = {{0, 1, 2, 3}};
  description.shapes = {test::shape("bent", quads)};
  const Scene scene(description);
  test::TestRandom random;
  int halves[2] = {0, 0};
  for (int i = 0; i < 5000; ++i) {
    const Vec3d target(random.uniform(-0.99, 0.99), 0.0, random.uniform(-0.99, 0.99));
    if (std::abs(target.x - target.z) < 1e-3) continue;  // the diagonal 1-3 is x = z
    const Vec3 down(0, -1, 0);
    const Vec3 above = to_scene(scene, target + Vec3d(0, 2, 0));
    const RayHit hit = trace(scene, above, down);
    ASSERT_TRUE(hit.hit());
    const ShadingPoint p = scene.shading_point(hit, above, down);
    const bool second = target.x > target.z;
    ++halves[second ? 1 : 0];
    // First half: the plane y = 0. Second half: y = (x - z)/4 through (1, 0, 1), (1, 1/2, -1), (-1,
    // 0, -1).
    const double height = second ? (target.x - target.z) / 4.0 : 0.0;
    const Vec3d normal = second ? Vec3d(-1, 4, 1).normalized() : Vec3d(0, 1, 0);
    const Vec3 expected = to_scene(scene, {target.x, height, target.z});
    ASSERT_LT((p.position - expected).length(), 1e-4f) << target;
    ASSERT_LT((p.geometric_normal - Vec3(normal)).length(), 1e-5f) << target;
  }
  EXPECT_GT(halves[0], 1000);
  EXPECT_GT(halves[1], 1000);
}

void transform(SceneDescription& scene, double factor, const Vec3d& shift) {
  const auto point = [&](Vec3d& p) { p = p * factor + shift; };
  point(scene.camera.position);
  point(scene.camera.look_at);
  for (ShapeDescription& s : scene.shapes) {
    if (auto* r = std::get_if<RectangleShape>(&s.shape)) {
      point(r->origin);
      r->edge_u *= factor;
      r->edge_v *= factor;
    } else if (auto* b = std::get_if<SphereShape>(&s.shape)) {
      point(b->center);
      b->radius *= factor;
    } else if (auto* m = std::get_if<TriangleMeshShape>(&s.shape)) {
      for (Vec3d& v : m->vertices) point(v);
    } else {
      for (Vec3d& v : std::get<QuadMeshShape>(s.shape).vertices) point(v);
    }
  }
}

bool same(const ShadingPoint& a, const ShadingPoint& b) {
  return a.position == b.position && a.geometric_normal == b.geometric_normal &&
         a.shading_normal == b.shading_normal && a.wo == b.wo && a.material == b.material &&
         a.light == b.light;
}

::testing::AssertionResult same(const ShadingPoints& a, const ShadingPoints& b) {
  if (a.points.size() != b.points.size() || a.valid_count != b.valid_count) {
    return ::testing::AssertionFailure() << "sizes differ";
  }
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    if (!same(a.points[i], b.points[i])) {
      return ::testing::AssertionFailure()
             << "point " << i << ": " << a.points[i].position << " and " << b.points[i].position;
    }
  }
  return ::testing::AssertionSuccess();
}

TEST(Normalisation, PowersOfTwoAndTranslationsGiveTheSameBits) {
  const SceneDescription original = test::small_scene();
  const Scene scene(original);
  const ShadingPoints points = make_shading_points(scene, 4, 1, 16);
  EXPECT_GT(points.valid_count, points.points.size() / 2);
  for (const int k : {-17, -3, 1, 20}) {
    for (const Vec3d& shift : {Vec3d(0, 0, 0), Vec3d(1024, -512, 1 << 20)}) {
      SceneDescription changed = original;
      transform(changed, std::ldexp(1.0, k), shift * std::ldexp(1.0, std::max(k, -3)));
      const Scene other(changed);
      EXPECT_TRUE(same(points, make_shading_points(other, 4, 1, 16)))
          << "2^" << k << " shift " << shift;
      EXPECT_EQ(other.traits().scale * std::ldexp(1.0, k), scene.traits().scale);
      EXPECT_EQ(other.traits().diagonal, scene.traits().diagonal);
      ASSERT_EQ(other.lights().size(), scene.lights().size());
      for (std::size_t i = 0; i < scene.lights().size(); ++i) {
        EXPECT_EQ(other.lights()[i].radiance, scene.lights()[i].radiance);
        EXPECT_EQ(other.lights()[i].area, scene.lights()[i].area);
      }
    }
  }
}

TEST(Normalisation, AnyUnitGivesADiagonalOfOrderOneByAPowerOfTwo) {
  for (const double factor : {1e-5, 0.3, 1.0, 7.0, 1e6}) {
    SceneDescription scene = test::small_scene();
    transform(scene, factor, Vec3d(3.0, -2e3 * factor, 0.0));
    const Normalisation n = normalise(scene);
    int exponent = 0;
    EXPECT_EQ(std::frexp(n.scale, &exponent), 0.5) << factor;
    EXPECT_GT(n.diagonal, 2.8) << factor;
    EXPECT_LT(n.diagonal, 5.7) << factor;
  }
}

TEST(ContentHash, ChangesWithEverythingThatDecidesTheImage) {
  using Change = std::function<void(SceneDescription&)>;
  const auto material = [](auto model) {
    return Change([model](SceneDescription& s) { s.materials[1].model = model; });
  };
  const std::vector<Change> changes = {
      [](auto& s) { s.camera.position.x += 1e-9; },
      [](auto& s) { s.camera.look_at.y += 1e-9; },
      [](auto& s) { s.camera.up.z += 1e-9; },
      [](auto& s) { s.camera.vertical_fov_deg += 1e-9; },
      [](auto& s) { s.camera.resolution[0] += 1; },
      [](auto& s) { s.camera.resolution[1] += 1; },
      [](auto& s) { std::get<LambertMaterial>(s.materials[0].model).reflectance.y = 0.50001f; },
      material(LambertMaterial{Rgb(0.2f)}),
      material(ConductorMaterial{Rgb(0.3f), Rgb(3.9f), 0.1f, Rgb(1.0f)}),
      material(ConductorMaterial{Rgb(0.2f), Rgb(3.8f), 0.1f, Rgb(1.0f)}),
      material(ConductorMaterial{Rgb(0.2f), Rgb(3.9f), 0.2f, Rgb(1.0f)}),
      material(ConductorMaterial{Rgb(0.2f), Rgb(3.9f), 0.1f, Rgb(0.9f)}),
      material(PhongMaterial{}),
      material(PhongMaterial{Rgb(0.5f), Rgb(0.1f), 20.0f}),
      material(PhongMaterial{Rgb(0.5f), Rgb(0.0f), 21.0f}),
      material(MixtureMaterial{}),
      material(MixtureMaterial{{}, {}, 0.25f}),
      material(MixtureMaterial{{Rgb(0.1f)}, {}, 0.5f}),
      [](auto& s) { s.shapes[0].material = 1; },
      [](auto& s) { std::get<RectangleShape>(s.shapes[0].shape).origin.x += 1e-9; },
      [](auto& s) { std::get<RectangleShape>(s.shapes[0].shape).edge_u.x += 1e-9; },
      [](auto& s) { std::get<RectangleShape>(s.shapes[0].shape).edge_v.z += 1e-9; },
      [](auto& s) { std::get<TriangleMeshShape>(s.shapes[2].shape).vertices[3].y += 1e-9; },
      [](auto& s) {
        std::swap(std::get<TriangleMeshShape>(s.shapes[2].shape).triangles[0][1],
                  std::get<TriangleMeshShape>(s.shapes[2].shape).triangles[0][2]);
      },
      [](auto& s) { std::get<SphereShape>(s.shapes[3].shape).center.z += 1e-9; },
      [](auto& s) { std::get<SphereShape>(s.shapes[3].shape).radius += 1e-9; },
      [](auto& s) { std::get<QuadMeshShape>(s.shapes[4].shape).vertices[2].z += 1e-9; },
      [](auto& s) {
        std::get<QuadMeshShape>(s.shapes[4].shape).quads[0] = {1, 2, 3, 0};
      },
      [](auto& s) { s.shapes[1].emission->radiance.z = 2.0001f; },
      [](auto& s) { s.shapes[1].emission->two_sided = true; },
      [](auto& s) { s.shapes[1].emission.reset(); },
      [](auto& s) { s.shapes[0].emission = EmissionDescription{}; },
      [](auto& s) { s.shapes.pop_back(); },
      [](auto& s) { s.shapes.push_back(s.shapes[0]); },
      [](auto& s) { std::swap(s.shapes[0], s.shapes[4]); }};
  std::set<std::string> hashes = {content_hash(test::small_scene())};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    SceneDescription scene = test::small_scene();
    changes[i](scene);
    EXPECT_TRUE(hashes.insert(content_hash(scene)).second) << "change " << i;
  }
}

TEST(ContentHash, DoesNotChangeWithNamesAndIsThatOfTheScene) {
  SceneDescription scene = test::small_scene();
  const std::string hash = content_hash(scene);
  EXPECT_EQ(hash.size(), 32u);
  EXPECT_EQ(hash.find_first_not_of("0123456789abcdef"), std::string::npos);
  scene.name = "other";
  scene.summary = "text";
  scene.warnings = {"text"};
  scene.materials[0].name = "white";
  scene.shapes[1].name = "lamp";
  EXPECT_EQ(content_hash(scene), hash);
  EXPECT_EQ(Scene(scene).content_hash(), hash);
}

TEST(Camera, CentreRayGoesThroughLookAtAndTheImageStandsUpright) {
  SceneDescription description = test::small_scene();
  description.camera.resolution = {64, 48};
  description.camera.vertical_fov_deg = 50.0;
  const Scene scene(description);
  const Camera& camera = scene.camera();
  const auto w = static_cast<float>(camera.width());
  const auto h = static_cast<float>(camera.height());
  const Vec3d ahead = (description.camera.look_at - description.camera.position).normalized();
  EXPECT_LT((camera.direction(w / 2, h / 2) - Vec3(ahead)).length(), 2e-7f);
  const Vec3d right = ahead.cross(description.camera.up).normalized();
  EXPECT_GT(Vec3d(camera.direction(w, h / 2)).dot(right), 0.0);
  EXPECT_GT(Vec3d(camera.direction(w / 2, 0)).dot(right.cross(ahead)), 0.0) << "y goes downwards";
  const float cosine = dot(camera.direction(w / 2, 0), camera.direction(w / 2, h));
  EXPECT_NEAR(std::acos(double{cosine}) * 180.0 / M_PI, 50.0, 1e-4);
  // Square pixels: half the width over half the height in tangents is the aspect ratio.
  const auto tangent = [&](float x, float y) {
    const double c = Vec3d(camera.direction(x, y)).dot(ahead);
    return std::sqrt(1.0 - c * c) / c;
  };
  EXPECT_NEAR(tangent(w, h / 2) / tangent(w / 2, h), 64.0 / 48.0, 1e-5);
}

TEST(ShadingPoints, OneSampleIsThePixelsCentre) {
  const Scene scene(test::small_scene());
  const ShadingPoints points = make_shading_points(scene, 1, 99, 7);
  std::size_t valid = 0;
  std::set<int> seen;
  for (const TileRect& tile : points.tiles) {
    const auto span = points.of(tile);
    for (std::size_t i = 0; i < span.size(); ++i) {
      const int x = tile.x0 + static_cast<int>(i) % tile.width;
      const int y = tile.y0 + static_cast<int>(i) / tile.width;
      EXPECT_TRUE(seen.insert(y * points.width + x).second);
      EXPECT_EQ(span[i].wo, -scene.camera().direction(static_cast<float>(x) + 0.5f,
                                                      static_cast<float>(y) + 0.5f));
      valid += span[i].valid() ? 1 : 0;
    }
  }
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(points.width * points.height));
  EXPECT_EQ(valid, points.valid_count);
}

TEST(ShadingPoints, AreTheSameOnAnyNumberOfThreads) {
  const Scene scene(test::small_scene());
  std::optional<ShadingPoints> first;
  for (const std::size_t threads : {1u, 2u, 5u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    ShadingPoints points = make_shading_points(scene, 3, 42, 8);
    if (first) {
      EXPECT_TRUE(same(*first, points)) << threads << " threads";
    } else {
      first = std::move(points);
    }
  }
  EXPECT_FALSE(same(*first, make_shading_points(scene, 3, 43, 8))) << "another seed";
}

TEST(ShadingPoints, DoNotDependOnTheTilesSide) {
  const Scene scene(test::small_scene());
  constexpr std::size_t kSamples = 3;
  const auto by_pixel = [&](int tile_side) {
    const ShadingPoints points = make_shading_points(scene, kSamples, 7, tile_side);
    std::vector<ShadingPoint> image(points.points.size());
    for (const TileRect& tile : points.tiles) {
      const auto span = points.of(tile);
      for (std::size_t i = 0; i < span.size(); ++i) {
        const std::size_t x =
            static_cast<std::size_t>(tile.x0) + i / kSamples % static_cast<std::size_t>(tile.width);
        const std::size_t y =
            static_cast<std::size_t>(tile.y0) + i / kSamples / static_cast<std::size_t>(tile.width);
        image[(y * static_cast<std::size_t>(points.width) + x) * kSamples + i % kSamples] = span[i];
      }
    }
    return image;
  };
  const auto small = by_pixel(5);
  const auto large = by_pixel(64);
  ASSERT_EQ(small.size(), large.size());
  for (std::size_t i = 0; i < small.size(); ++i) {
    ASSERT_TRUE(same(small[i], large[i])) << i << " " << small[i].position << large[i].position;
  }
}

TEST(Scene, TraitsCountWhatTheSceneHas) {
  const Scene scene(test::small_scene());
  const SceneTraits& t = scene.traits();
  EXPECT_EQ(t.triangles, 2u + 2u + 12u + 2u);
  EXPECT_EQ(t.spheres, 1u);
  EXPECT_EQ(t.materials, 2u);
  EXPECT_EQ(t.rectangle_lights, 1u);
  EXPECT_EQ(t.sphere_lights, 1u);
  EXPECT_EQ(t.mesh_lights, 1u);
  EXPECT_FALSE(t.all_diffuse);
  EXPECT_EQ(t.min_alpha, 0.1f);
  EXPECT_GT(t.ray_scene_bytes, 0u);
  const double s = t.scale;
  EXPECT_NEAR(scene.lights()[0].area, 1.0 * s * s, 1e-12);
  EXPECT_NEAR(scene.lights()[1].area, 6.0 * 0.25 * s * s, 1e-6);
  EXPECT_NEAR(scene.lights()[2].area, 4.0 * M_PI * 0.0625 * s * s, 1e-12);
}

TEST(Scene, RefusesAnEmptyDescription) {
  SceneDescription scene = test::small_scene();
  scene.shapes.clear();
  EXPECT_THROW(Scene{scene}, InputError);
}

}  // namespace
}  // namespace penumbra
