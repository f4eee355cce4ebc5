// Every scene of scenes/ loads, renders without bad values, and is the same scene with everything
// kept. At a small resolution; each scene is read once.
//
// False alarms of the comparison of means: 1e-4 for all scenes together (Bonferroni, Welch's t), if
// the means over the image are normal.

#include <gtest/gtest.h>

#include <cstdlib>

#include "harness/bias_test.h"
#include "harness/project_root.h"
#include "harness/render.h"
#include "harness/scene_store.h"
#include "scenes/core/scene_file_model.h"
#include "tests/support/fixtures.h"

namespace penumbra::conformance {
namespace {

class ShippedScenes : public ::testing::TestWithParam<std::string> {
 protected:
  // A fresh clone has no real models.
  void SetUp() override { unsetenv(kModelsVariable); }
};

constexpr double kFamilyLevel = 1e-4;
constexpr int kReplicates = 12;

/// Mean over the image of `mis` at SRL 2, by independent replicates without a bad estimate.
MeanEstimate image_mean(const Scene& scene, std::uint64_t first_seed) {
  const EstimatorEntry& mis = *find_estimator("mis");
  RenderSettings settings;
  settings.estimator = &mis;
  settings.params = fixtures::params_with(mis, {});
  settings.budget = {SamplerKind::Independent, 2, 0};
  const ShadingPoints points = make_shading_points(scene, 1, kCameraSeed, 16);
  std::vector<double> means;
  for (int i = 0; i < kReplicates; ++i) {
    settings.seed = first_seed + static_cast<std::uint64_t>(i);
    const RenderResult result = render(scene, points, settings);
    EXPECT_EQ(result.counters.uncovered, 0u);
    EXPECT_EQ(result.bad_count, 0u);
    double sum = 0.0;
    for (const Vec3d& pixel : result.radiance) sum += pixel.x + pixel.y + pixel.z;
    means.push_back(sum);
  }
  MeanEstimate result;
  for (const double mean : means) result.mean += mean / kReplicates;
  for (const double mean : means) {
    result.variance_of_mean +=
        (mean - result.mean) * (mean - result.mean) / (kReplicates * (kReplicates - 1.0));
  }
  result.degrees_of_freedom = kReplicates - 1;
  return result;
}

// Whether a part is there exactly where the scene needs it, and there in any case where kept.
void expect_part(const ScenePart& lean, const ScenePart& kept, bool needed, const char* name) {
  EXPECT_EQ(lean.present(), needed) << name;
  EXPECT_TRUE(kept.present()) << name;
  if (!needed) {
    EXPECT_EQ(lean.bytes, 0u) << name;
    EXPECT_GT(kept.bytes, 0u) << name;
  }
}

TEST_P(ShippedScenes, RenderAndAreTheSameWithEverythingKept) {
  const SceneDescription description = load_description(
      project_root() / "scenes" / GetParam() / "scene.json", std::array<int, 2>{24, 14});
  const Scene lean(description);
  const Scene kept(description, SceneOptions{true});
  EXPECT_NE(lean.traits().geometry, "models");
  EXPECT_EQ(lean.content_hash(), kept.content_hash());
  const MeanEstimate a = image_mean(lean, 1);
  const MeanEstimate b = image_mean(kept, 1001);
  EXPECT_GT(a.mean, 0.0);
  const double level = kFamilyLevel / static_cast<double>(scene_names(project_root()).size());
  // Kept normals are the faces' own to rounding.
  EXPECT_GT(welch_test(a, b, 1e-5 * a.mean).p, level) << a.mean << " against " << b.mean;

  bool has_masks = false;
  bool has_values = false;
  for (const ShapeDescription& shape : description.shapes) {
    const MaterialDescription& material = description.materials[shape.material];
    has_masks = has_masks || material.mask;
    has_values = has_values || material.reflectance_texture || material.roughness_texture ||
                 material.metallic_texture;
  }
  expect_part(lean.parts().environment, kept.parts().environment,
              description.environment.has_value(), "environment");
  expect_part(lean.parts().uvs, kept.parts().uvs, has_masks || has_values, "uvs");
  EXPECT_EQ(lean.parts().masks.present(), has_masks);
  EXPECT_EQ(lean.parts().textures.present(), has_masks || has_values);
  EXPECT_GE(kept.parts().normals.count, lean.parts().normals.count);
  EXPECT_GE(kept.parts().masks.count, lean.parts().masks.count);
  EXPECT_EQ(lean.parts().delta_lights.count, kept.parts().delta_lights.count);
}

INSTANTIATE_TEST_SUITE_P(All, ShippedScenes, ::testing::ValuesIn(scene_names(project_root())),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace penumbra::conformance
