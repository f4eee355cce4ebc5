#include <benchmark/benchmark.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

#include "harness/micro/checks.h"
#include "harness/micro/shares.h"

// Each check of the microbenchmarks passes a right result and catches a wrong one: a fault planted
// in a kernel's result must not be timed.
namespace penumbra::micro {
namespace {

const std::vector<double> kAlpha{0.5, 0.3, 0.2};

TEST(MicroChecks, CountsMustSumToTheTotal) {
  EXPECT_EQ(counts_fault(std::vector<int>{5, 3, 2}, kAlpha, 10, 1.0), "");
  EXPECT_NE(counts_fault(std::vector<int>{5, 3, 1}, kAlpha, 10, 1.0), "");
}

TEST(MicroChecks, CountsMustStayNearTheirExpectation) {
  EXPECT_EQ(counts_fault(std::vector<int>{6, 2, 3}, kAlpha, 11, 1.5), "");
  EXPECT_NE(counts_fault(std::vector<int>{3, 5, 2}, kAlpha, 10, 1.0), "");
  EXPECT_NE(
      counts_fault(std::vector<int>{-1, 9, 2}, kAlpha, 10, std::numeric_limits<double>::infinity()),
      "");
}

TEST(MicroChecks, MeanCountsMustBeUnbiased) {
  // 1000 draws of 10: deviations of a multinomial are 50, 46, 40.
  EXPECT_EQ(mean_counts_fault(std::vector<std::int64_t>{5100, 2950, 1950}, kAlpha, 10, 1000), "");
  EXPECT_NE(mean_counts_fault(std::vector<std::int64_t>{5300, 2800, 1900}, kAlpha, 10, 1000), "");
}

TEST(MicroChecks, RaisedCountsMustBeThoseOfOneAtATime) {
  const std::vector<int> before{0, 6, 3, 1};
  EXPECT_EQ(raised_fault(before, std::vector<int>{2, 4, 3, 1}, 2), "");
  EXPECT_NE(raised_fault(before, std::vector<int>{2, 5, 3, 0}, 2), "");
}

TEST(MicroChecks, ConeMustHaveMeanDirectionAndRmsAngle) {
  // Two directions at 0.2 rad on both sides of z.
  const std::vector<Vec3> wi{{std::sin(0.2f), 0.0f, std::cos(0.2f)},
                             {-std::sin(0.2f), 0.0f, std::cos(0.2f)}};
  const std::vector<double> weights{1.0, 1.0};
  const auto cone = [](float angle, Vec3 axis) {
    const float s = std::sin(0.5f * angle);
    return Cone{axis, 2.0f * s * s};
  };
  const Vec3 z(0.0f, 0.0f, 1.0f);
  EXPECT_EQ(cone_fault(cone(0.2f, z), wi, weights, {}), "");
  EXPECT_NE(cone_fault(cone(0.19f, z), wi, weights, {}), "");
  EXPECT_NE(cone_fault(cone(0.2f, wi[0]), wi, weights, {}), "");
  EXPECT_NE(cone_fault(Cone{}, wi, weights, {}), "");
}

TEST(MicroChecks, DensitiesMustBeThoseOfTheScalarForm) {
  const std::vector<double> expected{1.0, 0.0, 3.0};
  EXPECT_EQ(values_fault("pdf", std::vector<double>{1.0 + 1e-7, 0.0, 3.0}, expected, 1e-6), "");
  EXPECT_NE(values_fault("pdf", std::vector<double>{1.001, 0.0, 3.0}, expected, 1e-6), "");
  EXPECT_NE(values_fault("pdf", std::vector<double>{std::nan(""), 0.0, 3.0}, expected, 1e-6), "");
  EXPECT_NE(values_fault("pdf", std::vector<double>{1.0, 0.0}, expected, 1e-6), "");
}

TEST(MicroChecks, ProbabilitiesMustFollowTheEvidence) {
  // w_u = 0.2, w_p = 0.8/2, w_b = 0.4; pixel saw light 0 only, the block both alike.
  const std::vector<double> pixel{2.0, 0.0};
  const std::vector<double> block{3.0, 3.0};
  EXPECT_EQ(probabilities_fault(std::vector<double>{0.7, 0.3}, pixel, block, 64.0, 0.2, 64.0), "");
  EXPECT_NE(probabilities_fault(std::vector<double>{0.69, 0.31}, pixel, block, 64.0, 0.2, 64.0),
            "");
  EXPECT_NE(probabilities_fault(std::vector<double>{0.7, 0.31}, pixel, block, 64.0, 0.2, 64.0), "");
}

TEST(MicroChecks, LeavesMustTileTheChartsAndHoldAllSamples) {
  mdhi::LeafTree tree(2, 32, {});
  tree.reset(2);
  for (int i = 0; i < 32; ++i) {
    const Vec2 u(static_cast<float>(i * 7 % 32) / 32.0f, static_cast<float>(i) / 32.0f);
    tree.insert(static_cast<std::size_t>(i % 2), u, Vec3d(static_cast<double>(u.x)));
  }
  EXPECT_EQ(leaves_fault(tree, 2, 32, 4), "");
  EXPECT_NE(leaves_fault(tree, 3, 32, 4), "");  // a chart that nothing covers
  EXPECT_NE(leaves_fault(tree, 2, 33, 4), "");  // a sample that was lost
  EXPECT_NE(leaves_fault(tree, 2, 32, 1), "");  // a leaf that was not split
  EXPECT_EQ(worst_leaf_fault(tree, tree.worst_leaf()), "");
  std::size_t best = 0;
  for (std::size_t l = 1; l < tree.leaves().size(); ++l) {
    if (tree.error(l) < tree.error(best)) best = l;
  }
  EXPECT_NE(worst_leaf_fault(tree, best), "");
}

TEST(MicroChecks, PointsMustBeUniformAndStratified) {
  std::vector<float> points;
  for (int i = 0; i < 1000; ++i) points.push_back((static_cast<float>(i) + 0.5f) / 1000.0f);
  EXPECT_EQ(uniform_fault(points, 5.5), "");
  EXPECT_EQ(strata_fault(points), "");
  points[10] = points[11];
  EXPECT_NE(strata_fault(points), "");
  std::vector<float> skewed;
  for (const float u : points) skewed.push_back(0.9f * u * u);
  EXPECT_NE(uniform_fault(skewed, 5.5), "");
  points[3] = 1.0f;
  EXPECT_NE(uniform_fault(points, 5.5), "");
}

TEST(MicroChecks, DensityMustHaveTheMassOfItsDraws) {
  EXPECT_EQ(mass_fault(0.99, 1.0, 0.02), "");
  EXPECT_NE(mass_fault(1.1, 1.0, 0.02), "");
  EXPECT_NE(mass_fault(std::nan(""), 1.0, 0.02), "");
}

TEST(MicroChecks, HitsMustBeThoseOfSingleQueries) {
  RayHit hit;
  hit.geometry = 3;
  hit.distance = 2.0f;
  const std::vector<RayHit> single(100, hit);
  std::vector<RayHit> batch = single;
  EXPECT_EQ(hits_fault(batch, single), "");
  batch[5].geometry = 4;  // a common edge
  EXPECT_EQ(hits_fault(batch, single), "");
  batch[6].distance = 2.1f;
  EXPECT_NE(hits_fault(batch, single), "");
}

TEST(MicroSuite, KernelWithAFaultIsCountedAndNeverTimed) {
  Suite suite{MicroConfig{}};
  bool timed = false;
  int checked = 0;
  const auto bench = [&](benchmark::State& state) {
    const bool sound = suite.passes(state, "planted", [&]() -> std::string {
      ++checked;
      return counts_fault(std::vector<int>{5, 3, 1}, kAlpha, 10, 1.0);
    });
    if (!sound) return;
    for (auto _ : state) timed = true;
  };
  benchmark::RegisterBenchmark("planted/first", bench)->Iterations(1);
  benchmark::RegisterBenchmark("planted/again", bench)->Iterations(1);
  std::ostringstream text;
  benchmark::ConsoleReporter reporter(benchmark::ConsoleReporter::OO_None);
  reporter.SetOutputStream(&text);
  reporter.SetErrorStream(&text);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::ClearRegisteredBenchmarks();
  EXPECT_FALSE(timed);
  EXPECT_EQ(checked, 1);
  EXPECT_EQ(suite.failures(), 1);
  EXPECT_NE(text.str().find("counts sum to 9, expected 10"), std::string::npos) << text.str();
}

TEST(MicroSuite, FamilyOfFaultsOnlyIsReportedToTheEnd) {
  Suite suite{MicroConfig{}};
  register_sizes(suite, "planted", "size", std::vector<int>{1, 2, 3}, [&](benchmark::State& state) {
    suite.passes(state, std::to_string(state.range(0)), [] { return std::string("planted"); });
  });
  std::ostringstream text;
  benchmark::ConsoleReporter reporter(benchmark::ConsoleReporter::OO_None);
  reporter.SetOutputStream(&text);
  reporter.SetErrorStream(&text);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::ClearRegisteredBenchmarks();
  EXPECT_EQ(suite.failures(), 3);
  for (const char* row : {"planted/size:1", "planted/size:2", "planted/size:3"}) {
    EXPECT_NE(text.str().find(row), std::string::npos) << text.str();
  }
}

TEST(MicroShares, GainIsThatOfTheTimeThatIsLeft) {
  EstimateShares shares{"scene", "mis", "16"};
  shares.samples = 32;
  shares.shadow_ray_ns = 50;
  shares.kernels = {{"rays", "ray", 10, 60}, {"adapt: counts", "iteration", 2, 100}};
  set_shares(shares, 1000);
  EXPECT_DOUBLE_EQ(shares.kernels[0].share, 0.6);
  EXPECT_DOUBLE_EQ(gain_without(shares.kernels[0].share), 2.5);
  EXPECT_DOUBLE_EQ(shares.predicted_ns(), 800);
  EXPECT_DOUBLE_EQ(shares.adaptation_share(), 0.2);
}

TEST(MicroShares, CsvHasARowPerKernelAndThreeSums) {
  EstimateShares shares{"scene", "mis", "16"};
  shares.samples = 32;
  shares.shadow_ray_ns = 50;
  shares.kernels = {{"rays", "ray", 10, 60}};
  set_shares(shares, 1000);
  const std::string csv = shares_csv({shares}, MicroConfig{});
  EXPECT_NE(csv.find("scene,mis,16,rays,ray,10,60,600,0.6,0.375,2.5,50,32,"), std::string::npos);
  EXPECT_NE(csv.find("scene,mis,16,all kernels,,,,600,0.6,"), std::string::npos);
  EXPECT_NE(csv.find("scene,mis,16,unexplained,,,,400,0.4,"), std::string::npos);
  EXPECT_NE(csv.find("scene,mis,16,estimate,,,,1000,1,"), std::string::npos);
}

}  // namespace
}  // namespace penumbra::micro
