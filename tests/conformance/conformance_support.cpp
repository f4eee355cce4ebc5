#include "tests/conformance/conformance_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "harness/render.h"
#include "tests/support/fixtures.h"

namespace penumbra::conformance {
namespace {

constexpr int kTileSides[] = {16, 8};

Variant with_defaults(const EstimatorEntry& entry) {
  return {std::string(entry.name), &entry, fixtures::params_with(entry, {})};
}

bool is_declared_unbiased(const Variant& v) { return v.entry->bias_reason(v.params).empty(); }

Variant reference_variant() { return with_defaults(*find_estimator("mis")); }

BiasTestOptions options_of(double level) {
  BiasTestOptions options;
  options.level = level;
  options.tolerance = kRounding;
  return options;
}

}  // namespace

void PrintTo(const Variant& variant, std::ostream* out) { *out << variant.name; }

std::vector<Variant> defaults() {
  std::vector<Variant> result;
  for (const EstimatorEntry* entry : all_estimators()) result.push_back(with_defaults(*entry));
  return result;
}

std::vector<Variant> unbiased_defaults() {
  std::vector<Variant> result = defaults();
  std::erase_if(result, [](const Variant& v) { return !is_declared_unbiased(v); });
  return result;
}

std::vector<Variant> unbiased_variants(const EstimatorEntry& entry) {
  std::vector<Variant> result{with_defaults(entry)};
  for (const ParamSpec& spec : entry.params()) {
    std::vector<ParamValue> others;
    if (const auto* flag = std::get_if<bool>(&spec.default_value)) others.emplace_back(!*flag);
    for (const std::string& choice : spec.choices) others.emplace_back(choice);
    for (const ParamValue& value : others) {
      if (value == spec.default_value) continue;
      result.push_back({std::string(entry.name) + "_" + spec.name + "_" + to_string(value), &entry,
                        fixtures::params_with(entry, {{spec.name, value}})});
    }
  }
  std::erase_if(result, [](const Variant& v) { return !is_declared_unbiased(v); });
  return result;
}

Budget budget_of(const EstimatorEntry& entry) {
  const int total = std::max(16, entry.min_srl);
  if (!entry.adaptive) return {SamplerKind::Independent, total, 0};
  return {SamplerKind::Independent, total / 4, total - total / 4};
}

TileReplicates replicates(const TestScene& scene, const Variant& variant, int spp, int count,
                          const std::string& label) {
  TileReplicates result(bias_tiles(scene.points.width, scene.points.height, kTileSides));
  RenderSettings settings;
  settings.estimator = variant.entry;
  settings.params = variant.params;
  settings.budget = budget_of(*variant.entry);
  settings.spp = spp;
  EstimateCounters counters;
  std::uint64_t bad = 0;
  for (int r = 0; r < count; ++r) {
    settings.seed = fixtures::seed_from(label + "/" + scene.name + "/" + variant.name + "/" +
                                        std::to_string(r));
    const RenderResult image = render(scene.scene, scene.points, settings);
    counters += image.counters;
    bad += image.bad_count;
    result.add(image.radiance);
  }
  EXPECT_EQ(bad, 0u) << variant.name << ", scene " << scene.name
                     << ": estimates that are not finite or negative";
  if (is_declared_unbiased(variant)) {
    EXPECT_EQ(counters.uncovered, 0u) << variant.name << ", scene " << scene.name;
  }
  return result;
}

ReplicateSource reference(const TestScene& scene) {
  return [&scene](int count, const std::string&) -> TileReplicates {
    static std::map<std::pair<std::string, int>, TileReplicates> known;
    const auto key = std::make_pair(scene.name, count);
    const auto found = known.find(key);
    if (found != known.end()) return found->second;
    TileReplicates made = replicates(scene, reference_variant(), kReferenceSpp, count,
                                     "reference of " + std::to_string(count));
    return known.emplace(key, std::move(made)).first->second;
  };
}

ReplicateSource source(const TestScene& scene, const Variant& variant, int spp) {
  return [&scene, variant, spp](int count, const std::string& label) {
    return replicates(scene, variant, spp, count, label);
  };
}

std::string Decision::text() const {
  std::string result = describe(first);
  if (confirmation) result += "\n  confirmation: " + describe(*confirmation);
  return result;
}

Decision decide(const ReplicateSource& a, const ReplicateSource& b, const std::string& label) {
  const std::string first_a = label + "/a", first_b = label + "/b";
  Decision result;
  result.first = bias_test(a(kReplicates, first_a), b(kReplicates, first_b), options_of(kLevel));
  if (!result.first.rejected) return result;
  const std::string again_a = label + "/confirm a", again_b = label + "/confirm b";
  result.confirmation = bias_test(a(kConfirmReplicates, again_a), b(kConfirmReplicates, again_b),
                                  options_of(kLevel / 10));
  return result;
}

std::string running_test() {
  const ::testing::TestInfo* test = ::testing::UnitTest::GetInstance()->current_test_info();
  return std::string(test->test_suite_name()) + "." + test->name();
}

}  // namespace penumbra::conformance
