// What a mixture does differently with many lights. Every sum runs over the components in the same
// order as with few, and leaves out only zeros: the same bits.

#include "estimators/mixture/many_lights.h"

#include <algorithm>

#include "estimators/mixture/mixture.h"

namespace penumbra {

// fill_light_pdfs: for each direction the lights that it can meet.
void Mixture::fill_pdfs_of_many() noexcept {
  ManyLights& many = *many_;
  const auto n = static_cast<double>(last_light_ - first_light_);
  std::size_t next = 0;
  for (std::size_t i = 0; i < drawn_.count; ++i) {
    const Vec3 wi = drawn_.wi[i];
    const int own = drawn_.component[i];
    many.lane_first[i] = next;
    double sum = 0.0;
    for_each_met(wi, [&](std::size_t l) {
      const int component = static_cast<int>(l) - first_light_;
      float pdf = active_[l].pdf_w(wi);
      if (!lights_as_one_ && component == own) pdf = drawn_.own_pdf[i];
      sum += static_cast<double>(pdf);
      if (lights_as_one_ || !(pdf > 0.0f)) return;
      many.lane_densities[next++] = {static_cast<std::uint32_t>(component), pdf};
    });
    if (lights_as_one_) {
      const float pdf = own == 0 ? drawn_.own_pdf[i] : static_cast<float>(sum / n);
      if (pdf > 0.0f) many.lane_densities[next++] = {0, pdf};
      sum = static_cast<double>(pdf);
    }
    drawn_.any_light_pdf[i] = static_cast<float>(sees_compensated() ? sum + 1.0 : sum);
  }
  many.lane_first[drawn_.count] = next;
}

void Mixture::keep_pdfs_of_many(std::size_t survivors) noexcept {
  ManyLights& many = *many_;
  if (size_ == 0) many.first[0] = 0;
  for (std::size_t i = 0; i < survivors; ++i) {
    const std::span<const LightDensity> densities = many.lane(drawn_.survivors[i]);
    const std::size_t sample = size_ + i;
    std::copy(densities.begin(), densities.end(), &many.densities[many.first[sample]]);
    many.first[sample + 1] = many.first[sample] + densities.size();
  }
  pack(drawn_.bsdf_pdf, survivors, &many.bsdf[size_]);
  pack(drawn_.cone_pdf, survivors, &many.cone[size_]);
}

float Mixture::pdf_w_of_many(std::size_t i, int k) const noexcept {
  if (k == bsdf_component()) return many_->bsdf[i];
  if (k == cone_component()) return many_->cone[i];
  for (const LightDensity& d : many_->sample(i)) {
    if (static_cast<int>(d.component) == k) return d.pdf_w;
  }
  return 0.0f;
}

void Mixture::mixture_pdfs_of_many(std::size_t first, std::span<const double> coefficients,
                                   std::span<double> density) const noexcept {
  for (std::size_t i = first; i < size_; ++i) {
    double sum = 0.0;
    for_each_pdf_w(i, [&](int k, float pdf) {
      const double c = coefficients[static_cast<std::size_t>(k)];
      if (c != 0.0) sum += c * static_cast<double>(pdf);
    });
    density[i - first] = sum;
  }
}

}  // namespace penumbra
