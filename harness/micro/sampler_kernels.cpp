// Point sets, filled in blocks as a mixture fills them.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "harness/micro/checks.h"
#include "harness/micro/register.h"
#include "scenes/core/sampler.h"

namespace penumbra::micro {
namespace {

// Makes the set of a key and hands its blocks on.
template <typename Visit>
void fill_set(SamplerKind kind, const StreamKey& key, std::uint32_t count, bool with_choice,
              VariateBlock& block, Visit visit) {
  const PointSet points(kind, key, count);
  for (std::uint32_t done = 0; done < count;) {
    const std::uint32_t n = std::min(count - done, static_cast<std::uint32_t>(kBlock));
    points.fill(done, n, with_choice, block);
    visit(done, n);
    done += n;
  }
}

// The blocks against single points, single points against what the kind promises, and the means of
// many sets against those of uniform points.
std::string points_fault(SamplerKind kind, StreamKey key, std::uint32_t count, bool with_choice) {
  constexpr std::uint32_t kSets = 64;
  VariateBlock block;
  std::vector<float> all;
  std::string fault;
  for (std::uint32_t set = 0; set < kSets && fault.empty(); ++set) {
    key.estimate = set;
    const PointSet single(kind, key, count);
    std::vector<float> x, choice;
    fill_set(kind, key, count, with_choice, block, [&](std::uint32_t first, std::uint32_t n) {
      for (std::uint32_t i = 0; i < n; ++i) {
        const Variates due = single(first + i);
        const bool same = block.x[i] == due.u.x && block.y[i] == due.u.y &&
                          (!with_choice || block.choice[i] == due.choice);
        if (!same) fault = fmt::format("point {} differs from the one drawn alone", first + i);
        x.push_back(due.u.x);
        choice.push_back(due.choice);
        all.insert(all.end(), {due.u.x, due.u.y, due.choice});
      }
    });
    if (!fault.empty()) return fault;
    if (kind == SamplerKind::Stratified) fault = strata_fault(choice);
    if (kind == SamplerKind::Sobol && std::has_single_bit(count)) fault = strata_fault(x);
  }
  return fault.empty() ? uniform_fault(all, 5.5) : fault;
}

void time_points(benchmark::State& state, Suite& suite, SamplerKind kind, bool with_choice) {
  const auto count = static_cast<std::uint32_t>(state.range(0));
  StreamKey key;
  key.seed = suite.config().seed;
  if (!suite.passes(state, fmt::format("sampler/{}/{}/{}", to_string(kind), with_choice, count),
                    [&] { return points_fault(kind, key, count, with_choice); })) {
    return;
  }
  VariateBlock block;
  time_kernel(state, {"sample", static_cast<double>(count), &suite.ray_meter()}, [&] {
    ++key.estimate;
    fill_set(kind, key, count, with_choice, block, [&](std::uint32_t, std::uint32_t) {
      benchmark::DoNotOptimize(&block);
      benchmark::ClobberMemory();
    });
  });
}

}  // namespace

void register_sampler_kernels(Suite& suite) {
  for (const SamplerKind kind :
       {SamplerKind::Independent, SamplerKind::Stratified, SamplerKind::Sobol}) {
    for (const bool with_choice : {false, true}) {
      register_sizes(
          suite, fmt::format("sampler/{}{}", to_string(kind), with_choice ? "/with_choice" : ""),
          "points", suite.config().point_counts,
          [&suite, kind, with_choice](benchmark::State& state) {
            time_points(state, suite, kind, with_choice);
          });
    }
  }
}

}  // namespace penumbra::micro
