// Textures and masks on the surfaces of a scene.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <memory>

#include "harness/render.h"
#include "scenes/core/error.h"
#include "scenes/core/scene.h"
#include "tests/support/fixtures.h"
#include "tests/support/image_files.h"
#include "tests/support/scenes_support.h"

namespace penumbra {
namespace {

using test::ImageFolder;

/// A floor y = 0 of 4 x 4 under a panel, seen from above at a slant; +x is to the right of the
/// picture, -z up.
SceneDescription floor_scene(MaterialDescription floor) {
  SceneDescription scene;
  scene.name = "floor";
  scene.camera = {{0.0, 5.0, 1.5}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 45.0, {32, 32}};
  scene.materials = {std::move(floor), test::lambert(0.0f, "black")};
  scene.shapes = {test::shape("floor", RectangleShape{{-2, 0, 2}, {4, 0, 0}, {0, 0, -4}}),
                  test::light("panel", RectangleShape{{-1.5, 3, 0.5}, {1, 0, 0}, {0, 0, 1}},
                              Rgb(5.0f, 4.0f, 3.0f))};
  scene.shapes[1].material = 1;
  return scene;
}

/// The first hit of a ray straight down.
RayHit hit_below(const Scene& scene, double x, double z, double from_y = 1.0) {
  const SceneTraits& t = scene.traits();
  RayBatch batch(1);
  batch.add(Vec3((Vec3d(x, from_y, z) - t.center) * t.scale), Vec3(0.0f, -1.0f, 0.0f));
  scene.intersect(batch);
  return batch.hits[0];
}

RenderResult render_with(const Scene& scene, const EstimatorEntry& entry,
                         Quantity quantity = Quantity::Radiance, int threads = 1) {
  RenderSettings settings;
  settings.estimator = &entry;
  settings.params = fixtures::params_with(entry, {});
  settings.budget = {SamplerKind::Independent, 8, entry.adaptive ? 8 : 0};
  settings.spp = 2;
  settings.seed = 11;
  settings.threads = threads;
  return render(scene, make_shading_points(scene, 2, 1, 16, quantity), settings);
}

bool same_bits(const RenderResult& a, const RenderResult& b) {
  return a.radiance_hash() == b.radiance_hash();
}

MaterialDescription with_reflectance(MaterialDescription material, TextureDescription texture) {
  material.reflectance_texture = std::move(texture);
  return material;
}

TEST(SceneTextures, ImagesAreUprightOnRectanglesAndNotMirrored) {
  const ImageFolder folder;
  // Rows from the top: red, green / blue, white.
  test::write_png(folder / "a.png", 2, 2, 3, {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255});
  const Scene scene(
      floor_scene(with_reflectance(test::lambert(1.0f), test::texture(folder / "a.png"))));
  const auto at = [&](double x, double z) {
    return scene.surface_values(hit_below(scene, x, z)).reflectance;
  };
  // Seen from above with -z up the upper left is (-x, -z); texel centres are at +-1.
  const double tolerance = 1e-5;
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(at(-1, -1)[c], Rgb(1, 0, 0)[c], tolerance);
    EXPECT_NEAR(at(1, -1)[c], Rgb(0, 1, 0)[c], tolerance);
    EXPECT_NEAR(at(-1, 1)[c], Rgb(0, 0, 1)[c], tolerance);
    EXPECT_NEAR(at(1, 1)[c], Rgb(1, 1, 1)[c], tolerance);
    EXPECT_NEAR(at(0, -1)[c], Rgb(0.5f, 0.5f, 0)[c], tolerance) << "half way between texels";
  }
}

TEST(SceneTextures, MeshesTakeTheCoordinatesOfTheirVertices) {
  const ImageFolder folder;
  test::write_png(folder / "a.png", 2, 1, 1, {0, 255});
  SceneDescription description =
      floor_scene(with_reflectance(test::lambert(1.0f), test::texture(folder / "a.png")));
  TriangleMeshShape mesh;
  mesh.vertices = {{-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  description.shapes[0].shape = mesh;
  const Scene scene(description);
  for (const Vec2& place : {Vec2(0.5f, -1.5f), Vec2(-1.5f, 0.25f), Vec2(1.0f, 1.5f)}) {
    const Vec2 uv = scene.surface_uv(hit_below(scene, double{place.x}, double{place.y}));
    EXPECT_NEAR(uv.x, (place.x + 2) / 4, 1e-5);
    EXPECT_NEAR(uv.y, (place.y + 2) / 4, 1e-5);
  }
  EXPECT_NEAR(scene.surface_values(hit_below(scene, -1, 0.3)).reflectance.x, 0.0f, 1e-5f);
  EXPECT_NEAR(scene.surface_values(hit_below(scene, 1, 0.3)).reflectance.x, 1.0f, 1e-5f);
}

/// Materials with every model that light can be sampled for, and the same with the values of
/// textures put in by hand.
struct Pair {
  MaterialDescription textured, constant;
};

std::vector<Pair> pairs(const ImageFolder& folder) {
  // Powers of two: products with them do not round.
  test::write_rgb_exr(folder / "color.exr", 3, 3, std::vector<Rgb>(9, Rgb(0.5f, 0.25f, 1.0f)));
  test::write_scalar_exr(folder / "rough.exr", 3, 3, std::vector<float>(9, 0.5f));
  const TextureDescription color = test::texture(folder / "color.exr");
  const TextureDescription rough = test::texture(folder / "rough.exr");
  const Rgb factor(0.5f, 0.25f, 1.0f);
  std::vector<Pair> result;
  result.push_back(
      {{"lambert", LambertMaterial{Rgb(0.8f)}}, {"l", LambertMaterial{factor * 0.8f}}});
  ConductorMaterial conductor;
  conductor.alpha = 0.5f;
  result.push_back({{"conductor", conductor}, {"c", conductor}});
  result.back().textured.roughness_texture = rough;
  std::get<ConductorMaterial>(result.back().constant.model).alpha = 0.125f;
  std::get<ConductorMaterial>(result.back().constant.model).tint = factor;
  result.push_back({{"phong", PhongMaterial{Rgb(0.4f), Rgb(0.3f), 20.0f}},
                    {"p", PhongMaterial{factor * 0.4f, Rgb(0.3f), 20.0f}}});
  MixtureMaterial mixture;
  mixture.glossy.alpha = 0.5f;
  result.push_back({{"mixture", mixture}, {"m", mixture}});
  result.back().textured.roughness_texture = rough;
  auto& constant = std::get<MixtureMaterial>(result.back().constant.model);
  constant.diffuse.reflectance *= factor;
  constant.glossy.alpha = 0.125f;
  result.push_back({{"coat", MetallicRoughnessMaterial{Rgb(0.8f), 0.5f, 0.5f}},
                    {"c", MetallicRoughnessMaterial{factor * 0.8f, 0.25f, 0.25f}}});
  result.back().textured.roughness_texture = rough;
  result.back().textured.metallic_texture = rough;
  for (Pair& pair : result) pair.textured.reflectance_texture = color;
  return result;
}

TEST(SceneTextures, AConstantTextureIsTheConstantMaterialForEveryEstimator) {
  const ImageFolder folder;
  for (const Pair& pair : pairs(folder)) {
    const Scene textured(floor_scene(pair.textured));
    const Scene constant(floor_scene(pair.constant));
    ASSERT_TRUE(textured.has_textures());
    ASSERT_FALSE(constant.has_textures());
    for (const EstimatorEntry* entry : all_estimators()) {
      EXPECT_TRUE(same_bits(render_with(textured, *entry), render_with(constant, *entry)))
          << pair.textured.name << ", " << entry->name;
    }
    MaterialDescription bare = pair.textured;
    bare.reflectance_texture = bare.roughness_texture = bare.metallic_texture = std::nullopt;
    const EstimatorEntry& mis = *find_estimator("mis");
    EXPECT_FALSE(same_bits(render_with(textured, mis), render_with(Scene(floor_scene(bare)), mis)))
        << "control: the texture matters";
  }
}

TEST(SceneTextures, ValuesOfOneChangeNoBitOfAMaterial) {
  const Vec3 wo = Vec3(0.3f, -0.2f, 0.8f).normalized();
  const Vec3 wi = Vec3(-0.4f, 0.1f, 0.7f).normalized();
  const ImageFolder folder;
  for (const Pair& pair : pairs(folder)) {
    const Bsdf bsdf(pair.constant);
    const BsdfValue plain = BoundBsdf(bsdf, wo).evaluate(wi);
    const BsdfValue with = BoundBsdf(bsdf.with(SurfaceValues{}), wo).evaluate(wi);
    EXPECT_EQ(plain.f_cos, with.f_cos);
    EXPECT_EQ(plain.pdf_w, with.pdf_w);
    EXPECT_EQ(bsdf.with(SurfaceValues{}).min_alpha(), bsdf.min_alpha());
  }
}

TEST(SceneTextures, AMirrorTakesItsReflectance) {
  SurfaceValues values;
  values.reflectance = Rgb(0.5f, 0.25f, 1.0f);
  EXPECT_EQ(Bsdf({"mirror", MirrorMaterial{Rgb(0.5f)}}).with(values).delta_reflectance(),
            Rgb(0.25f, 0.125f, 0.5f));
}

TEST(SceneTextures, RoughnessStopsAtTheSmallestWidth) {
  SurfaceValues smooth;
  smooth.roughness = 0.0f;
  EXPECT_EQ(Bsdf({"metal", ConductorMaterial{}}).with(smooth).min_alpha(), 1e-4f);
}

TEST(SceneTextures, ACheckerReflectsItsMean) {
  const ImageFolder folder;
  constexpr int kSide = 16;
  std::vector<std::uint16_t> values;
  for (int i = 0; i < kSide * kSide; ++i) {
    values.push_back((i % kSide + i / kSide) % 2 == 0 ? 255 : 51);
  }
  test::write_png(folder / "a.png", kSide, kSide, 1, values);
  SceneDescription description =
      floor_scene(with_reflectance(test::lambert(0.5f), test::texture(folder / "a.png")));
  // A furnace: the radiance that the sky sends is reflected by the albedo.
  description.shapes.pop_back();
  description.environment = EnvironmentDescription{"sky", 1, 1, {Rgb(1.0f)}};
  description.camera = {{0, 4, 0}, {0, 0, 0}, {0, 0, -1}, 40.0, {64, 64}};
  const Scene scene(description);
  const ShadingPoints points = make_shading_points(scene, 4, 1, 16);
  ASSERT_EQ(points.surfaces.size(), points.points.size());
  RenderSettings settings;
  settings.estimator = find_estimator("bsdf");
  settings.params = fixtures::params_with(*settings.estimator, {});
  settings.budget = {SamplerKind::Independent, 1, 0};
  settings.spp = 4;
  settings.seed = 3;
  const RenderResult result = render(scene, points, settings);
  double sum = 0.0;
  for (const Vec3d& pixel : result.radiance) sum += pixel.x;
  // Without noise by the lights: cosine sampling of a constant sky is exact at each point. The
  // mean over the pixels is that of the checker up to the part of a square that the picture cuts.
  const double mean = sum / static_cast<double>(result.radiance.size());
  EXPECT_NEAR(mean, 0.5 * (1.0 + 0.2) / 2.0, 0.5 * 0.4 * 0.03);
}

TEST(SceneTextures, PointsAndEstimatesAreTheSameOnAnyNumberOfThreads) {
  const ImageFolder folder;
  test::write_png(folder / "a.png", 4, 4, 1,
                  {9, 255, 0, 180, 45, 77, 128, 200, 250, 3, 90, 66, 10, 20, 230, 140});
  SceneDescription description =
      floor_scene(with_reflectance(test::lambert(0.9f), test::texture(folder / "a.png")));
  description.materials[0].mask = MaskDescription{test::texture(folder / "a.png"), 0.2f};
  const Scene scene(description);
  std::vector<ShadingPoints> points;
  for (const std::size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    points.push_back(make_shading_points(scene, 4, 1, 8));
  }
  ASSERT_EQ(points[0].points.size(), points[1].points.size());
  EXPECT_EQ(std::memcmp(points[0].points.data(), points[1].points.data(),
                        points[0].points.size() * sizeof(ShadingPoint)),
            0);
  EXPECT_EQ(std::memcmp(points[0].surfaces.data(), points[1].surfaces.data(),
                        points[0].surfaces.size() * sizeof(SurfaceValues)),
            0);
  const EstimatorEntry& mis = *find_estimator("mis");
  EXPECT_TRUE(same_bits(render_with(scene, mis, Quantity::Radiance, 1),
                        render_with(scene, mis, Quantity::Radiance, 4)));
}

TEST(SceneTextures, BlackPlacesReflectNothingAndAreNotEstimated) {
  const ImageFolder folder;
  test::write_png(folder / "a.png", 2, 1, 1, {0, 0});
  const Scene scene(
      floor_scene(with_reflectance(test::lambert(1.0f), test::texture(folder / "a.png"))));
  EXPECT_EQ(make_shading_points(scene, 1, 1, 16).valid_count, 0u);
  EXPECT_GT(make_shading_points(scene, 1, 1, 16, Quantity::Irradiance).valid_count, 0u);
}

TEST(SceneTextures, IrradianceKnowsNoTextures) {
  const ImageFolder folder;
  const Pair pair = pairs(folder)[0];
  const Scene textured(floor_scene(pair.textured));
  const Scene constant(floor_scene(pair.constant));
  EXPECT_TRUE(make_shading_points(textured, 1, 1, 16, Quantity::Irradiance).surfaces.empty());
  const EstimatorEntry& mis = *find_estimator("mis");
  EXPECT_TRUE(same_bits(render_with(textured, mis, Quantity::Irradiance),
                        render_with(constant, mis, Quantity::Irradiance)));
}

TEST(SceneTextures, ASceneWithoutImagesKeepsNothingForThem) {
  const Scene scene(floor_scene(test::lambert(0.5f)));
  EXPECT_FALSE(scene.has_textures());
  EXPECT_EQ(scene.parts().textures.count, 0u);
  EXPECT_EQ(scene.parts().masks.count, 0u);
  EXPECT_EQ(scene.parts().textures.bytes, 0u);
  EXPECT_TRUE(make_shading_points(scene, 1, 1, 16).surfaces.empty());
  EXPECT_EQ(scene.surface_uv(hit_below(scene, 1, 1)), Vec2(0.0f)) << "no coordinates are kept";
}

TEST(SceneTextures, AMaterialThatNoShapeUsesIsNotOpened) {
  SceneDescription description = floor_scene(test::lambert(0.5f));
  description.materials.push_back(test::lambert(0.5f, "spare"));
  description.materials.back().reflectance_texture = TextureDescription{"/missing.png", "0"};
  EXPECT_EQ(Scene(description).parts().textures.count, 0u);
}

/// The message with which a scene is refused.
std::string fault_of(const SceneDescription& description) {
  try {
    const Scene scene(description);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(SceneTextures, RefusesWhatDoesNotFitTogether) {
  const ImageFolder folder;
  test::write_png(folder / "a.png", 1, 1, 1, {255});
  const TextureDescription image = test::texture(folder / "a.png");
  SceneDescription description = floor_scene(with_reflectance(test::lambert(0.5f), image));
  ASSERT_EQ(fault_of(description), "");
  SceneDescription ball = description;
  ball.shapes[0].shape = SphereShape{{0, 0, 0}, 1.0};
  EXPECT_NE(fault_of(ball).find("material \"grey\" has images, but shape \"floor\" has no texture"),
            std::string::npos)
      << fault_of(ball);
  SceneDescription emitter = description;
  emitter.materials[1].mask = MaskDescription{image, 0.5f};
  EXPECT_NE(fault_of(emitter).find("\"panel\" emits light"), std::string::npos)
      << fault_of(emitter);
  SceneDescription rough = description;
  rough.materials[0].roughness_texture = image;
  EXPECT_NE(fault_of(rough).find("no roughness"), std::string::npos) << fault_of(rough);
  SceneDescription missing = description;
  missing.materials[0].reflectance_texture->file = (folder / "b.png").string();
  EXPECT_NE(fault_of(missing).find("b.png: the image does not exist"), std::string::npos)
      << fault_of(missing);
}

}  // namespace
}  // namespace penumbra
