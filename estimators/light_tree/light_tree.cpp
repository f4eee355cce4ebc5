// Light sampling for scenes of many lights: a few samples, aimed at the lights that matter.
//
// Idea: sort the lights into a tree whose nodes bound where lights are, where they face and how
// much they emit; cut it finely near the point and coarsely far away; share the samples out over
// the cut's nodes and walk down from each, with probabilities in proportion to an estimate of what
// arrives. Source: Conty Estevez and Kulla 2018, "Importance sampling of many lights with adaptive
// tree splitting". The weights here are this project's own: distances enter as ratios, so that the
// unit of length has no influence, and nodes of the cut are also weighted by what the BSDF
// reflects from there.
//
// Equations, with n samples and P_l the product of the shares on the way to light l:
//   F = sum_l sum_j f_l(w_lj) / (n P_l h_l(w_lj)),    n_l samples of l with E[n_l] = n P_l,
// where f_l is the light that arrives from l alone and h_l the density of directions towards it.
//
// All n samples go down together: nodes divide them by systematic sampling with one offset, so that
// n_l differs from n P_l by less than 1 and neighbours in the tree share the rounding. A light far
// above the rest gets several samples, and groups of distant lights share one. The time of an
// estimate grows with the cut and n log L; only chosen lights are set up.
//
// The environment has no place in a tree: it gets its share of the samples before the cut, in
// proportion to its irradiance against the cut's importance, within [1/8, 7/8].
//
// Parameters: samples = 32, split = 4 radii, light_sampling = solid_angle.
// Unbiased: importance is 0 only where no light below the node can contribute (tree.h), and the
// weights of a cut keep a share of it. Weak case: occlusion is not known to the tree; few lights,
// where all of them can be sampled; nearly specular surfaces, whose highlights are narrower than
// nodes.

#include "estimators/light_tree/light_tree.h"

#include <memory>

#include "estimators/light_tree/cut_weights.h"
#include "estimators/light_tree/tree.h"
#include "estimators/mixture/chosen_lights.h"

namespace penumbra::light_tree {
namespace {

// Least share of the samples of the environment and of the tree where both can contribute.
constexpr double kLeastShare = 0.125;

// Lights of the tree. Where a scene keeps all, black ones too.
std::vector<std::uint32_t> members_of(const Scene& scene) {
  std::vector<std::uint32_t> members;
  for (const std::uint32_t id : scene.sampled_lights()) {
    const Light& light = scene.lights()[id];
    if (light.type == LightType::Environment) continue;
    if (is_black(light.radiance) && !scene.keep_all()) continue;
    members.push_back(id);
  }
  return members;
}

class LightTree final : public Estimator {
 public:
  LightTree(const Scene& scene, const ParamSet& params, const Budget& budget)
      : scene_(&scene),
        lights_(scene, light_sampling_of(params), budget.sampler,
                limited_samples(scene, budget, params.integer("samples"))),
        split_(static_cast<float>(params.real("split"))),
        tree_(scene.lights(), members_of(scene), scene.keep_all()),
        weights_(scene.lights().size()) {
    cut_.reserve(scene.lights().size());
    if (scene.environment_light() == kNoLight) return;
    // Half of the sphere is above the horizon, at a mean cosine of a half.
    environment_irradiance_ = 0.25 * luminance(environment().power());
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    lights_.estimate(
        tile, seed, out,
        [this](const ShadingPoint& point, const SurfaceValues* surface, double offset,
               std::vector<ChosenLight>& chosen) { choose(point, surface, offset, chosen); });
  }

 private:
  const Environment& environment() const noexcept {
    return scene_->lights()[static_cast<std::size_t>(scene_->environment_light())].environment;
  }

  // Share of the samples that the environment gets.
  double environment_share(const ShadingPoint& point) const noexcept {
    if (scene_->environment_light() == kNoLight) return 0.0;
    // Where all is kept, the tree's importance is that of lights anywhere and has no measure.
    if (scene_->keep_all()) return cut_.empty() ? 1.0 : 0.5;
    if (!environment().can_light(point.geometric_normal)) return 0.0;
    double of_tree = 0.0;
    for (const CutNode& node : cut_) of_tree += static_cast<double>(node.importance);
    if (!(of_tree > 0.0)) return 1.0;
    const double share = environment_irradiance_ / (environment_irradiance_ + of_tree);
    return std::clamp(share, kLeastShare, 1.0 - kLeastShare);
  }

  void choose(const ShadingPoint& point, const SurfaceValues* surface, double offset,
              std::vector<ChosenLight>& chosen) noexcept {
    tree_.cut(point.position, point.geometric_normal, split_, cut_);
    const int n = lights_.samples();
    Rest rest{n, offset};
    const double of_sky = n * environment_share(point);
    const int sky = rest.take(of_sky);
    if (sky > 0) {
      chosen.push_back({static_cast<std::uint32_t>(scene_->environment_light()), sky, of_sky});
    }
    if (cut_.empty()) return;
    const double per_weight =
        (n - of_sky) / weights_.set(point, scene_->bsdf_at(point.material, surface), tree_, cut_);
    for (std::size_t i = 0; i < cut_.size() && rest.count > 0; ++i) {
      const double expected = per_weight * weights_[i];
      Rest part = rest;
      if (i + 1 < cut_.size()) part.count = rest.take(expected);
      tree_.walk(point.position, point.geometric_normal, cut_[i].node, expected, part,
                 [&](std::uint32_t light, int count, double of_light) {
                   chosen.push_back({light, count, of_light});
                 });
    }
  }

  const Scene* scene_;
  ChosenLights lights_;
  float split_;
  Tree tree_;
  std::vector<CutNode> cut_;
  CutWeights weights_;
  double environment_irradiance_{0.0};  // luminance [W/m^2]
};

std::span<const ParamSpec> params() {
  static const std::vector<ParamSpec> specs = {
      samples_param(32),
      {.name = "split",
       .default_value = 4.0,
       .doc = "nodes nearer than this many of their radii are split before the choice; 0: none",
       .min = 0.0,
       .max = 1e6},
      light_sampling_param(LightSampling::SolidAngle),
  };
  return specs;
}

std::string bias_reason(const ParamSet&) { return {}; }

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  return std::make_unique<LightTree>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "light_tree",
    .summary = "few samples among many lights, chosen by a tree of bounds",
    .citation =
        "Conty Estevez and Kulla 2018, Importance sampling of many lights with adaptive tree "
        "splitting",
    .params = params,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::light_tree
