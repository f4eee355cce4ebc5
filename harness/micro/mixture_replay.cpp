#include "harness/micro/mixture_replay.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>

#include "estimators/mixture/estimates.h"
#include "estimators/pmc_hi/adaptation.h"
#include "harness/micro/checks.h"
#include "scenes/core/warp.h"

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
    AtPoint at{{}, Frame(point.shading_normal), {scene.bsdf(point.material), point.shading_normal}};
    at.bsdf = BoundBsdf(scene.bsdf(point.material), at.frame.to_local(point.wo));
    for (const std::uint32_t id : scene.sampled_lights()) {
      LightProposal proposal;
      if (scene.is_mirror(point.material) ||
          !proposal.set_up(scene.lights()[id], LightSampling::Area, point.position,
                           point.geometric_normal)) {
        continue;
      }
      at.lights.push_back(proposal);
      at.with_cone = at.with_cone || scene.may_be_occluded(id, point);
    }
    for (int s = 0; s < job_.spp; ++s) points_.push_back(at);
  }
  luminances_.resize(points_.size());
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

void MixtureReplay::add_set_up() {
  add("point: lights, BSDF", "point", points_.size(), points_.size(), [this] {
    for (int pixel = 0; pixel < job_.pixel_count(); ++pixel) {
      for (int s = 0; s < job_.spp; ++s) scratch_.set_up(job_.point(pixel, s));
    }
    benchmark::DoNotOptimize(&scratch_);
  });
}

void MixtureReplay::add_point_sets() {
  std::size_t count = 0;
  for (const Drawn& drawn : drawn_) count += drawn.count;
  samples = static_cast<double>(count) / static_cast<double>(points_.size());
  add("sampler", "sample", count, points_.size(), [this] {
    for (const Drawn& drawn : drawn_) {
      StreamKey key = drawn.key;
      key.component = static_cast<std::uint32_t>(drawn.component);
      const AtPoint& at = points_[drawn.estimate];
      const bool with_choice =
          is_light(drawn) ? at.lights[drawn.component].uses_choice() : at.bsdf.uses_choice();
      const PointSet points(budget_.sampler, key, drawn.count);
      for (std::uint32_t done = 0; done < drawn.count;) {
        const auto n = std::min(drawn.count - done, static_cast<std::uint32_t>(kBlock));
        points.fill(done, n, with_choice, variates_);
        done += n;
      }
    }
    benchmark::DoNotOptimize(&variates_);
    benchmark::ClobberMemory();
  });
}

// One component's directions, a block at a time.
void MixtureReplay::draw(const Drawn& drawn) {
  const AtPoint& at = points_[drawn.estimate];
  for (std::uint32_t done = 0; done < drawn.count; done += kBlock) {
    const std::size_t n = std::min(drawn.count - done, static_cast<std::uint32_t>(kBlock));
    if (is_light(drawn)) {
      at.lights[drawn.component].sample(variates_, n, 0, wi_, pdf_);
    } else if (!is_cone(drawn)) {
      at.bsdf.sample(variates_, n, 0, wi_);
    } else {
      const Frame about_axis(drawn.cone.axis);
      for (std::size_t i = 0; i < n; ++i) {
        const Vec3 local = sample_uniform_cone(variates_[i].u, drawn.cone.one_minus_cos);
        wi_.set(i, about_axis.to_world(local).normalized());
      }
    }
  }
}

void MixtureReplay::add_draws() {
  const auto add_kind = [this](const char* name, auto wanted) {
    std::size_t count = 0;
    for (const Drawn& drawn : drawn_) count += wanted(drawn) ? drawn.count : 0;
    add(name, "sample", count, points_.size(), [this, wanted] {
      for (const Drawn& drawn : drawn_) {
        if (wanted(drawn)) draw(drawn);
      }
      benchmark::DoNotOptimize(&wi_);
      benchmark::ClobberMemory();
    });
  };
  add_kind("light sample", [this](const Drawn& drawn) { return is_light(drawn); });
  add_kind("BSDF sample",
           [this](const Drawn& drawn) { return !is_light(drawn) && !is_cone(drawn); });
  add_kind("cone sample", [this](const Drawn& drawn) { return is_cone(drawn); });
}

void MixtureReplay::add_densities() {
  const auto wanted = [this](const Directions& d) { return !own_densities() || !d.lights_only; };
  std::size_t pdfs = 0;
  std::size_t values = 0;
  for (const Directions& d : directions_) {
    if (wanted(d)) pdfs += d.count * points_[d.estimate].lights.size();
    values += d.survivors;
  }
  add("light pdf", "pdf", pdfs, points_.size(), [this, wanted] {
    for (const Directions& d : directions_) {
      if (!wanted(d)) continue;
      for (const LightProposal& light : points_[d.estimate].lights) {
        light.pdf_w(d.wi, d.count, pdf_);
      }
    }
    benchmark::DoNotOptimize(&pdf_);
    benchmark::ClobberMemory();
  });
  add("BSDF f and pdf", "sample", values, points_.size(), [this] {
    for (const Directions& d : directions_) {
      points_[d.estimate].bsdf.evaluate(d.survivor_local, d.survivors, f_cos_, pdf_);
    }
    benchmark::DoNotOptimize(&f_cos_);
    benchmark::ClobberMemory();
  });
}

void MixtureReplay::add_rays(Estimator& estimator) {
  batches_ = recorded_rays(*tile_, estimator, job_, seed_, radiance_);
  std::size_t count = 0;
  for (const RayBatch& batch : batches_) count += batch.size();
  rays = static_cast<double>(count) / static_cast<double>(radiance_.size());
  add("rays", "ray", count, radiance_.size(), [this] {
    for (RayBatch& batch : batches_) tile_->scene->intersect(batch);
  });
}

void MixtureReplay::add_mixture_pdfs() {
  std::size_t kept = 0;
  for (const Population& p : populations_) kept += p.mixture->size();
  add("mixture pdf", "sample", kept, points_.size(), [this] {
    for (Population& p : populations_) {
      p.mixture->mixture_pdfs_w(0, p.coefficients, p.density);
    }
    benchmark::ClobberMemory();
  });
}

void MixtureReplay::add_pmc_hi() {
  add("adapt: counts", "iteration", populations_.size(), points_.size(), [this] {
    for (const Population& p : populations_) {
      const std::span<int> counts = std::span(counts_).first(p.alpha.size());
      pmc_hi::round_counts(settings_.rounding, p.alpha, p.n, p.key, counts);
      pmc_hi::raise_to_minimum(counts, settings_.n_min);
      benchmark::DoNotOptimize(counts.data());
    }
    benchmark::ClobberMemory();
  });
  const auto learns = [](const Population& p) { return !p.last; };
  const auto fits = [this, learns](const Population& p) {
    const auto hits =
        std::count_if(p.weights.begin(), p.weights.end(), [](double w) { return w > 0.0; });
    return learns(p) && points_[p.estimate].with_cone && hits >= settings_.cone_min_hits;
  };
  const auto learning =
      static_cast<std::size_t>(std::count_if(populations_.begin(), populations_.end(), learns));
  const auto fitting =
      static_cast<std::size_t>(std::count_if(populations_.begin(), populations_.end(), fits));
  add("adapt: Eq. 6", "iteration", learning, points_.size(), [this, learns] {
    for (const Population& p : populations_) {
      if (!learns(p)) continue;
      const std::span<double> sums = std::span(values_).first(p.alpha.size());
      std::fill(sums.begin(), sums.end(), 0.0);
      pmc_hi::add_tag_sums(*p.mixture, 0, p.weights, sums);
      benchmark::DoNotOptimize(pmc_hi::normalise(sums));
    }
    benchmark::ClobberMemory();
  });
  add("adapt: cone fit", "iteration", fitting, points_.size(), [this, fits] {
    for (const Population& p : populations_) {
      if (!fits(p)) continue;
      benchmark::DoNotOptimize(pmc_hi::fit_cone(*p.mixture, 0, p.weights, settings_.cone_rules));
    }
  });
}

void MixtureReplay::add_alsd() {
  const std::size_t lights = tile_->scene->lights().size();
  // A lone light has the probability 1 whatever is learned.
  const bool learns = tile_->scene->sampled_lights().size() > 1;
  const auto first_pass = static_cast<std::uint32_t>(job_.spp / 2);
  const auto pixels = static_cast<std::size_t>(job_.pixel_count());
  evidence_ = std::make_unique<alsd::Evidence>(lights, pixels, alsd::EvidenceWeights{});
  std::size_t first = 0;
  for (Population& p : populations_) {
    for (std::size_t k = 0; k < p.alpha.size(); ++k) p.coefficients[k] = p.n * p.alpha[k];
    first += p.key.estimate < first_pass ? 1 : 0;
  }
  add("adapt: counts", "estimate", populations_.size(), points_.size(), [this] {
    for (const Population& p : populations_) {
      const std::span<int> counts = std::span(counts_).first(p.alpha.size());
      const double offset = static_cast<double>(random_bits(p.key)) * 0x1p-32;
      systematic_counts(p.alpha, p.n, offset, counts);
      benchmark::DoNotOptimize(counts.data());
    }
    benchmark::ClobberMemory();
  });
  add("adapt: evidence", "estimate", learns ? first : 0, points_.size(), [this, first_pass] {
    evidence_->clear();
    for (const Population& p : populations_) {
      if (p.key.estimate >= first_pass) continue;
      const auto pixel = static_cast<int>(p.estimate) / job_.spp;
      evidence_->add_estimate(pixel, *p.mixture, p.coefficients, p.n);
    }
  });
  add("adapt: probabilities", "pixel", learns ? pixels : 0, points_.size(), [this, lights] {
    evidence_->finish();
    const std::span<double> pmf = std::span(values_).first(lights);
    for (int pixel = 0; pixel < job_.pixel_count(); ++pixel) {
      evidence_->probabilities(pixel, pmf);
      benchmark::DoNotOptimize(pmf.data());
    }
    benchmark::ClobberMemory();
  });
}

}  // namespace penumbra::micro
