// ALSD: adaptive light sampling for distributed-ray tracing, in two passes over the image.
//
// Idea: estimate every point of an 8x8 block of pixels with all lights equally likely, note how
// much each light contributed in the pixel and in the block, and estimate the block again with the
// lights' probabilities learned from that. Source: Donikian, Walter, Bala, Fernandez and Greenberg
// 2006, "Accurate direct illumination using iterative adaptive sampling", IEEE TVCG 12(3). The
// reduction to two passes is that of Lai et al. 2014, Table 1 ("N1-N2").
//
// Equations, with n = SRL x lights that can contribute at the point:
//   estimate        F = sum_j f_l(w_j) / (n P_l h_l(w_j)), light from the chosen light l only
//   evidence        C_pixel(l) = sum over pass 1 of the luminance of light l's part of F;
//                   C_block(l) = sum of C_pixel(l) over the block
//   probabilities   P = w_u U + w_b C_block/sum + w_p C_pixel/sum, over the lights that can
//                   contribute; pass 1: P = U = 1/lights
//   weights         w_u = uniform_weight; w_p = (1 - w_u) n_pixel/(n_pixel + kappa) with n_pixel
//   the
//                   samples of pass 1 in the pixel; w_b the rest. No light seen in the pixel: w_b
//                   takes w_p. None in the block: P = U.
// Lights are chosen by systematic sampling of P with one offset, points are stratified within each.
//
// Deviations: the article's confidence rules and termination test are not reproduced; both passes
// have a fixed length (first_pass of the estimates of a pixel), so that they are weighted by fixed
// numbers. Evidence is luminance of unbiased contributions, not counts of hits. Delta lights are
// added exactly, with a ray each, as by every estimator here.
// Parameters: uniform_weight = 0.2, kappa = 64, first_pass = 0.5, light_sampling = area.
//
// Unbiased while uniform_weight > 0: pass 2 has random numbers of its own, and given pass 1 every
// light keeps a positive probability. Weak case: glossy reflections, which light sampling does not
// find; two lights, where a better choice gains a factor of 2 at most.

#include "estimators/alsd/alsd.h"

#include <algorithm>
#include <memory>

#include "estimators/alsd/evidence.h"
#include "estimators/mixture/estimates.h"

namespace penumbra::alsd {
namespace {

constexpr int kBlockSide = 8;  // [pixels]

class Alsd final : public Estimator {
 public:
  Alsd(const Scene& scene, const ParamSet& params, const Budget& budget)
      : budget_(budget),
        first_pass_(params.real("first_pass")),
        scene_(&scene),
        mixture_(scene, light_sampling_of(params), false, most_samples(scene, budget),
                 Densities::Own),
        // A lone light has the probability 1 whatever is learned.
        learns_(scene.sampled_lights().size() > (scene.keep_all() ? 0 : 1)),
        evidence_(scene.lights().size(), learns_ ? kBlockSide * kBlockSide : 0,
                  {params.real("uniform_weight"), params.real("kappa")}),
        pmf_(scene.lights().size(), 1.0),
        counts_(scene.sampled_lights().size() + 2),
        expected_(counts_.size()) {}

  std::vector<MapInfo> maps() const override {
    std::vector<MapInfo> maps;
    for (const Light& light : scene_->lights()) {
      if (light.is_delta()) continue;
      maps.push_back({"p_" + light.name, "probability of a light in the second pass"});
    }
    return maps;
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    mixture_.counters() = {};
    mixture_.set_clock(out.clock);
    for (int y = 0; y < tile.height; y += kBlockSide) {
      for (int x = 0; x < tile.width; x += kBlockSide) one_block(tile, seed, x, y, out);
    }
    mixture_.counters().iterations = mixture_.counters().estimates;
    mixture_.enter(EstimateStage::Outside);
    out.counters += mixture_.counters();
  }

 private:
  // Both passes over the block whose first pixel is (x0, y0) of the tile.
  void one_block(const Tile& tile, std::uint64_t seed, int x0, int y0, TileOutput& out) noexcept {
    const int width = std::min(kBlockSide, tile.width - x0);
    const int height = std::min(kBlockSide, tile.height - y0);
    const int first_pass = std::clamp(static_cast<int>(first_pass_ * tile.spp + 0.5), 1, tile.spp);
    evidence_.clear();
    for (int i = 0; i < width * height; ++i) {
      const int pixel = (y0 + i / width) * tile.width + x0 + i % width;
      for (int s = 0; s < first_pass; ++s) {
        estimate_one(mixture_, tile, seed, pixel, s, out,
                     [&](const StreamKey& key) { return first_estimate(key, i); });
      }
    }
    mixture_.enter(EstimateStage::Adapt);
    evidence_.finish();
    for (int i = 0; i < width * height; ++i) {
      const int pixel = (y0 + i / width) * tile.width + x0 + i % width;
      mixture_.enter(EstimateStage::Adapt);
      if (learns_) evidence_.probabilities(i, pmf_);
      write_maps(tile, pixel, out);
      for (int s = first_pass; s < tile.spp; ++s) {
        estimate_one(mixture_, tile, seed, pixel, s, out,
                     [&](const StreamKey& key) { return second_estimate(key); });
      }
    }
  }

  Rgb first_estimate(const StreamKey& key, int pixel_in_block) noexcept {
    const auto lights = static_cast<std::size_t>(mixture_.active_lights());
    const std::span<double> pmf = std::span(chosen_).first(lights);
    std::fill(pmf.begin(), pmf.end(), 1.0 / static_cast<double>(lights));
    const RgbSum sum = chosen_lights_estimate(mixture_, budget_, key, pmf, counts_, expected_);
    if (learns_) {
      mixture_.enter(EstimateStage::Adapt);
      evidence_.add_estimate(pixel_in_block, mixture_, expected_,
                             budget_.srl() * static_cast<int>(lights));
    }
    return narrow(sum);
  }

  Rgb second_estimate(const StreamKey& key) noexcept {
    const auto lights = static_cast<std::size_t>(mixture_.active_lights());
    const std::span<double> pmf = std::span(chosen_).first(lights);
    mixture_.enter(EstimateStage::Adapt);
    // The pixel's probabilities, over the lights that can contribute at this point.
    double total = 0.0;
    for (std::size_t l = 0; l < lights; ++l) {
      pmf[l] = pmf_[mixture_.light_index(static_cast<int>(l))];
      total += pmf[l];
    }
    // Without a uniform share, all of them can have lost their probability.
    if (!(total > 0.0)) return Rgb(0.0f);
    for (double& p : pmf) p /= total;
    return narrow(chosen_lights_estimate(mixture_, budget_, key, pmf, counts_, expected_));
  }

  void write_maps(const Tile& tile, int pixel, TileOutput& out) noexcept {
    if (out.maps.empty()) return;
    auto* at = &out.maps[static_cast<std::size_t>(pixel) * out.maps.size() /
                         static_cast<std::size_t>(tile.pixel_count())];
    for (int s = 0; s < tile.spp; ++s) {
      for (std::size_t l = 0; l < pmf_.size(); ++l) {
        if (!scene_->lights()[l].is_delta()) *at++ = static_cast<float>(pmf_[l]);
      }
    }
  }

  Budget budget_;
  double first_pass_;
  const Scene* scene_;
  Mixture mixture_;
  bool learns_;
  Evidence evidence_;
  std::vector<double> pmf_;  // [scene light], of the pixel
  std::vector<double> chosen_ = std::vector<double>(scene_->lights().size());  // [active light]
  std::vector<int> counts_;
  std::vector<double> expected_;
};

std::span<const ParamSpec> params() {
  static const std::vector<ParamSpec> specs = {
      light_sampling_param(),
      {.name = "uniform_weight",
       .default_value = 0.2,
       .doc = "share of equal probabilities in the second pass; 0 loses lights",
       .min = 0.0,
       .max = 1.0},
      {.name = "kappa",
       .default_value = 64.0,
       .doc = "samples in a pixel at which its own evidence weighs as much as its block's",
       .min = 0.0,
       .max = 1e9},
      {.name = "first_pass",
       .default_value = 0.5,
       .doc = "share of a pixel's estimates in the first pass, at least one",
       .min = 0.0,
       .max = 1.0},
  };
  return specs;
}

std::string bias_reason(const ParamSet& params) {
  return params.real("uniform_weight") > 0.0 ? ""
                                             : "a light without evidence is never sampled again";
}

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  return std::make_unique<Alsd>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "alsd",
    .summary = "light sampling in two passes, probabilities learned in 8x8 blocks of pixels",
    .citation =
        "Donikian, Walter, Bala, Fernandez and Greenberg 2006, Accurate direct illumination using "
        "iterative adaptive sampling",
    .shares_in_tile = true,
    .params = params,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::alsd
