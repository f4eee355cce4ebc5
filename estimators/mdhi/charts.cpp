#include "estimators/mdhi/charts.h"

#include <algorithm>

#include "scenes/core/warp.h"

namespace penumbra::mdhi {
namespace {

constexpr float kOneMinusEpsilon = 1.0f - 0x1p-24f;

// A mesh's triangle comes from the first coordinate, which is then stretched over the triangle's
// share. For the other lights the coordinates change places: the tree cuts a square across its
// first one, and with a rectangle's edge_v there the fixtures are cut as in the cross-check of
// their specification.
Variates light_variates(const LightProposal& proposal, const Vec2& u) noexcept {
  if (!proposal.uses_choice()) return {Vec2(u.y, u.x), 0.0f};
  const float within = proposal.light().triangle_areas.sample(u.x).remapped_u;
  return {Vec2(within, u.y), u.x};
}

}  // namespace

Charts::Charts(const Scene& scene, Domain domain, LightSampling light_sampling)
    : scene_(&scene),
      domain_(domain),
      light_sampling_(light_sampling),
      bsdf_(scene.bsdf(0), Vec3(0.0f, 0.0f, 1.0f)) {
  lights_.resize(scene.sampled_lights().size());
  ids_.resize(lights_.size());
}

void Charts::set_up(const ShadingPoint& point, const SurfaceValues* surface) noexcept {
  active_ = 0;
  point_ = point;
  if (!scene_->is_mirror(point.material)) list_active_lights();
  frame_ = Frame(point.shading_normal);
  bsdf_ = BoundBsdf(scene_->bsdf_at(point.material, surface), frame_.to_local(point.wo));
}

void Charts::list_active_lights() noexcept {
  const std::span<const Light> lights = scene_->lights();
  for (const std::uint32_t id : scene_->sampled_lights()) {
    if (!lights_[active_].set_up(lights[id], light_sampling_, point_.position,
                                 point_.geometric_normal, scene_->keep_all())) {
      continue;
    }
    ids_[active_++] = id;
  }
}

std::string Charts::name(std::size_t chart) const {
  if (chart < light_charts()) return lights_[chart].light().name;
  return domain_ == Domain::Mixed ? "bsdf" : "hemisphere";
}

// The lobe comes from the first coordinate, which is then stretched over the lobe's share; a
// quotient that rounds to 1 stays below it.
Variates Charts::bsdf_variates(const Vec2& u) const noexcept {
  if (!bsdf_.uses_choice()) return {u, 0.0f};
  const float share = bsdf_.glossy_probability();
  const bool is_glossy = u.x < share;
  const float stretched = is_glossy ? u.x / share : (u.x - share) / (1.0f - share);
  return {Vec2(std::min(stretched, kOneMinusEpsilon), u.y), is_glossy ? 0.0f : kOneMinusEpsilon};
}

// Direction in both spaces, and own density except the BSDF's. False where there is no direction.
bool Charts::draw(std::size_t chart, const Vec2& u, ChartPoint& point, Vec3& local) const noexcept {
  if (chart < light_charts()) {
    const auto sample = lights_[chart].sample(light_variates(lights_[chart], u));
    if (!sample) return false;
    point.wi = sample->wi;
    point.own_pdf = sample->pdf_w;
    local = frame_.to_local(sample->wi);
    return true;
  }
  if (domain_ == Domain::Mixed) {
    const auto sample = bsdf_.sample(bsdf_variates(u));
    if (!sample) {
      point.fate = SampleFate::BelowHorizon;
      return false;
    }
    local = *sample;
  } else {
    local = sample_cosine_hemisphere(u);
    point.own_pdf = cosine_hemisphere_pdf_w(local.z);
  }
  point.wi = frame_.to_world(local);
  return true;
}

// Sum of the lights' densities in a direction, a light chart's own as it was drawn; positive where
// the direction meets a light's surface. The own density alone where no other is needed.
double Charts::light_density(std::size_t chart, const ChartPoint& point) const noexcept {
  if (domain_ == Domain::Lights) return static_cast<double>(point.own_pdf);
  double sum = 0.0;
  for (std::size_t k = 0; k < active_; ++k) {
    const bool own = k == chart && chart < light_charts();
    sum += static_cast<double>(own ? point.own_pdf : lights_[k].pdf_w(point.wi));
  }
  return sum;
}

ChartPoint Charts::map(std::size_t chart, const Vec2& u) const noexcept {
  ChartPoint point;
  Vec3 local;
  if (!draw(chart, u, point, local)) return point;
  if (!(local.z > 0.0f) || !(dot(point.wi, point_.geometric_normal) > 0.0f)) {
    point.fate = SampleFate::BelowHorizon;
    return point;
  }
  const double lights = light_density(chart, point);
  const BsdfValue bsdf = bsdf_.evaluate(local);
  if (domain_ == Domain::Mixed && chart == light_charts()) point.own_pdf = bsdf.pdf_w;
  point.f_cos = bsdf.f_cos;
  point.density = domain_ == Domain::Mixed ? lights + static_cast<double>(bsdf.pdf_w)
                                           : static_cast<double>(point.own_pdf);
  point.fate = !(lights > 0.0)        ? SampleFate::MissesLights
               : is_black(bsdf.f_cos) ? SampleFate::BlackBsdf
                                      : SampleFate::Dark;
  return point;
}

std::vector<float> Charts::all_pdfs(std::size_t chart, const ChartPoint& point) const {
  if (domain_ != Domain::Mixed) return {};
  std::vector<float> pdfs(size(), 0.0f);
  if (point.wi.length2() == 0.0f) return pdfs;
  for (std::size_t k = 0; k < active_; ++k) pdfs[k] = lights_[k].pdf_w(point.wi);
  pdfs[active_] = bsdf_.evaluate(frame_.to_local(point.wi)).pdf_w;
  pdfs[chart] = point.own_pdf;
  return pdfs;
}

}  // namespace penumbra::mdhi
