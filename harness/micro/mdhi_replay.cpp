#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "estimators/mdhi/charts.h"
#include "estimators/mdhi/leaf_tree.h"
#include "estimators/mixture/sums.h"
#include "harness/micro/checks.h"
#include "harness/micro/replay.h"
#include "scenes/core/error.h"

namespace penumbra::micro {
namespace {

// mdhi with its default parameters: one chart per light, best of four candidates, leaf means.
class MdhiReplay final : public Replay {
 public:
  MdhiReplay(BenchTile& tile, const EstimatorEntry& entry, const Budget& budget, std::uint64_t seed)
      : scene_(tile.scene.get()),
        budget_(budget),
        points_(tile.points),
        charts_(*scene_, mdhi::Domain::Lights, LightSampling::Area),
        tree_(charts_.max_size(), most(), {}),
        weights_(most()),
        ray_(most()) {
    const ParamSet params = default_params(entry);
    PN_CHECK(params.text("domain") == "lights" && params.text("reconstruction") == "leaf_mean",
             "the defaults are what is replayed");
    candidates_ = static_cast<std::uint32_t>(params.integer("candidates"));
    const std::unique_ptr<Estimator> estimator = entry.create(*scene_, params, budget);
    const Tile job = tile.tile(replayed_spp(entry));
    std::vector<Rgb> radiance;
    recorded_ = RecordedRays(tile, *estimator, job, seed, radiance);
    std::vector<double> found, expected;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      StreamKey key;
      key.seed = seed;
      key.pixel = job.pixel_index(static_cast<int>(i));
      found.push_back(make_estimate(points_[i], key));
      expected.push_back(static_cast<double>(luminance(radiance[i])));
    }
    fault = values_fault("estimates replayed and made", found, expected, 1e-3, 1e-6);
    add_kernels();
  }

 private:
  struct Sample {
    std::size_t chart;
    Vec2 u;
    Vec3d value;
  };
  struct Made {
    ShadingPoint point;
    StreamKey key;
    std::size_t charts;
    std::size_t initial;
    std::vector<Sample> samples;
    std::vector<Vec2> candidates;
  };

  std::size_t most() const {
    return scene_->sampled_lights().size() * static_cast<std::size_t>(budget_.srl());
  }

  // Points of the charts before anything is known.
  template <typename Visit>
  void initial_points(const Made& made, Visit visit) {
    StreamKey key = made.key;
    const std::size_t total = made.charts * static_cast<std::size_t>(budget_.srl_initial);
    for (std::size_t chart = 0; chart < made.charts; ++chart) {
      const auto count = static_cast<std::uint32_t>(total / made.charts);
      key.component = made.charts == charts_.size() ? charts_.stream(chart) : 0;
      const PointSet points(budget_.sampler, key, count);
      for (std::uint32_t done = 0; done < count;) {
        const auto n = std::min(count - done, static_cast<std::uint32_t>(kBlock));
        points.fill(done, n, false, variates_);
        for (std::uint32_t i = 0; i < n; ++i) visit(chart, variates_[i].u);
        done += n;
      }
    }
  }

  template <typename Visit>
  void candidate_points(const Made& made, Visit visit) {
    StreamKey key = made.key;
    key.iteration = 1;
    key.component = static_cast<std::uint32_t>(scene_->lights().size()) + 1;
    const auto count = static_cast<std::uint32_t>(made.charts) *
                       static_cast<std::uint32_t>(budget_.srl_adaptive) * candidates_;
    if (count == 0) return;
    const PointSet points(SamplerKind::Independent, key, count);
    for (std::uint32_t i = 0; i < count; ++i) visit(points(i).u);
  }

  Vec2 best_candidate(std::size_t leaf, const Vec2* candidates) const {
    Vec2 best(0.0f);
    float farthest = -1.0f;
    for (std::uint32_t c = 0; c < candidates_; ++c) {
      const Vec2 u = tree_.point_in(leaf, candidates[c]);
      const float distance = tree_.nearest_distance2(leaf, u);
      if (distance > farthest) {
        farthest = distance;
        best = u;
      }
    }
    return best;
  }

  Vec3d value_at(std::size_t chart, const Vec2& u) {
    const mdhi::ChartPoint point = charts_.map(chart, u);
    if (!point.can_contribute()) return Vec3d(0.0);
    ray_.clear();
    ray_.add(charts_.origin(), point.wi);
    scene_->intersect(ray_);
    const std::int32_t light =
        charts_.light_met(chart, point.wi, ray_.hits[0], scene_->emitter(ray_.hits[0], point.wi));
    if (!charts_.sees(chart, light)) return Vec3d(0.0);
    const Light& source = scene_->lights()[static_cast<std::size_t>(light)];
    return widen(point.f_cos * source.radiance_along(point.wi)) * (1.0 / point.density);
  }

  // The tree of an estimate; values are asked for where they are not known.
  template <typename Value>
  void grow(const Made& made, Value value) {
    tree_.reset(made.charts);
    for (std::size_t i = 0; i < made.initial; ++i) {
      const Sample& sample = made.samples[i];
      tree_.insert(sample.chart, sample.u, sample.value);
    }
    const std::size_t steps = made.candidates.size() / candidates_;
    for (std::size_t step = 0; step < steps; ++step) {
      const std::size_t leaf = tree_.worst_leaf();
      const Vec2 u = best_candidate(leaf, &made.candidates[step * candidates_]);
      tree_.insert_into(leaf, u, value(made.initial + step, tree_.leaves()[leaf].chart, u));
    }
    tree_.leaf_mean_weights(weights_);
  }

  // @return luminance
  double make_estimate(const ShadingPoint& point, const StreamKey& key) {
    charts_.set_up(point);
    Made& made = made_.emplace_back();
    made.point = point;
    made.key = key;
    made.charts = charts_.active_lights();
    if (made.charts == 0) return 0.0;
    initial_points(made, [&](std::size_t chart, const Vec2& u) {
      made.samples.push_back({chart, u, value_at(chart, u)});
    });
    made.initial = made.samples.size();
    candidate_points(made, [&](const Vec2& u) { made.candidates.push_back(u); });
    grow(made, [&](std::size_t, std::size_t chart, const Vec2& u) {
      made.samples.push_back({chart, u, value_at(chart, u)});
      return made.samples.back().value;
    });
    double sum = 0.0;
    for (std::size_t i = 0; i < made.samples.size(); ++i) {
      sum += luminance(made.samples[i].value * weights_[i]);
    }
    return sum;
  }

  void add_kernels() {
    const std::size_t estimates = made_.size();
    std::size_t drawn = 0, variates = 0;
    for (const Made& made : made_) {
      drawn += made.samples.size();
      variates += made.initial + made.candidates.size();
    }
    samples = static_cast<double>(drawn) / static_cast<double>(estimates);
    rays = static_cast<double>(recorded_.size()) / static_cast<double>(estimates * kReplayedSeeds);
    add("rays", "ray", recorded_.size(), estimates * kReplayedSeeds,
        [this] { recorded_.trace(*scene_); });
    add("point: lights, BSDF", "point", estimates, estimates, [this] {
      for (const Made& made : made_) charts_.set_up(made.point);
    });
    add("sampler", "sample", variates, estimates, [this] {
      Vec2 last(0.0f);
      for (const Made& made : made_) {
        initial_points(made, [&](std::size_t, const Vec2& u) { last += u; });
        candidate_points(made, [&](const Vec2& u) { last += u; });
      }
      benchmark::DoNotOptimize(last);
    });
    add_map(drawn, estimates);
    add("adapt: trees", "sample", drawn, estimates, [this] {
      for (const Made& made : made_) {
        if (made.charts == 0) continue;
        grow(made, [&](std::size_t i, std::size_t, const Vec2&) { return made.samples[i].value; });
      }
      benchmark::DoNotOptimize(weights_.data());
    });
  }

  // With charts of its own for every point, bound before.
  void add_map(std::size_t drawn, std::size_t estimates) {
    for (const Made& made : made_) {
      mdhi::Charts& charts =
          bound_.emplace_back(*scene_, mdhi::Domain::Lights, LightSampling::Area);
      charts.set_up(made.point);
    }
    add("light sample, f and pdf", "sample", drawn, estimates, [this] {
      for (std::size_t i = 0; i < made_.size(); ++i) {
        for (const Sample& sample : made_[i].samples) {
          benchmark::DoNotOptimize(bound_[i].map(sample.chart, sample.u));
        }
      }
    });
  }

  const Scene* scene_;
  Budget budget_;
  std::vector<ShadingPoint> points_;
  std::uint32_t candidates_{0};
  mdhi::Charts charts_;
  std::vector<mdhi::Charts> bound_;
  mdhi::LeafTree tree_;
  std::vector<double> weights_;
  RayBatch ray_;
  VariateBlock variates_;
  std::vector<Made> made_;
  RecordedRays recorded_;
};

}  // namespace

std::unique_ptr<Replay> replay_mdhi(BenchTile& tile, const EstimatorEntry& entry,
                                    const Budget& budget, std::uint64_t seed) {
  return std::make_unique<MdhiReplay>(tile, entry, budget, seed);
}

}  // namespace penumbra::micro
