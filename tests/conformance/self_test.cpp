// The decision that all agreement tests share, tried on errors that are planted.
//
// With no more estimates per pixel than the agreement tests use and half of their rays: they find
// what is found here.
//
// Power: an energy error of 2 % must be found in at least 57 of 60 repetitions with fresh seeds, 52
// on the scene that is cheap to render. Where the true power is 99.5 % that fails with probability
// 2e-4 (binomial); where it is 90 % it passes with probability 0.14, so a weak test is likely, not
// sure, to be seen. False alarms: twenty repetitions without an error raise one with probability
// 2e-6 if the noise is normal.

#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "tests/conformance/conformance_support.h"

namespace penumbra::conformance {
namespace {

constexpr double kPlanted = 1.02;

// Another estimator's results times a factor. Its parameters are those of the other, and two more
// that name it and the factor.
class Scaled final : public Estimator {
 public:
  Scaled(std::unique_ptr<Estimator> base, float factor) : base_(std::move(base)), factor_(factor) {}

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    base_->estimate(tile, seed, out);
    for (Rgb& value : out.radiance) value *= factor_;
  }

 private:
  std::unique_ptr<Estimator> base_;
  float factor_;
};

// With half of the shadow rays, for time.
std::unique_ptr<Estimator> create_scaled(const Scene& scene, const ParamSet& params,
                                         const Budget& budget) {
  const EstimatorEntry& base = *find_estimator(params.text("scaled_estimator"));
  const Budget half{budget.sampler, budget.srl_initial / 2, budget.srl_adaptive / 2};
  return std::make_unique<Scaled>(base.create(scene, params, half),
                                  static_cast<float>(params.real("scaled_factor")));
}

EstimatorEntry scaled_entry(const EstimatorEntry& base) {
  EstimatorEntry entry = base;
  entry.create = create_scaled;
  return entry;
}

Variant scaled(const Variant& base, const EstimatorEntry& entry, double factor) {
  ParamSet::Map params = base.params.values();
  params["scaled_estimator"] = std::string(base.entry->name);
  params["scaled_factor"] = factor;
  return {base.name + "_scaled", &entry, ParamSet(std::move(params))};
}

struct Repetitions {
  int count{0};
  int spp{1};
};

// Number of repetitions that find a difference.
// @param repetitions  on each scene
int count_found(const Variant& variant, const std::vector<Repetitions>& repetitions) {
  int found = 0;
  for (std::size_t s = 0; s < repetitions.size(); ++s) {
    const TestScene& scene = *test_scenes()[s];
    int here = 0;
    for (int i = 0; i < repetitions[s].count; ++i) {
      const Decision decision = decide(source(scene, variant, repetitions[s].spp), reference(scene),
                                       running_test() + "/" + std::to_string(i));
      here += decision.differ() ? 1 : 0;
    }
    std::printf("%s: %d of %d\n", scene.name.c_str(), here, repetitions[s].count);
    found += here;
  }
  return found;
}

class SelfTest : public ::testing::Test {
 protected:
  Variant base_ = {"mis", find_estimator("mis"), {}};
  EstimatorEntry entry_ = scaled_entry(*base_.entry);

  void SetUp() override { base_ = unbiased_variants(*base_.entry).front(); }
};

TEST_F(SelfTest, PlantedErrorOfTwoPercentIsFound) {
  EXPECT_GE(count_found(scaled(base_, entry_, kPlanted), {{52, 1}, {3, 3}, {5, 1}}), 57);
}

TEST_F(SelfTest, NoErrorRaisesNoAlarm) {
  EXPECT_EQ(count_found(scaled(base_, entry_, 1.0), {{12, 1}, {4, 3}, {4, 1}}), 0);
}

}  // namespace
}  // namespace penumbra::conformance
