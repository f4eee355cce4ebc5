#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "estimators/estimator.h"
#include "harness/bias_test.h"
#include "tests/conformance/test_scenes.h"

/// Estimators with their parameters, replicates of their images, and the one decision on agreement
/// that all tests of this folder share.
namespace penumbra::conformance {

/// Replicates of the first test, and of its confirmation.
inline constexpr int kReplicates = 16;
inline constexpr int kConfirmReplicates = 4 * kReplicates;
/// Estimates per pixel and replicate of the reference.
inline constexpr int kReferenceSpp = 4;
/// Family-wise level of one comparison over all scales and tiles; its confirmation has a tenth.
inline constexpr double kLevel = 1e-3;
/// Differences of float arithmetic, relative to the image's mean.
inline constexpr double kRounding = 1e-5;

/// An estimator with a set of parameters.
struct Variant {
  std::string name;  ///< a part of a test's name
  const EstimatorEntry* entry{nullptr};
  ParamSet params;
};

void PrintTo(const Variant& variant, std::ostream* out);

/// Every registered estimator with its defaults, biased ones too.
std::vector<Variant> defaults();
/// Those of `defaults` that declare no bias.
std::vector<Variant> unbiased_defaults();
/// The defaults and every single choice and switch that differs from them, as far as they declare
/// no bias.
std::vector<Variant> unbiased_variants(const EstimatorEntry& entry);

/// 16 shadow rays per light, or more where the estimator needs more; a quarter of them initial.
Budget budget_of(const EstimatorEntry& entry);

/// Renders `count` replicates with seeds of their own. Reports (as failures of the running test)
/// estimates that are not finite or negative, and uncovered samples of parameters that declare no
/// bias.
/// @param label  decides the seeds
TileReplicates replicates(const TestScene& scene, const Variant& variant, int spp, int count,
                          const std::string& label);

/// Makes replicates of one side of a comparison, with seeds that follow from the label.
using ReplicateSource = std::function<TileReplicates(int count, const std::string& label)>;

/// The reference (`mis` with its defaults) of a scene; each number of replicates is rendered once
/// per process, whatever the label.
ReplicateSource reference(const TestScene& scene);

/// A variant with `spp` estimates per pixel.
ReplicateSource source(const TestScene& scene, const Variant& variant, int spp);

/// What the two steps of a comparison found.
struct Decision {
  BiasTestResult first;
  std::optional<BiasTestResult> confirmation;  ///< only where the first step rejected

  bool differ() const { return confirmation && confirmation->rejected; }
  std::string text() const;
};

/// Decides whether two sides have different means: the combined test over three scales with
/// kReplicates at kLevel; a rejection counts when fresh seeds, kConfirmReplicates and kLevel / 10
/// reject again.
Decision decide(const ReplicateSource& a, const ReplicateSource& b, const std::string& label);

/// Full name of the running test.
std::string running_test();

}  // namespace penumbra::conformance
