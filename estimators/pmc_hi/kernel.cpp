#include "estimators/pmc_hi/kernel.h"

#include <algorithm>

#include "estimators/mixture/estimates.h"
#include "estimators/pmc_hi/adaptation.h"

namespace penumbra::pmc_hi {
namespace {

// All components but the cone.
void set_equal(std::span<double> alpha) noexcept {
  std::fill(alpha.begin(), alpha.end(), 1.0 / static_cast<double>(alpha.size() - 1));
  alpha.back() = 0.0;
}

}  // namespace

Kernel::Kernel(const Settings& settings, std::size_t max_components)
    : settings_(&settings),
      alpha_(max_components),
      learned_(max_components),
      evidence_(max_components),
      counts_(max_components),
      coefficients_(max_components) {}

void Kernel::start(const Mixture& mixture, const StreamKey& key, int samples,
                   bool learn_cone) noexcept {
  learn_cone_ = learn_cone;
  m_ = static_cast<std::size_t>(mixture.components());
  has_cone_ = false;
  std::fill(evidence_.begin(), evidence_.end(), 0.0);
  const std::span<double> alpha = std::span(alpha_).first(m_);
  const std::span<int> counts = std::span(counts_).first(m_);
  if (settings_->initial == Initial::MisSplit) {
    const int lights = mixture.active_lights();
    shared_mis_counts(samples / lights, lights, mixture.light_components(), counts);
    for (std::size_t k = 0; k < m_; ++k) alpha[k] = static_cast<double>(counts[k]) / samples;
  } else {
    set_equal(alpha);
    round_counts(settings_->rounding, alpha, samples, key, counts);
    raise_to_minimum(counts, settings_->n_min);
  }
  set_coefficients(samples);
}

void Kernel::next(const StreamKey& key, int samples) noexcept {
  const std::span<int> counts = std::span(counts_).first(m_);
  round_counts(settings_->rounding, alpha(), samples, key, counts);
  raise_to_minimum(counts, settings_->n_min);
  set_coefficients(samples);
}

void Kernel::set_coefficients(int samples) noexcept {
  const bool by_counts = settings_->denominator == Denominator::Counts;
  for (std::size_t k = 0; k < m_; ++k) {
    coefficients_[k] = by_counts ? static_cast<double>(counts_[k]) / samples : alpha_[k];
  }
}

// Nothing was seen: Eq. 6 is 0/0. The weights stay, without a cone.
void Kernel::forget_cone(Mixture& mixture) noexcept {
  const std::span<double> alpha = std::span(alpha_).first(m_);
  has_cone_ = false;
  mixture.cone() = Cone{};
  alpha.back() = 0.0;
  if (!normalise(alpha)) set_equal(alpha);
  std::copy(alpha.begin(), alpha.end(), learned_.begin());
}

void Kernel::learn(Mixture& mixture, std::size_t first, std::span<const double> weights) noexcept {
  const std::size_t cone = m_ - 1;
  const auto hits = std::count_if(weights.begin(), weights.end(), [](double w) { return w > 0.0; });
  const std::span<double> learned = std::span(learned_).first(m_);
  for (std::size_t k = 0; k < m_; ++k) learned[k] = settings_->cumulative ? evidence_[k] : 0.0;
  if (settings_->update == Update::Tag) {
    add_tag_sums(mixture, first, weights, learned);
  } else {
    add_posterior_sums(mixture, first, weights, coefficients(), learned);
  }
  if (settings_->cumulative) std::copy(learned.begin(), learned.end(), evidence_.begin());
  if (hits == 0 || !normalise(learned)) return forget_cone(mixture);

  const bool had_cone = has_cone_;
  mixture.cone() = learn_cone_ && hits >= settings_->cone_min_hits
                       ? fit_cone(mixture, first, weights, settings_->cone_rules)
                       : Cone{};
  has_cone_ = mixture.cone().active();
  if (!has_cone_ || !had_cone) {
    learned[cone] = 0.0;
    if (!normalise(learned)) set_equal(learned);
  }
  if (has_cone_ && !had_cone) {
    for (double& value : learned) value *= 1.0 - settings_->alpha_cone;
    learned[cone] = settings_->alpha_cone;
  }
  const double floored = settings_->alpha_floor * static_cast<double>(cone);
  for (std::size_t k = 0; k < m_; ++k) {
    alpha_[k] = (1.0 - floored) * learned[k] + (k < cone ? settings_->alpha_floor : 0.0);
  }
}

}  // namespace penumbra::pmc_hi
