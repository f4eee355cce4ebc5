#include "scenes/core/bare_rays.h"

#include <gtest/gtest.h>

#include <limits>

#include "scenes/core/scene.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

/// Batches of few rays towards a unit square at height 1 and past it, recorded by the query of a
/// scene.
class BareRaysTest : public ::testing::Test {
 protected:
  BareRaysTest() {
    const Vec3 corners[] = {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
    const std::uint32_t indices[] = {0, 1, 2, 3};
    rays_.add_quads(corners, indices);
    rays_.commit();
    test::TestRandom random(3);
    for (int i = 0; i < 37; ++i) {
      RayBatch batch(5);
      for (int r = 0; r < i % 5; ++r) batch.add(Vec3(0.0f), random.direction());
      rays_.intersect(batch);
      for (std::size_t r = 0; r < batch.size(); ++r) hits_ += batch.hits[r].hit() ? 1 : 0;
      recorder_.add(batch);
    }
  }

  RayScene rays_;
  RayRecorder recorder_;
  std::size_t hits_{0};
};

TEST_F(BareRaysTest, EveryKindOfQueryMeetsWhatTheBatchQueryMet) {
  ASSERT_GT(hits_, 0u);
  ASSERT_LT(hits_, recorder_.origins.size());
  for (const BareQuery query : {BareQuery::Single, BareQuery::Packet8, BareQuery::Packet16}) {
    const BareRays bare(rays_, recorder_, query);
    EXPECT_EQ(bare.size(), recorder_.origins.size()) << to_string(query);
    EXPECT_EQ(bare.trace(), hits_) << to_string(query);
    EXPECT_EQ(bare.trace(), hits_) << to_string(query) << ", traced a second time";
  }
}

TEST_F(BareRaysTest, RaysThatCanNotBeTracedAreLeftOut) {
  RayBatch batch(3);
  batch.add(Vec3(0.0f), Vec3(0.0f));
  batch.add(Vec3(std::numeric_limits<float>::quiet_NaN()), Vec3(0.0f, 0.0f, 1.0f));
  batch.add(Vec3(0.0f), Vec3(0.0f, 0.0f, std::numeric_limits<float>::infinity()));
  const std::size_t traceable = recorder_.origins.size();
  recorder_.add(batch);
  for (const BareQuery query : {BareQuery::Single, BareQuery::Packet8, BareQuery::Packet16}) {
    const BareRays bare(rays_, recorder_, query);
    EXPECT_EQ(bare.size(), traceable) << to_string(query);
    EXPECT_EQ(bare.trace(), hits_) << to_string(query);
  }
}

TEST_F(BareRaysTest, BatchSizesAddUpToTheRays) {
  std::size_t sum = 0;
  for (const std::size_t size : recorder_.batch_sizes) {
    EXPECT_GT(size, 0u);
    sum += size;
  }
  EXPECT_EQ(sum, recorder_.origins.size());
  EXPECT_EQ(recorder_.origins.size(), recorder_.directions.size());
}

TEST(SceneOptions, FastRaysMeetTheSameNearTheOrigin) {
  const SceneDescription description = test::small_scene();
  const Scene robust{SceneDescription(description)};
  const Scene fast(SceneDescription(description), {.keep_all = false, .fast_rays = true});
  test::TestRandom random(4);
  RayBatch batch(256);
  for (int i = 0; i < 256; ++i) batch.add(Vec3(0.1f, 0.2f, 0.3f), random.direction());
  robust.intersect(batch);
  const std::vector<RayHit> expected = batch.hits;
  fast.intersect(batch);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    EXPECT_EQ(batch.hits[i].geometry, expected[i].geometry) << i;
  }
}

}  // namespace
}  // namespace penumbra
