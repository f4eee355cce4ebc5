// The directions that are no samples, for estimators that subtract a function which is not 0 there.

#include "estimators/mixture/mixture.h"
#include "scenes/core/error.h"

namespace penumbra {

void Mixture::keep_dropped() {
  PN_CHECK(densities_ == Densities::All, "control variates need all densities");
  keeps_dropped_ = true;
  const std::size_t components = lights_as_one_ ? 3 : max_components_;
  dropped_pdfs_.resize(stride_ * components);
  dropped_alone_.resize(components);
}

// The lanes of the block at hand that are not on the list of survivors, which is ascending.
void Mixture::keep_dropped_pdfs(std::size_t survivors) noexcept {
  const int bsdf = bsdf_component();
  std::size_t next = 0;
  for (std::size_t lane = 0; lane < drawn_.count; ++lane) {
    if (next < survivors && drawn_.survivors[next] == lane) {
      ++next;
      continue;
    }
    const int own = drawn_.component[lane];
    const bool above = drawn_.wi_local.z[lane] > 0.0f;
    const bool alone = own == bsdf && (!above || !(drawn_.any_light_pdf[lane] > 0.0f));
    if (alone || !(drawn_.own_pdf[lane] > 0.0f) || drawn_.wi[lane].length2() == 0.0f) {
      ++dropped_alone_[static_cast<std::size_t>(own)];
      continue;
    }
    float* pdf = &dropped_pdfs_[dropped_++];
    for (int k = 0; k < bsdf; ++k, pdf += stride_) *pdf = lane_pdf_w(lane, k);
    *pdf = above ? drawn_.bsdf_pdf[lane] : 0.0f;
    pdf[stride_] = drawn_.cone_pdf[lane];
  }
}

float Mixture::lane_pdf_w(std::size_t lane, int k) const noexcept {
  if (many_ == nullptr) return light_pdfs_[static_cast<std::size_t>(k)][lane];
  for (const LightDensity& d : many_->lane(lane)) {
    if (static_cast<int>(d.component) == k) return d.pdf_w;
  }
  return 0.0f;
}

}  // namespace penumbra
