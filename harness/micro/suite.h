#pragma once

#include <benchmark/benchmark.h>

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "harness/clocks.h"
#include "harness/micro/light_field.h"
#include "harness/micro/micro_config.h"
#include "harness/micro/points.h"

/// What the microbenchmarks of one call share, and the loop that checks, times and reports a
/// kernel.
namespace penumbra::micro {

/// Times shadow rays in a scene: from the points of a tile to points of its lights, in the batches
/// of an estimate by light sampling.
class RayMeter {
 public:
  RayMeter(const BenchTile& tile, std::uint64_t seed);

  /// CPU time per ray of one pass over all rays [ns].
  double ns_per_ray();

  std::size_t rays() const noexcept { return rays_; }

 private:
  const Scene* scene_;
  std::vector<RayBatch> batches_;
  std::size_t rays_{0};
};

/// Scenes are loaded and fields of lights are made when they are first asked for; both stay.
class Suite {
 public:
  explicit Suite(MicroConfig config) : config_(std::move(config)) {}

  const MicroConfig& config() const noexcept { return config_; }

  BenchTile& tile(const std::string& scene);
  RayMeter& ray_meter(const std::string& scene);
  /// The meter of the config's first scene, for kernels without a scene.
  RayMeter& ray_meter() { return ray_meter(config_.scenes.front()); }
  const LightField& light_field(int lights);
  /// A scene made for some kernels.
  /// @param make  LightField()
  template <typename Make>
  const LightField& field(const std::string& name, Make make) {
    std::unique_ptr<LightField>& field = fields_[name];
    if (field == nullptr) field = std::make_unique<LightField>(make());
    return *field;
  }

  /// Runs a kernel's check, once per key, and turns a fault into an error of the benchmark.
  /// @param check  returns the fault, empty where there is none
  template <typename Check>
  bool passes(benchmark::State& state, const std::string& key, Check check) {
    const auto known = faults_.find(key);
    const std::string& fault =
        known != faults_.end() ? known->second : faults_.emplace(key, check()).first->second;
    if (!fault.empty()) fail(state, fault);
    return fault.empty();
  }

  /// Google Benchmark 1.7 reads beyond the end after a family with a fit all of whose runs are
  /// errors. Where this is set, a fault becomes the label of a row without work instead.
  void set_needs_row(bool needs_row) noexcept { needs_row_ = needs_row; }

  /// A number that a check has found and the report repeats; 0 at first.
  double& remembered(const std::string& key) { return numbers_[key]; }

  /// Kernels whose check found a fault.
  int failures() const;

 private:
  void fail(benchmark::State& state, const std::string& fault) const;

  MicroConfig config_;
  bool needs_row_{false};
  std::map<std::string, std::unique_ptr<BenchTile>> tiles_;
  std::map<std::string, std::unique_ptr<RayMeter>> meters_;
  std::map<std::string, std::unique_ptr<LightField>> fields_;
  std::map<std::string, std::string> faults_;  // by key
  std::map<std::string, double> numbers_;
};

/// What one iteration of a kernel does.
struct Work {
  const char* unit;   ///< what it is counted in; part of a counter's name: ns_per_<unit>
  double items{1};    ///< of that unit
  RayMeter* meter;    ///< whose rays it is compared with
  double samples{0};  ///< that the share of a shadow ray is per; 0: items
};

/// Times a kernel that has passed its check. Counters: ns_per_<unit> (CPU time of the thread),
/// shadow_ray_ns and share_of_shadow_ray (time per sample over that of a shadow ray, which is
/// measured before and after), instructions_per_<unit> where they are counted.
template <typename Run>
void time_kernel(benchmark::State& state, const Work& work, Run run) {
  const double ray_before_ns = work.meter->ns_per_ray();
  const InstructionCounter::Reading counted = InstructionCounter::read();
  const double start_s = thread_cpu_s();
  for (auto _ : state) run();
  const double time_ns = 1e9 * (thread_cpu_s() - start_s);
  const std::uint64_t instructions = InstructionCounter::since(counted);
  const double ray_ns = 0.5 * (ray_before_ns + work.meter->ns_per_ray());
  const auto rounds = static_cast<double>(state.iterations());
  const std::string unit = work.unit;
  const double samples = work.samples > 0 ? work.samples : work.items;
  state.counters["ns_per_" + unit] = time_ns / rounds / work.items;
  state.counters["shadow_ray_ns"] = ray_ns;
  state.counters["share_of_shadow_ray"] = time_ns / rounds / samples / ray_ns;
  if (counted.valid) {
    state.counters["instructions_per_" + unit] =
        static_cast<double>(instructions) / rounds / work.items;
  }
}

/// Registers a benchmark over sizes, with a fit of its growth where there are several.
/// @param sizes  ascending
/// @param body   void(benchmark::State&); state.range(0) is the size
/// @return the family, for further settings
template <typename Body>
auto* register_sizes(Suite& suite, const std::string& name, const char* size,
                     std::span<const int> sizes, Body body) {
  const bool fits = sizes.size() > 1;
  auto* family = benchmark::RegisterBenchmark(
      name.c_str(), [&suite, body, fits, first = sizes.front()](benchmark::State& state) {
        state.SetComplexityN(state.range(0));
        suite.set_needs_row(fits && state.range(0) == first);
        body(state);
        suite.set_needs_row(false);
      });
  family->ArgName(size);
  for (const int n : sizes) family->Arg(n);
  if (fits) family->Complexity();
  return family;
}

}  // namespace penumbra::micro
