// The kernels that MixtureReplay times; what they work on comes from mixture_replay.cpp.

#include <benchmark/benchmark.h>

#include <algorithm>

#include "estimators/mixture/estimates.h"
#include "estimators/pmc_hi/adaptation.h"
#include "harness/micro/mixture_replay.h"
#include "scenes/core/warp.h"

namespace penumbra::micro {

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
  recorded_ = RecordedRays(*tile_, estimator, job_, seed_, radiance_);
  const std::size_t estimates = radiance_.size() * kReplayedSeeds;
  rays = static_cast<double>(recorded_.size()) / static_cast<double>(estimates);
  add("rays", "ray", recorded_.size(), estimates, [this] { recorded_.trace(*tile_->scene); });
}

// Which light each ray brings: its emitter, or by its outline the light that it was drawn for.
void MixtureReplay::add_lights_met() {
  std::size_t count = 0;
  for (Population& p : populations_) {
    p.rays = std::make_unique<RayBatch>(p.mixture->size());
    for (std::size_t i = 0; i < p.mixture->size(); ++i) {
      p.rays->add(p.mixture->point().position, p.mixture->wi(i));
    }
    tile_->scene->intersect(*p.rays);
    count += p.mixture->size();
  }
  add("light met", "ray", count, points_.size(), [this] {
    int met = 0;
    for (const Population& p : populations_) {
      for (std::size_t i = 0; i < p.mixture->size(); ++i) met += light_met(p, i) ? 1 : 0;
    }
    benchmark::DoNotOptimize(met);
  });
}

bool MixtureReplay::light_met(const Population& p, std::size_t i) const {
  const RayHit& hit = p.rays->hits[i];
  const Vec3 wi = p.mixture->wi(i);
  const std::int32_t seen = tile_->scene->emitter(hit, wi);
  const auto component = static_cast<std::size_t>(p.mixture->component(i));
  const std::vector<LightProposal>& lights = points_[p.estimate].lights;
  if (component >= lights.size()) return seen != kNoLight;
  const auto id = static_cast<std::int32_t>(p.mixture->light_index(static_cast<int>(component)));
  return seen == id || lights[component].grazes(wi, hit.distance);
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

// An estimate per point.
void MixtureReplay::add_pmc_hi() {
  add("adapt: cone or none", "point", points_.size(), points_.size(), [this] {
    int with_cone = 0;
    for (std::size_t e = 0; e < points_.size(); ++e) {
      with_cone += may_be_occluded(points_[e].light_ids, job_.points[e]) ? 1 : 0;
    }
    benchmark::DoNotOptimize(with_cone);
  });
  add_populations_of_pmc_hi();
}

void MixtureReplay::add_populations_of_pmc_hi() {
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
