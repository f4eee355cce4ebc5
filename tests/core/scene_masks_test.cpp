// Holes in surfaces, for rays from the camera and shadow rays.

#include <gtest/gtest.h>

#include "harness/render.h"
#include "scenes/core/scene.h"
#include "tests/support/fixtures.h"
#include "tests/support/image_files.h"
#include "tests/support/scenes_support.h"

namespace penumbra {
namespace {

using test::ImageFolder;

/// A grey floor, a panel over it and between them a black board whose right half can be missing.
SceneDescription board_scene(const Shape& board) {
  SceneDescription scene;
  scene.name = "board";
  scene.camera = {{0.3, 5.0, 3.5}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 50.0, {48, 48}};
  scene.materials = {test::lambert(0.6f), test::lambert(0.0f, "black"),
                     test::lambert(0.0f, "board")};
  scene.shapes = {test::shape("floor", RectangleShape{{-3, 0, 3}, {6, 0, 0}, {0, 0, -6}}),
                  test::light("panel", RectangleShape{{-1.1, 3, -0.9}, {2, 0, 0}, {0, 0, 2}},
                              Rgb(5.0f, 4.0f, 3.0f)),
                  test::shape("board", board, 2)};
  scene.shapes[1].material = 1;
  return scene;
}

const RectangleShape kWhole{{-1, 1, 1}, {2, 0, 0}, {0, 0, -2}};
const RectangleShape kRightHalf{{0, 1, 1}, {1, 0, 0}, {0, 0, -2}};

TriangleMeshShape as_mesh(const RectangleShape& r) {
  TriangleMeshShape mesh;
  mesh.vertices = {r.origin, r.origin + r.edge_u, r.origin + r.edge_u + r.edge_v,
                   r.origin + r.edge_v};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  return mesh;
}

/// A mask whose left half is a hole: between the two texel centres the numbers rise from 0 to 1 and
/// pass the cutoff in the middle.
MaskDescription half_mask(const ImageFolder& folder) {
  test::write_png(folder / "half.png", 2, 1, 4, {255, 255, 255, 0, 255, 255, 255, 255});
  TextureDescription texture = test::texture(folder / "half.png", false, 3);
  texture.wrap_u = texture.wrap_v = TextureWrap::Clamp;
  return {texture, 0.5f};
}

RenderResult render_with(const Scene& scene, Quantity quantity) {
  RenderSettings settings;
  settings.estimator = find_estimator("mis");
  settings.params = fixtures::params_with(*settings.estimator, {});
  settings.budget = {SamplerKind::Independent, 16, 0};
  settings.spp = 1;
  settings.seed = 5;
  return render(scene, make_shading_points(scene, 1, 1, 16, quantity), settings);
}

class Masks : public testing::TestWithParam<bool> {
 protected:
  Shape board() const { return GetParam() ? Shape(as_mesh(kWhole)) : Shape(kWhole); }
  ImageFolder folder_;
};

INSTANTIATE_TEST_SUITE_P(Shapes, Masks, testing::Bool(),
                         [](const auto& shape) { return shape.param ? "Triangles" : "Rectangle"; });

TEST_P(Masks, AHalfMaskedBoardCastsTheShadowOfItsHalf) {
  SceneDescription masked = board_scene(board());
  masked.materials[2].mask = half_mask(folder_);
  const Scene holes(masked);
  const Scene half(board_scene(kRightHalf));
  const Scene whole(board_scene(kWhole));
  EXPECT_EQ(holes.parts().masks.count, 1u);
  EXPECT_FALSE(holes.has_textures()) << "a mask is no value of a shading point";
  EXPECT_TRUE(make_shading_points(holes, 1, 1, 16).surfaces.empty());
  const std::string shadow = render_with(half, Quantity::Radiance).radiance_hash();
  EXPECT_EQ(render_with(holes, Quantity::Radiance).radiance_hash(), shadow);
  EXPECT_NE(render_with(whole, Quantity::Radiance).radiance_hash(), shadow) << "control";
}

TEST_P(Masks, CutIrradianceToo) {
  SceneDescription masked = board_scene(board());
  masked.materials[2].mask = half_mask(folder_);
  const RenderResult holes = render_with(Scene(masked), Quantity::Irradiance);
  const RenderResult half = render_with(Scene(board_scene(kRightHalf)), Quantity::Irradiance);
  // On the board itself the positions differ in their last digits.
  std::size_t different = 0;
  for (std::size_t i = 0; i < half.radiance.size(); ++i) {
    const double scale = half.radiance[i].x + 1e-3;
    different += std::abs(holes.radiance[i].x - half.radiance[i].x) > 1e-3 * scale ? 1u : 0u;
  }
  EXPECT_EQ(different, 0u);
}

TEST_P(Masks, CameraRaysSeeThroughHoles) {
  SceneDescription masked = board_scene(board());
  masked.materials[2].mask = half_mask(folder_);
  const Scene scene(masked);
  const SceneTraits& t = scene.traits();
  RayBatch batch(41 * 41);
  std::vector<bool> hole;
  for (int i = 0; i < 41; ++i) {
    for (int j = 0; j < 41; ++j) {
      const Vec3d from(-0.99 + i * 0.0495, 2.0, -0.99 + j * 0.0495);
      batch.add(Vec3((from - t.center) * t.scale), Vec3(0.0f, -1.0f, 0.0f));
      hole.push_back(i < 20);  // x = 0 is ray 20
    }
  }
  scene.intersect(batch);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    if (i / 41 == 20) continue;  // on the edge
    EXPECT_EQ(batch.hits[i].geometry, hole[i] ? 0u : 2u) << i;
  }
}

TEST_P(Masks, ACutoffOfZeroLeavesTheWholeBoardAndOneBeyondTheImageNothing) {
  SceneDescription masked = board_scene(board());
  masked.materials[2].mask = half_mask(folder_);
  masked.materials[2].mask->cutoff = 0.0f;
  EXPECT_EQ(render_with(Scene(masked), Quantity::Radiance).radiance_hash(),
            render_with(Scene(board_scene(board())), Quantity::Radiance).radiance_hash());
  test::write_png(folder_ / "dim.png", 1, 1, 1, {127});
  masked.materials[2].mask = MaskDescription{test::texture(folder_ / "dim.png"), 0.5f};
  SceneDescription bare = board_scene(kWhole);
  bare.shapes.pop_back();
  EXPECT_EQ(render_with(Scene(masked), Quantity::Radiance).radiance_hash(),
            render_with(Scene(bare), Quantity::Radiance).radiance_hash());
}

}  // namespace
}  // namespace penumbra
