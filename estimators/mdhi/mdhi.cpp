// MDHI: multidimensional adaptive sampling of the hemispherical integral at one shading point.
//
// Idea: spread a few samples over the squares that parametrise the directions to the lights, divide
// the squares by a kd-tree, put each further sample into the leaf where values differ most for its
// area, and integrate the piecewise constant function that the leaves hold. Source: Hachisuka,
// Jarosz, Weistroffer, Dale, Humphreys, Zwicker and Jensen 2008, "Multidimensional adaptive
// sampling and reconstruction for ray tracing", ACM Transactions on Graphics 27(3).
//
// Equations, with charts k, maps u -> w of density h_k per steradian, leaves b of area V_b:
//   lights      I = sum_k int f_k/h_k du           f_k: light from light k alone
//   mixed       I = sum_k int f/sum_q h_q du       charts of the lights and of the BSDF
//   hemisphere  I = int pi Lin fr du               cosine-distributed directions
//   leaf mean   I ~ sum_b V_b/n_b sum_{i in b} g_i
// Leaf error, capacity and splits: leaf_tree.h. Anisotropic reconstruction: reconstruction.h.
// A mesh's triangle and a BSDF's lobe are taken from the first coordinate of the square, so that
// the integrand is a function of two variables.
//
// Budget at L lights that can contribute: srl_initial x L samples in equal numbers over the charts
// (the first ones take what is left over), then srl_adaptive x L one at a time, each in the leaf of
// the largest error over all charts. That is so for every domain: 48 samples of three charts,
// the BSDF's and those of two lights, are "12-12" and not "8-8". Samples that can not contribute
// are values of 0 without a ray.
//
// Random numbers, by (iteration, component): initial points (0, the light's scene index; the number
// of lights for the other charts) of the budget's sampler; candidate c of adaptive step i is point
// i x candidates + c of one independent set (1, number of lights + 1).
//
// Deviations from the paper, each with its reason:
//   one point at a time   no image axes: every estimator of this project works at a point.
//   uniform candidates    in the leaf's box; the paper's bounding sphere spills into neighbours.
//   leaf means            by default; gradients from the few samples at a point are mostly noise.
//   domain lights         by default; the literal hemisphere misses small lights altogether.
// Parameters with defaults: domain = lights, error = relative, contrast = luminance, candidates =
// 4, reconstruction = leaf_mean, light_sampling = area.
//
// Biased, consistent: sample positions depend on the values that they integrate, and a leaf's mean
// is not the mean over its area. Weak case: what the initial samples miss (a sliver of a light, a
// narrow lobe) stays unknown until the contrast of all other leaves has fallen to 1e-5, and
// refinement concentrates on the few hits. In the mixed domain that is the part of a small light
// that the BSDF's chart should give, however well the light's own chart knows it.

#include "estimators/mdhi/mdhi.h"

#include <algorithm>
#include <memory>

#include "estimators/mdhi/charts.h"
#include "estimators/mdhi/leaf_tree.h"
#include "estimators/mdhi/reconstruction.h"
#include "estimators/mixture/estimates.h"
#include "scenes/core/error.h"

namespace penumbra::mdhi {
namespace {

enum class Reconstruction : std::uint8_t { LeafMean, OnePerLeaf, Anisotropic };

Domain domain_of(const ParamSet& params) {
  const std::string& text = params.text("domain");
  if (text == "lights") return Domain::Lights;
  return text == "mixed" ? Domain::Mixed : Domain::Hemisphere;
}

Reconstruction reconstruction_of(const ParamSet& params) {
  const std::string& text = params.text("reconstruction");
  if (text == "leaf_mean") return Reconstruction::LeafMean;
  return text == "one_per_leaf" ? Reconstruction::OnePerLeaf : Reconstruction::Anisotropic;
}

LeafRules leaf_rules(const ParamSet& params) {
  return {.relative = params.text("error") == "relative",
          .per_channel = params.text("contrast") == "rgb"};
}

// A point of a chart with what its ray brought.
struct Sample {
  std::size_t chart{0};
  int step{0};  // 0: initial
  Vec2 u{0.0f};
  ChartPoint point;
  Rgb f{0.0f};
};

class Mdhi final : public Estimator {
 public:
  Mdhi(const Scene& scene, const ParamSet& params, const Budget& budget)
      : scene_(&scene),
        budget_(budget),
        candidates_(static_cast<std::uint32_t>(params.integer("candidates"))),
        reconstruction_(reconstruction_of(params)),
        charts_(scene, domain_of(params), light_sampling_of(params)),
        tree_(charts_.max_size(),
              scene.sampled_lights().size() * static_cast<std::size_t>(budget.srl()),
              leaf_rules(params)),
        exact_(scene),
        rays_(scene.sampled_lights().size() * static_cast<std::size_t>(budget.srl_initial)),
        cells_(0) {
    const std::size_t most = scene.sampled_lights().size() * static_cast<std::size_t>(budget.srl());
    samples_.reserve(most);
    weights_.resize(most);
    if (reconstruction_ != Reconstruction::Anisotropic) return;
    cells_ = AnisotropicCells(most);
    chart_samples_.reserve(most);
    positions_.reserve(most);
    luminances_.reserve(most);
    shares_.resize(most);
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    counters_ = {};
    clock_ = out.clock;
    std::size_t i = 0;
    for (int pixel = 0; pixel < tile.pixel_count(); ++pixel) {
      for (int s = 0; s < tile.spp; ++s, ++i) {
        StreamKey key;
        key.seed = seed;
        key.pixel = tile.pixel_index(pixel);
        key.estimate = static_cast<std::uint32_t>(s);
        const ShadingPoint& point = tile.point(pixel, s);
        out.radiance[i] = Rgb(0.0f);
        if (!point.valid()) continue;
        const SurfaceValues* const surface = tile.surface(pixel, s);
        enter_stage(clock_, EstimateStage::SetUp);
        ++counters_.estimates;
        EstimateRecord* record = out.recorder != nullptr ? out.recorder->begin(pixel, s) : nullptr;
        charts_.set_up(point, surface);
        if (exact_.possible()) {
          out.radiance[i] =
              exact_.radiance(point, charts_.frame(), charts_.bsdf(), counters_, record);
        }
        if (charts_.active_lights() > 0) out.radiance[i] += one_point(key);
        if (record != nullptr) write_record(*record);
      }
    }
    enter_stage(clock_, EstimateStage::Outside);
    out.counters += counters_;
  }

 private:
  Rgb one_point(StreamKey key) noexcept {
    enter_stage(clock_, EstimateStage::Adapt);
    const std::size_t lights = charts_.active_lights();
    tree_.reset(charts_.size());
    samples_.clear();
    draw_initial(key, lights * static_cast<std::size_t>(budget_.srl_initial));
    const auto steps =
        static_cast<std::uint32_t>(lights) * static_cast<std::uint32_t>(budget_.srl_adaptive);
    if (steps > 0) draw_adaptive(key, steps);
    counters_.samples += samples_.size();
    counters_.iterations += steps;
    enter_stage(clock_, EstimateStage::Weigh);
    reconstruct();
    RgbSum sum(0.0);
    for (std::size_t i = 0; i < samples_.size(); ++i) sum += tree_.value(i) * weights_[i];
    return narrow(sum);
  }

  // All charts' first samples in one batch; they enter the tree when their values are known.
  void draw_initial(StreamKey key, std::size_t total) noexcept {
    enter_stage(clock_, EstimateStage::Sample);
    key.iteration = 0;
    rays_.clear();
    VariateBlock variates;
    for (std::size_t chart = 0; chart < charts_.size(); ++chart) {
      const auto count = static_cast<std::uint32_t>(total / charts_.size() +
                                                    (chart < total % charts_.size() ? 1 : 0));
      key.component = charts_.stream(chart);
      const PointSet points(budget_.sampler, key, count);
      for (std::uint32_t done = 0; done < count;) {
        const std::uint32_t n = std::min(count - done, static_cast<std::uint32_t>(kBlock));
        points.fill(done, n, false, variates);
        for (std::uint32_t i = 0; i < n; ++i) add_sample(chart, 0, variates[i].u);
        done += n;
      }
    }
    trace(0);
    for (const Sample& sample : samples_) tree_.insert(sample.chart, sample.u, value(sample));
  }

  void draw_adaptive(StreamKey key, std::uint32_t steps) noexcept {
    key.iteration = 1;
    key.component = static_cast<std::uint32_t>(scene_->lights().size()) + 1;
    const PointSet points(SamplerKind::Independent, key, steps * candidates_);
    for (std::uint32_t step = 0; step < steps; ++step) {
      const std::size_t leaf = tree_.worst_leaf();
      const Vec2 u = best_candidate(points, step, leaf);
      enter_stage(clock_, EstimateStage::Sample);
      rays_.clear();
      add_sample(tree_.leaves()[leaf].chart, static_cast<int>(step) + 1, u);
      trace(samples_.size() - 1);
      tree_.insert_into(leaf, u, value(samples_.back()));
    }
  }

  // The candidate farthest from its nearest sample in the leaf; the first one in an empty leaf.
  Vec2 best_candidate(const PointSet& points, std::uint32_t step, std::size_t leaf) const noexcept {
    Vec2 best(0.0f);
    float farthest = -1.0f;
    for (std::uint32_t c = 0; c < candidates_; ++c) {
      const Vec2 u = tree_.point_in(leaf, points(step * candidates_ + c).u);
      const float distance = tree_.nearest_distance2(leaf, u);
      if (distance > farthest) {
        farthest = distance;
        best = u;
      }
    }
    return best;
  }

  // Makes a sample and, where it can contribute, its ray.
  void add_sample(std::size_t chart, int step, const Vec2& u) noexcept {
    samples_.push_back({chart, step, u, charts_.map(chart, u), Rgb(0.0f)});
    const ChartPoint& point = samples_.back().point;
    if (point.can_contribute()) rays_.add(charts_.origin(), point.wi);
  }

  // Traces the rays of samples [first, end).
  void trace(std::size_t first) noexcept {
    enter_stage(clock_, EstimateStage::Trace);
    scene_->intersect(rays_);
    enter_stage(clock_, EstimateStage::Sample);
    counters_.rays += rays_.size();
    counters_.untraced += rays_.untraced();
    std::size_t ray = 0;
    for (std::size_t i = first; i < samples_.size(); ++i) {
      Sample& sample = samples_[i];
      if (!sample.point.can_contribute()) continue;
      const RayHit& hit = rays_.hits[ray++];
      const std::int32_t light = charts_.light_met(sample.chart, sample.point.wi, hit,
                                                   scene_->emitter(hit, sample.point.wi));
      if (!charts_.sees(sample.chart, light)) continue;
      sample.point.fate = SampleFate::Lit;
      sample.f = sample.point.f_cos *
                 scene_->lights()[static_cast<std::size_t>(light)].radiance_along(sample.point.wi);
      counters_.lit += is_black(sample.f) ? 0u : 1u;
    }
    enter_stage(clock_, EstimateStage::Adapt);
  }

  // Integrand over the square.
  RgbSum value(const Sample& sample) noexcept {
    if (is_black(sample.f)) return RgbSum(0.0);
    if (!(sample.point.density > 0.0)) {
      ++counters_.uncovered;
      return RgbSum(0.0);
    }
    return widen(sample.f) * (1.0 / sample.point.density);
  }

  // Area of its chart that each sample stands for.
  void reconstruct() noexcept {
    if (reconstruction_ == Reconstruction::Anisotropic) {
      for (std::size_t chart = 0; chart < charts_.size(); ++chart) reconstruct_anisotropic(chart);
      return;
    }
    if (reconstruction_ == Reconstruction::OnePerLeaf) tree_.split_down_to(1);
    tree_.leaf_mean_weights(weights_);
  }

  void reconstruct_anisotropic(std::size_t chart) noexcept {
    chart_samples_.clear();
    positions_.clear();
    luminances_.clear();
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (samples_[i].chart != chart) continue;
      chart_samples_.push_back(i);
      positions_.push_back(samples_[i].u);
      luminances_.push_back(luminance(tree_.value(i)));
    }
    const std::span<double> shares = std::span(shares_).first(positions_.size());
    cells_.shares(positions_, luminances_, shares);
    for (std::size_t i = 0; i < shares.size(); ++i) weights_[chart_samples_[i]] = shares[i];
  }

  // What was done at the point; the light of deltas is there already.
  void write_record(EstimateRecord& record) const {
    record.components.clear();
    if (charts_.active_lights() == 0) return;
    for (std::size_t k = 0; k < charts_.size(); ++k) record.components.push_back(charts_.name(k));
    record.iterations.resize(static_cast<std::size_t>(samples_.back().step) + 1);
    for (IterationRecord& it : record.iterations) it.counts.assign(charts_.size(), 0);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Sample& sample = samples_[i];
      const bool lit = sample.point.fate == SampleFate::Lit;
      SampleRecord& to = record.samples.emplace_back();
      to.iteration = sample.step;
      to.component = static_cast<int>(sample.chart);
      to.wi = sample.point.wi;
      to.pdfs = charts_.all_pdfs(sample.chart, sample.point);
      to.own_pdf = sample.point.own_pdf;
      to.f = sample.f;
      to.weight = sample.point.density > 0.0 ? weights_[i] / sample.point.density : 0.0;
      to.fate = sample.point.fate;
      IterationRecord& it = record.iterations[static_cast<std::size_t>(sample.step)];
      ++it.counts[sample.chart];
      it.rays += lit || sample.point.can_contribute() ? 1 : 0;
      it.hits += lit && !is_black(sample.f) ? 1 : 0;
    }
    record.notes.push_back(std::to_string(tree_.leaves().size()) + " leaves in " +
                           std::to_string(charts_.size()) + " charts");
  }

  const Scene* scene_;
  Budget budget_;
  std::uint32_t candidates_;
  Reconstruction reconstruction_;
  Charts charts_;
  LeafTree tree_;
  ExactLight exact_;
  RayBatch rays_;
  AnisotropicCells cells_;
  EstimateCounters counters_;
  StageClock* clock_{nullptr};

  // Of the current point.
  std::vector<Sample> samples_;  // numbered as in the tree
  std::vector<double> weights_;  // [sample], areas of the square

  // Of one chart, for the anisotropic reconstruction.
  std::vector<std::size_t> chart_samples_;
  std::vector<Vec2> positions_;
  std::vector<double> luminances_;
  std::vector<double> shares_;
};

ParamSpec text(std::string name, std::vector<std::string> choices, std::string doc) {
  ParamSpec spec{.name = std::move(name), .default_value = choices.front(), .doc = std::move(doc)};
  spec.choices = std::move(choices);
  return spec;
}

std::span<const ParamSpec> params() {
  static const std::vector<ParamSpec> table = {
      text("domain", {"lights", "mixed", "hemisphere"},
           "squares that are sampled: one per light; these and one of the BSDF; or one of the "
           "cosine-weighted hemisphere"),
      text("error", {"relative", "absolute"},
           "deviations from a leaf's mean, as a share of the mean or as they are"),
      text("contrast", {"luminance", "rgb"}, "deviations of luminance, or of the channels, added"),
      {.name = "candidates",
       .default_value = std::int64_t{4},
       .doc = "positions tried for an adaptive sample; the one farthest from all others is taken",
       .choices = {},
       .min = 1,
       .max = 64},
      text("reconstruction", {"leaf_mean", "one_per_leaf", "aniso"},
           "function that is integrated: mean of each leaf, with or without splitting down to one "
           "sample, or nearest sample by structure tensors"),
      light_sampling_param(),
  };
  return table;
}

std::string bias_reason(const ParamSet&) {
  return "sample positions depend on the values that they integrate";
}

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  const int needed = params.text("domain") == "mixed" ? 2 : 1;
  if (budget.srl_initial < needed) {
    throw InputError("mdhi: domain = " + params.text("domain") + " needs at least " +
                     std::to_string(needed) +
                     " initial shadow rays per light, for a sample in every chart, found " +
                     std::to_string(budget.srl_initial));
  }
  // The candidates of an estimate are points of one set, which 32 bits number.
  const double candidates = static_cast<double>(params.integer("candidates")) *
                            static_cast<double>(budget.srl_adaptive) *
                            static_cast<double>(scene.lights().size());
  if (candidates > 4294967295.0) {
    throw InputError("mdhi: candidates x adaptive shadow rays x lights = " +
                     std::to_string(candidates) + ", at most 4294967295 are allowed");
  }
  return std::make_unique<Mdhi>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "mdhi",
    .summary = "adaptive kd-trees over the squares of directions to each light, leaf means",
    .citation =
        "Hachisuka et al. 2008, Multidimensional adaptive sampling and reconstruction for ray "
        "tracing",
    .adaptive = true,
    .min_srl = 2,
    .params = params,
    .bias_reason = bias_reason,
    .bias_fixture = 'B',
    .create = create,
};

}  // namespace penumbra::mdhi
