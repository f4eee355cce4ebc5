#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "estimators/record.h"
#include "scenes/core/bsdf.h"
#include "scenes/core/frame.h"
#include "scenes/core/light.h"
#include "scenes/core/scene.h"
#include "scenes/core/shading_point.h"

/// The squares over which MDHI integrates: charts of the directions at a shading point.
namespace penumbra::mdhi {

/// Which charts there are.
enum class Domain : std::uint8_t {
  Lights,      ///< one per light, for that light's own radiance
  Mixed,       ///< one per light and one of the BSDF; each sees all light, with balance weights
  Hemisphere,  ///< one, of cosine-distributed directions
};

/// A point of a chart as a direction, before it is traced. The integrand over the square there is
/// f_cos x arriving radiance / density.
struct ChartPoint {
  Vec3 wi{0.0f};        ///< unit, scene space; 0 without a direction
  float own_pdf{0.0f};  ///< of the chart's own map [1/sr]
  double density{0.0};  ///< that f is divided by: of the own map, or of all maps (mixed) [1/sr]
  Rgb f_cos{0.0f};      ///< BSDF x cosine [1/sr]
  SampleFate fate{SampleFate::NoDirection};  ///< Dark where the direction has to be traced

  /// Whether the direction can bring light, as far as can be told without a ray.
  bool can_contribute() const noexcept { return fate == SampleFate::Dark; }
};

/// The charts at one shading point: lights that can contribute there, then the BSDF or the
/// hemisphere.
class Charts {
 public:
  Charts(const Scene& scene, Domain domain, LightSampling light_sampling);

  /// Binds the charts to a valid point.
  /// @param surface  values of the point's textures; nullptr: factors of 1
  void set_up(const ShadingPoint& point, const SurfaceValues* surface = nullptr) noexcept;

  /// Lights with a density that can contribute at the point; where there is none, no chart is of
  /// use.
  std::size_t active_lights() const noexcept { return active_; }
  /// Number of charts.
  std::size_t size() const noexcept {
    return light_charts() + (domain_ == Domain::Lights ? 0u : 1u);
  }
  /// Most charts at any point of the scene.
  std::size_t max_size() const noexcept {
    return domain_ == Domain::Hemisphere ? 1 : lights_.size() + 1;
  }
  /// Random-number component of a chart: the light's index in the scene, behind the lights for the
  /// other charts. A light that is left out at a point does not shift the numbers of the others.
  std::uint32_t stream(std::size_t chart) const noexcept {
    return chart < light_charts() ? ids_[chart]
                                  : static_cast<std::uint32_t>(scene_->lights().size());
  }
  /// The light's name, "bsdf" or "hemisphere".
  std::string name(std::size_t chart) const;

  /// Maps a point of a chart's square to its direction.
  /// @param u  in [0, 1)^2
  ChartPoint map(std::size_t chart, const Vec2& u) const noexcept;

  /// Whether radiance that comes from a light counts for a chart.
  /// @param light  scene index, or kNoLight
  bool sees(std::size_t chart, std::int32_t light) const noexcept {
    if (domain_ != Domain::Lights) return light != kNoLight;
    return light == static_cast<std::int32_t>(ids_[chart]);
  }

  /// The light that the ray of a chart's point brings: the one that it meets, or the chart's own
  /// light, which rounding can make the ray miss.
  /// @param seen  that the ray meets: scene index, or kNoLight
  std::int32_t light_met(std::size_t chart, const Vec3& wi, const RayHit& hit,
                         std::int32_t seen) const noexcept {
    if (chart >= light_charts() || seen == static_cast<std::int32_t>(ids_[chart])) return seen;
    return lights_[chart].grazes(wi, hit.distance) ? static_cast<std::int32_t>(ids_[chart]) : seen;
  }

  /// Densities of all charts' maps in a direction that `map` gave for `chart`, for a record.
  /// @return [chart], of the own map as drawn [1/sr]; empty where only that one matters
  std::vector<float> all_pdfs(std::size_t chart, const ChartPoint& point) const;

  /// The frame about the shading normal, and the BSDF in it.
  const Frame& frame() const noexcept { return frame_; }
  const BoundBsdf& bsdf() const noexcept { return bsdf_; }

  /// Origin of the rays.
  const Vec3& origin() const noexcept { return point_.position; }

 private:
  void list_active_lights() noexcept;
  std::size_t light_charts() const noexcept { return domain_ == Domain::Hemisphere ? 0 : active_; }
  bool draw(std::size_t chart, const Vec2& u, ChartPoint& point, Vec3& local) const noexcept;
  double light_density(std::size_t chart, const ChartPoint& point) const noexcept;
  Variates bsdf_variates(const Vec2& u) const noexcept;

  const Scene* scene_;
  Domain domain_;
  LightSampling light_sampling_;

  ShadingPoint point_;
  Frame frame_{Vec3(0.0f, 0.0f, 1.0f)};
  BoundBsdf bsdf_;
  std::size_t active_{0};
  std::vector<LightProposal> lights_;  // the first active_ are set up
  std::vector<std::uint32_t> ids_;     // their indices in the scene
};

}  // namespace penumbra::mdhi
