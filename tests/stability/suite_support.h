#pragma once

#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "harness/stability/matrix.h"
#include "harness/stability/stability.h"

/// Runs of the suite, and estimators that are wrong on purpose.
namespace penumbra::stability {

inline const StabilityCase* case_of(std::string_view name) { return &case_named(name); }

inline StabilityResult run_on(std::vector<const StabilityCase*> cases,
                              std::vector<const EstimatorEntry*> estimators, bool quick = true,
                              int threads = 2) {
  StabilityOptions options;
  options.cases = std::move(cases);
  options.estimators = std::move(estimators);
  options.quick = quick;
  options.threads = threads;
  return run_stability(options);
}

inline std::vector<const StabilityCase*> all_cases() {
  std::vector<const StabilityCase*> cases;
  for (const StabilityCase& c : stability_cases()) cases.push_back(&c);
  return cases;
}

inline std::span<const ParamSpec> no_params() { return {}; }
inline std::string claims_unbiased(const ParamSet&) { return {}; }

/// Wraps `mis` with solid-angle sampling and spoils its results.
template <typename Spoil>
class Spoiled final : public Estimator {
 public:
  Spoiled(const Scene& scene, const Budget& budget) {
    const EstimatorEntry& mis = *find_estimator("mis");
    std::vector<ParamProblem> problems;
    inner_ = mis.create(
        scene,
        resolve_params(mis.params(), {{"light_sampling", std::string("solid_angle")}}, problems),
        budget);
  }
  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    inner_->estimate(tile, seed, out);
    for (std::size_t i = 0; i < out.radiance.size(); ++i)
      out.radiance[i] = Spoil{}(out.radiance[i], i);
  }

 private:
  std::unique_ptr<Estimator> inner_;
};

template <typename Spoil>
std::unique_ptr<Estimator> make_spoiled(const Scene& scene, const ParamSet&, const Budget& budget) {
  return std::make_unique<Spoiled<Spoil>>(scene, budget);
}

template <typename Spoil>
constexpr EstimatorEntry spoiled(std::string_view name) {
  EstimatorEntry entry;
  entry.name = name;
  entry.min_srl = 2;
  entry.params = no_params;
  entry.bias_reason = claims_unbiased;
  entry.create = make_spoiled<Spoil>;
  return entry;
}

/// A tenth too much, and a trace of light where there is none.
struct TenPercent {
  Rgb operator()(const Rgb& c, std::size_t) const { return c * 1.1f + Rgb(1e-34f); }
};
struct NanOnce {
  Rgb operator()(const Rgb& c, std::size_t i) const {
    return i == 301 ? Rgb(std::numeric_limits<float>::quiet_NaN()) : c;
  }
};
struct NegativeOnce {
  Rgb operator()(const Rgb& c, std::size_t i) const { return i == 301 ? Rgb(-1e-6f) : c; }
};

inline constexpr EstimatorEntry kTooBright = spoiled<TenPercent>("too bright");
inline constexpr EstimatorEntry kNanOnce = spoiled<NanOnce>("nan once");
inline constexpr EstimatorEntry kNegativeOnce = spoiled<NegativeOnce>("negative once");

}  // namespace penumbra::stability
