#include "scenes/core/independent_points.h"

#include <gtest/gtest.h>

namespace penumbra {
namespace {

// Runs of 1, 2, ... lanes fill a block; each is part of a set that began before it.
TEST(IndependentPoints, LanesHaveTheBitsOfTheirSets) {
  StreamKey key{0x123456789abcdef0u, 0xfedcba98u, 0x89abcdefu, 4095, 77};
  PointLanes lanes;
  std::size_t count = 0;
  for (std::uint32_t run = 1; count + run <= kBlock; ++run) {
    lanes.add(count, run, 1000003u * run % (1u << 20), 0x90000000u + run);
    count += run;
  }
  VariateBlock block;
  fill_independent(key, lanes, count, block);
  for (std::size_t i = 0; i < count; ++i) {
    key.component = lanes.component[i];
    const std::uint32_t index = lanes.index[i];
    const Variates expected = PointSet(SamplerKind::Independent, key, index + 1)(index);
    EXPECT_EQ(block[i].u, expected.u) << i;
    EXPECT_EQ(block[i].choice, expected.choice) << i;
  }
}

TEST(IndependentPoints, RunsFollowEachOther) {
  PointLanes lanes;
  lanes.add(0, 3, 5, 0);
  lanes.add(3, 9, 6, 2);
  EXPECT_EQ(lanes.component[2], 5u);
  EXPECT_EQ(lanes.index[2], 2u);
  EXPECT_EQ(lanes.component[3], 6u);
  EXPECT_EQ(lanes.index[3], 2u);
  EXPECT_EQ(lanes.index[11], 10u);
}

}  // namespace
}  // namespace penumbra
