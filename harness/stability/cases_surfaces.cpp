// Sharp lobes, mirrors, grazing angles, and normals that are awkward.

#include <cmath>

#include "harness/stability/closed_form.h"
#include "harness/stability/glossy_answer.h"
#include "harness/stability/small_scenes.h"
#include "harness/stability/stability_case.h"

namespace penumbra::stability {
namespace {

constexpr double kEta = 0.2;
constexpr double kAbsorption = 3.9;

ConductorMaterial conductor(double alpha) {
  ConductorMaterial material;
  material.eta = Rgb(static_cast<float>(kEta));
  material.k = Rgb(static_cast<float>(kAbsorption));
  material.alpha = static_cast<float>(alpha);
  return material;
}

/// A light of 0.3 x 0.3 about the direction mirrored at 45 degrees, 1 away. Roughness 0: a mirror.
StabilityStep roughness(double alpha) {
  SceneDescription scene = small_scene("roughness");
  const bool is_mirror = alpha == 0;
  const std::uint32_t metal = is_mirror ? add_material(scene, {"metal", MirrorMaterial{Rgb(0.75f)}})
                                        : add_material(scene, {"metal", conductor(alpha)});
  const Vec3d wo = Vec3d(-1, 0, 1).normalized();
  const Vec3d mirrored = Vec3d(1, 0, 1).normalized();
  const Vec3d up = Vec3d(-1, 0, 1).normalized();
  // Not centred, so that no symmetry hides an error.
  add_rectangle(scene, {mirrored + Vec3d(0, -0.12, 0) - up * 0.16, {0, 0.3, 0}, up * 0.3}, 1, true);
  StabilityStep step = in_air(scene, {0, 0, 0}, kUp, wo, metal);
  double exact = 0.75;
  if (!is_mirror) {
    const GlossyPoint point{static_cast<double>(static_cast<float>(alpha)), kEta, kAbsorption, wo};
    exact = glossy_radiance(point, [&](const Vec3d& w) {
      const double t = 1 / w.dot(mirrored);
      const Vec3d p = w * t - mirrored;
      return t > 0 && std::abs(p.y - 0.03) <= 0.15 && std::abs(p.dot(up) + 0.01) <= 0.15;
    });
    step.condition = 1 / alpha;
  }
  step.exact.assign(step.points.size(), exact);
  return step;
}

/// A sphere light and a Phong lobe about the normal that narrow together.
StabilityStep sharp_and_small(double radius) {
  constexpr double kDiffuse = 0.2;
  constexpr double kSpecular = 0.7;
  SceneDescription scene = small_scene("sharp_and_small");
  const double exponent = 1 / (radius * radius);
  PhongMaterial phong;
  phong.diffuse = Rgb(static_cast<float>(kDiffuse));
  phong.specular = Rgb(static_cast<float>(kSpecular));
  phong.exponent = static_cast<float>(exponent);
  const std::uint32_t glossy = add_material(scene, {"phong", phong});
  add_extent(scene, 1);
  add_shape(scene, SphereShape{{0, 0, 1}, radius}, 1);
  StabilityStep step = in_air(scene, {0, 0, 0}, kUp, kUp, glossy);
  step.exact.assign(step.points.size(), phong_cap_radiance(kDiffuse, kSpecular, exponent, radius));
  step.condition = 1 / radius;
  return step;
}

StabilityStep grazing_view(double cosine, double alpha) {
  SceneDescription scene = small_scene("grazing_view");
  const std::uint32_t metal = add_material(scene, {"metal", conductor(alpha)});
  add_extent(scene, 1);
  scene.environment = white_sky();
  const Vec3d wo(std::sqrt(1 - cosine * cosine), 0, cosine);
  StabilityStep step = in_air(scene, {0, 0, 0}, kUp, wo, metal);
  const GlossyPoint point{static_cast<double>(static_cast<float>(alpha)), kEta, kAbsorption,
                          Vec3d(step.points[0].wo)};
  step.exact.assign(step.points.size(), glossy_albedo(point));
  return step;
}

StabilityStep grazing_rough(double cosine) { return grazing_view(cosine, 0.3); }
StabilityStep grazing_smooth(double cosine) { return grazing_view(cosine, 0.01); }

/// A wall of light of which only the part above the horizon counts.
StabilityStep horizon_light(double height) {
  SceneDescription scene = small_scene("horizon_light");
  add_rectangle(scene, {{-0.5, 0.5, -0.5}, {1, 0, 0}, {0, 0, 0.5 + height}}, 2, true);
  StabilityStep step = in_air(scene, {0, 0, 0}, kUp);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  step.condition = 1 / height;
  return step;
}

/// Shading normal turned away from the geometric one under a white sky.
StabilityStep bent_normal(double degrees) {
  SceneDescription scene = small_scene("bent_normal");
  add_extent(scene, 1);
  scene.environment = white_sky();
  const double angle = degrees * M_PI / 180;
  const Vec3d bent(std::sin(angle), 0, std::cos(angle));
  StabilityStep step = in_air(scene, {0, 0, 0}, kUp, kUp + bent);
  for (ShadingPoint& point : step.points) point.shading_normal = Vec3(bent);
  set_lambert(step, [&](const ShadingPoint&) { return bent_normal_irradiance(angle); });
  return step;
}

/// Normals about the pole at which frames are singular. Tilt 0: the pole itself.
StabilityStep normal_at_pole(double tilt) {
  SceneDescription scene = small_scene("normal_at_pole");
  add_rectangle(scene, {{-0.2, 0.1, -1}, {0.6, 0, 0}, {0, 0.5, 0}}, 2);
  const Vec3d normal(std::sin(tilt) * 0.6, std::sin(tilt) * 0.8, -std::cos(tilt));
  StabilityStep step = in_air(scene, {0, 0, 0}, normal);
  set_lambert(step, [&](const ShadingPoint& p) { return irradiance_of_all(step, p); });
  return step;
}

}  // namespace

std::vector<StabilityCase> surface_cases() {
  return {
      {"roughness", "S1 S2", "a metal that mirrors a light smooths out", "GGX width; 0: a mirror",
       "quadrature over half vectors", log_steps_then(1, 1e-4, 9, 0), roughness},
      {"sharp_and_small", "W7 S1", "a Phong lobe and a sphere light narrow together",
       "radius, exponent radius^-2", "closed form of a cap", log_steps(0.3, 1e-3, 9),
       sharp_and_small},
      {"grazing_rough", "S3 S5", "a rough metal under a white sky, seen at a lower and lower angle",
       "cosine of the view", "quadrature over half vectors", log_steps(1, 1e-6, 9), grazing_rough},
      {"grazing_smooth", "S3 S5", "the same for a metal of GGX width 0.01", "cosine of the view",
       "quadrature over half vectors", log_steps(1, 1e-6, 9), grazing_smooth},
      {"horizon_light", "W11", "a wall of light sinks below the horizon", "height above it",
       "Lambert's polygon, cut at the horizon", log_steps(0.5, 1e-5, 10), horizon_light},
      {"bent_normal",
       "S6",
       "shading normal turned away from the geometric one",
       "angle [deg]",
       "closed form of a lune",
       {0, 15, 30, 45, 60, 75, 85, 89, 89.9},
       bent_normal},
      {"normal_at_pole", "S9 W10", "normals at the pole of frames", "tilt [rad]",
       "Lambert's polygon", log_steps_then(1, 1e-8, 9, 0), normal_at_pole},
  };
}

}  // namespace penumbra::stability
