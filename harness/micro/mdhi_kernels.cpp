// MDHI's kd-trees without rays, over the number of samples.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <random>

#include "estimators/mdhi/leaf_tree.h"
#include "harness/micro/checks.h"
#include "harness/micro/register.h"

namespace penumbra::micro {
namespace {

constexpr std::size_t kCharts = 2;
constexpr std::size_t kInitial = 4;
constexpr std::size_t kCandidates = 4;

std::vector<Vec2> uniform_points(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f - 0x1p-24f);
  std::vector<Vec2> points(count);
  for (Vec2& u : points) u = Vec2(uniform(engine), uniform(engine));
  return points;
}

// Half of each chart is lit, with a gradient.
Vec3d value_at(const Vec2& u) {
  return u.x < 0.5f ? Vec3d(0.0) : Vec3d(1.0 + static_cast<double>(u.y));
}

// One estimate without its rays: find the worst leaf, choose the best of four candidates, insert,
// split.
void estimate_tree(mdhi::LeafTree& tree, std::span<const Vec2> variates, std::size_t samples) {
  tree.reset(kCharts);
  for (std::size_t i = 0; i < samples; ++i) {
    const Vec2* candidates = &variates[i * kCandidates];
    if (i < kCharts * kInitial) {
      tree.insert(i % kCharts, candidates[0], value_at(candidates[0]));
      continue;
    }
    const std::size_t leaf = tree.worst_leaf();
    Vec2 best = tree.point_in(leaf, candidates[0]);
    float farthest = -1.0f;
    for (std::size_t c = 0; c < kCandidates; ++c) {
      const Vec2 u = tree.point_in(leaf, candidates[c]);
      const float distance2 = tree.nearest_distance2(leaf, u);
      if (distance2 > farthest) {
        farthest = distance2;
        best = u;
      }
    }
    tree.insert_into(leaf, best, value_at(best));
  }
}

// Samples at places that are given, each searched for from the root.
void insert_all(mdhi::LeafTree& tree, std::span<const Vec2> points) {
  tree.reset(kCharts);
  for (std::size_t i = 0; i < points.size(); ++i) {
    tree.insert(i % kCharts, points[i], value_at(points[i]));
  }
}

std::string tree_fault(const mdhi::LeafTree& tree, std::size_t samples, std::size_t capacity) {
  const std::string fault = leaves_fault(tree, kCharts, samples, capacity);
  return fault.empty() ? worst_leaf_fault(tree, tree.worst_leaf()) : fault;
}

void time_estimate(benchmark::State& state, Suite& suite) {
  const auto samples = static_cast<std::size_t>(state.range(0));
  const std::vector<Vec2> variates = uniform_points(samples * kCandidates, suite.config().seed);
  mdhi::LeafTree tree(kCharts, samples, {});
  if (!suite.passes(state, fmt::format("mdhi_estimate/{}", samples), [&] {
        estimate_tree(tree, variates, samples);
        return tree_fault(tree, samples, mdhi::LeafRules{}.capacity);
      })) {
    return;
  }
  time_kernel(state, {"sample", static_cast<double>(samples), &suite.ray_meter()},
              [&] { estimate_tree(tree, variates, samples); });
}

void time_insert(benchmark::State& state, Suite& suite) {
  const auto samples = static_cast<std::size_t>(state.range(0));
  const std::vector<Vec2> points = uniform_points(samples, suite.config().seed);
  mdhi::LeafTree tree(kCharts, samples, {});
  if (!suite.passes(state, fmt::format("mdhi_insert/{}", samples), [&] {
        insert_all(tree, points);
        return tree_fault(tree, samples, mdhi::LeafRules{}.capacity);
      })) {
    return;
  }
  time_kernel(state, {"sample", static_cast<double>(samples), &suite.ray_meter()},
              [&] { insert_all(tree, points); });
}

// Down to one sample per leaf, on a copy each time; what the copy takes is measured apart and taken
// off.
void time_split(benchmark::State& state, Suite& suite) {
  const auto samples = static_cast<std::size_t>(state.range(0));
  const std::vector<Vec2> points = uniform_points(samples, suite.config().seed);
  mdhi::LeafTree whole(kCharts, samples, {});
  insert_all(whole, points);
  mdhi::LeafTree tree = whole;
  tree.split_down_to(1);
  if (!suite.passes(state, fmt::format("mdhi_split/{}", samples),
                    [&] { return tree_fault(tree, samples, 1); })) {
    return;
  }
  const auto splits = static_cast<double>(tree.leaves().size() - whole.leaves().size());
  double copy_s = 0.0;
  double split_s = 0.0;
  for (auto _ : state) {
    const double start_s = thread_cpu_s();
    tree = whole;
    const double middle_s = thread_cpu_s();
    tree.split_down_to(1);
    const double end_s = thread_cpu_s();
    copy_s += middle_s - start_s;
    split_s += end_s - middle_s;
    state.SetIterationTime(end_s - middle_s);
  }
  const auto rounds = static_cast<double>(state.iterations());
  state.counters["ns_per_split"] = 1e9 * split_s / rounds / splits;
  state.counters["copy_ns"] = 1e9 * copy_s / rounds;
  state.counters["share_of_shadow_ray"] =
      1e9 * split_s / rounds / static_cast<double>(samples) / suite.ray_meter().ns_per_ray();
}

void time_worst_leaf(benchmark::State& state, Suite& suite) {
  const auto samples = static_cast<std::size_t>(state.range(0));
  mdhi::LeafTree tree(kCharts, samples, {});
  insert_all(tree, uniform_points(samples, suite.config().seed));
  if (!suite.passes(state, fmt::format("mdhi_worst/{}", samples),
                    [&] { return worst_leaf_fault(tree, tree.worst_leaf()); })) {
    return;
  }
  time_kernel(state, {"search", 1.0, &suite.ray_meter()}, [&] {
    benchmark::DoNotOptimize(&tree);
    benchmark::ClobberMemory();
    benchmark::DoNotOptimize(tree.worst_leaf());
  });
}

}  // namespace

void register_mdhi_kernels(Suite& suite) {
  const std::vector<int>& samples = suite.config().tree_samples;
  register_sizes(suite, "mdhi/tree_of_estimate", "samples", samples,
                 [&suite](benchmark::State& state) { time_estimate(state, suite); });
  register_sizes(suite, "mdhi/insert", "samples", samples,
                 [&suite](benchmark::State& state) { time_insert(state, suite); });
  register_sizes(suite, "mdhi/worst_leaf", "samples", samples,
                 [&suite](benchmark::State& state) { time_worst_leaf(state, suite); });
  register_sizes(suite, "mdhi/split", "samples", samples, [&suite](benchmark::State& state) {
    time_split(state, suite);
  })->UseManualTime();
}

}  // namespace penumbra::micro
