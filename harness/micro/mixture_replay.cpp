#include "harness/micro/mixture_replay.h"

#include <algorithm>
#include <cmath>

#include "estimators/mixture/estimates.h"
#include "harness/micro/checks.h"

namespace penumbra::micro {

std::unique_ptr<Replay> replay_mixture(BenchTile& tile, const EstimatorEntry& entry,
                                       const Budget& budget, std::uint64_t seed) {
  return std::make_unique<MixtureReplay>(tile, entry, budget, seed);
}

MixtureReplay::MixtureReplay(BenchTile& tile, const EstimatorEntry& entry, const Budget& budget,
                             std::uint64_t seed)
    : tile_(&tile),
      entry_(&entry),
      budget_(budget),
      seed_(seed),
      job_(tile.tile(replayed_spp(entry))),
      scratch_(*tile.scene, LightSampling::Area, false, most_samples(*tile.scene, budget),
               own_densities() ? Densities::Own : Densities::All),
      values_(tile.scene->sampled_lights().size() + 2),
      counts_(values_.size()) {
  const ParamSet params = default_params(entry);
  if (entry.name == "pmc_hi") settings_ = pmc_hi::read_settings(params);
  const std::unique_ptr<Estimator> estimator = entry.create(*tile.scene, params, budget);
  const PointSet variates(SamplerKind::Independent, StreamKey{}, kBlock);
  variates.fill(0, kBlock, true, variates_);
  read_points();
  add_rays(*estimator);
  read_records(*estimator);
  add_set_up();
  add_point_sets();
  add_draws();
  add_densities();
  add_lights_met();
  if (!own_densities()) add_mixture_pdfs();
  if (entry.name == "pmc_hi") add_pmc_hi();
  if (own_densities()) add_alsd();
  std::vector<double> expected;
  for (const Rgb& value : radiance_) expected.push_back(static_cast<double>(luminance(value)));
  fault = values_fault("estimates replayed and made", luminances_, expected, 1e-3, 1e-6);
}

void MixtureReplay::read_points() {
  const Scene& scene = *tile_->scene;
  for (int pixel = 0; pixel < job_.pixel_count(); ++pixel) {
    const ShadingPoint& point = job_.point(pixel, 0);
    AtPoint at{
        {}, {}, Frame(point.shading_normal), {scene.bsdf(point.material), Vec3(0.0f, 0.0f, 1.0f)}};
    at.bsdf = BoundBsdf(scene.bsdf(point.material), at.frame.to_local(point.wo));
    for (const std::uint32_t id : scene.sampled_lights()) {
      LightProposal proposal;
      if (scene.is_mirror(point.material) ||
          !proposal.set_up(scene.lights()[id], LightSampling::Area, point.position,
                           point.geometric_normal)) {
        continue;
      }
      at.lights.push_back(proposal);
      at.light_ids.push_back(id);
    }
    at.with_cone = may_be_occluded(at.light_ids, point);
    for (int s = 0; s < job_.spp; ++s) points_.push_back(at);
  }
  luminances_.resize(points_.size());
}

bool MixtureReplay::may_be_occluded(std::span<const std::uint32_t> lights,
                                    const ShadingPoint& point) const {
  return std::any_of(lights.begin(), lights.end(), [&](std::uint32_t light) {
    return tile_->scene->may_be_occluded(light, point);
  });
}

void MixtureReplay::read_records(Estimator& estimator) {
  const auto spp = static_cast<std::size_t>(job_.spp);
  std::vector<Rgb> radiance(job_.estimate_count());
  for (int pixel = 0; pixel < job_.pixel_count(); ++pixel) {
    EstimateRecorder recorder;
    recorder.pixel_in_tile = pixel;
    TileOutput out;
    out.radiance = radiance;
    out.recorder = &recorder;
    estimator.estimate(job_, seed_, out);
    for (const EstimateRecord& record : recorder.estimates) {
      StreamKey key;
      key.seed = seed_;
      key.pixel = job_.pixel_index(pixel);
      key.estimate = static_cast<std::uint32_t>(record.estimate);
      const std::size_t e =
          static_cast<std::size_t>(pixel) * spp + static_cast<std::size_t>(record.estimate);
      luminances_[e] = luminance(widen(record.delta));
      for (std::size_t t = 0; t < record.iterations.size(); ++t) read_iteration(record, e, t, key);
    }
  }
}

void MixtureReplay::read_iteration(const EstimateRecord& record, std::size_t estimate,
                                   std::size_t t, StreamKey key) {
  key.iteration = static_cast<std::uint32_t>(t);
  const IterationRecord& it = record.iterations[t];
  const float half_sine = std::sin(static_cast<float>(0.5 * it.cone_angle));
  const Cone cone{it.cone_axis, 2.0f * half_sine * half_sine};
  Population population{estimate, key, 0,      t + 1 == record.iterations.size(), it.alpha, {},
                        {},       {},  nullptr};
  for (std::size_t k = 0; k < it.counts.size(); ++k) {
    population.n += it.counts[k];
    if (it.counts[k] == 0) continue;
    drawn_.push_back({estimate, k, static_cast<std::uint32_t>(it.counts[k]), key, cone});
  }
  for (const int n : it.counts) {
    population.coefficients.push_back(static_cast<double>(n) / population.n);
  }
  weigh(population, cone, it.counts);
  double all_samples = 0.0;
  for (const IterationRecord& each : record.iterations) {
    for (const int n : each.counts) all_samples += n;
  }
  // With own densities the counts' expectations are in the weights; otherwise all samples count
  // alike.
  for (const double weight : population.weights) {
    luminances_[estimate] += own_densities() ? weight : weight / all_samples;
  }
  populations_.push_back(std::move(population));
  read_directions(record, estimate, t);
}

// Draws the samples again, with the same random numbers.
void MixtureReplay::weigh(Population& p, const Cone& cone, std::span<const int> counts) {
  const auto pixel = static_cast<int>(p.estimate) / job_.spp;
  p.mixture = std::make_unique<Mixture>(*tile_->scene, LightSampling::Area, false,
                                        static_cast<std::size_t>(p.n),
                                        own_densities() ? Densities::Own : Densities::All);
  Mixture& mixture = *p.mixture;
  mixture.set_up(job_.point(pixel, 0));
  if (cone.active()) mixture.cone() = cone;
  mixture.draw(budget_.sampler, p.key, counts);
  p.density.resize(mixture.size() + kLaneGroup);
  if (!own_densities()) mixture.mixture_pdfs_w(0, p.coefficients, p.density);
  for (std::size_t i = 0; i < mixture.size(); ++i) {
    if (own_densities()) {
      const auto light = static_cast<std::size_t>(mixture.component(i));
      p.density[i] = p.n * p.alpha[light] * static_cast<double>(mixture.own_pdf(i));
    }
    const double f = luminance(widen(mixture.f(i)));
    p.weights.push_back(f > 0.0 ? f / p.density[i] : 0.0);
  }
}

void MixtureReplay::read_directions(const EstimateRecord& record, std::size_t estimate,
                                    std::size_t t) {
  const AtPoint& at = points_[estimate];
  Directions* block = nullptr;
  for (const SampleRecord& sample : record.samples) {
    if (sample.iteration != static_cast<int>(t)) continue;
    if (block == nullptr || block->count == kBlock) {
      block = &directions_.emplace_back();
      block->estimate = estimate;
    }
    block->wi.set(block->count++, sample.wi);
    block->lights_only =
        block->lights_only && sample.component < static_cast<int>(at.lights.size());
    const bool survives = sample.fate == SampleFate::BlackBsdf || sample.fate == SampleFate::Dark ||
                          sample.fate == SampleFate::Lit;
    if (survives) block->survivor_local.set(block->survivors++, at.frame.to_local(sample.wi));
  }
}

}  // namespace penumbra::micro
