// PMC-HI without adaptation and with the first counts of the shared layout is the balance heuristic
// of MIS: the same samples, densities and sums, so the same bits.

#include <gtest/gtest.h>

#include <cstring>
#include <ostream>

#include "tests/support/fixtures.h"

namespace penumbra::fixtures {
namespace {

constexpr int kSide = 16;
constexpr int kSpp = 4;

struct Case {
  SamplerKind sampler;
  std::string light_sampling;
  int srl;
};

std::string name_of(const Case& c) {
  return std::string(to_string(c.sampler)) + "_" + c.light_sampling + "_srl" +
         std::to_string(c.srl);
}

void PrintTo(const Case& c, std::ostream* out) { *out << name_of(c); }

std::vector<Case> cases() {
  std::vector<Case> result;
  for (const SamplerKind sampler :
       {SamplerKind::Independent, SamplerKind::Stratified, SamplerKind::Sobol}) {
    for (const std::string light_sampling : {"area", "solid_angle", "cosine"}) {
      for (const int srl : {2, 3, 7, 16}) result.push_back({sampler, light_sampling, srl});
    }
  }
  return result;
}

std::vector<Rgb> render(const EstimatorEntry& entry, const ParamSet& params, const Budget& budget,
                        const Scene& scene, std::span<const ShadingPoint> points) {
  Tile tile{0, 0, kSide, kSide, kSide, 1, kSpp, points};
  std::vector<Rgb> radiance(tile.estimate_count());
  TileOutput out;
  out.radiance = radiance;
  entry.create(scene, params, budget)->estimate(tile, 5, out);
  return radiance;
}

// Points spread over the plane z = 0 below the fixtures' lights and occluders.
std::vector<ShadingPoint> spread_points(const PlacedPoint& placed) {
  std::vector<ShadingPoint> points(std::size_t{kSide} * kSide, placed.point);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].position.x += 0.2f * (static_cast<float>(i % kSide) - 7.5f);
    points[i].position.y += 0.2f * (static_cast<float>(i / kSide) - 7.5f);
  }
  return points;
}

class Equivalence : public ::testing::TestWithParam<Case> {};

TEST_P(Equivalence, PmcHiWithoutAdaptationIsSharedMisToTheBit) {
  const Case& c = GetParam();
  const EstimatorEntry& mis = *find_estimator("mis");
  const EstimatorEntry& pmc_hi = *find_estimator("pmc_hi");
  const ParamSet mis_params = params_with(mis, {{"layout", std::string("shared")},
                                                {"heuristic", std::string("balance")},
                                                {"light_sampling", c.light_sampling}});
  const ParamSet pmc_params = params_with(pmc_hi, {{"adapt", false},
                                                   {"initial", std::string("mis_split")},
                                                   {"light_sampling", c.light_sampling}});
  for (const Fixture& f : all_fixtures()) {
    const PlacedPoint placed = build(f);
    const std::vector<ShadingPoint> points = spread_points(placed);
    const std::vector<Rgb> a =
        render(mis, mis_params, {c.sampler, c.srl, 0}, *placed.scene, points);
    // Without adaptation the split of the budget makes no difference.
    for (const int adaptive : {0, 1, c.srl - 2}) {
      const std::vector<Rgb> b = render(pmc_hi, pmc_params, {c.sampler, c.srl - adaptive, adaptive},
                                        *placed.scene, points);
      EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(Rgb)), 0)
          << "fixture " << f.id << ", " << adaptive << " adaptive rays";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(SamplersAndBudgets, Equivalence, ::testing::ValuesIn(cases()),
                         [](const auto& test) { return name_of(test.param); });

}  // namespace
}  // namespace penumbra::fixtures
