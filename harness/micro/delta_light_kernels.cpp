// Lights without extent: their one direction and what arrives along it.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <array>

#include "harness/micro/checks.h"
#include "harness/micro/register.h"

namespace penumbra::micro {
namespace {

// All hang above the point, at this height where they have one, and shine down.
constexpr double kHeight = 2.0;
constexpr double kPower = 3.0;  // intensity, or irradiance

struct DeltaCase {
  const char* name;
  double irradiance;  // due at the point
  LightField (*make)();
};

LightField make_point() {
  SceneDescription scene = floor_scene();
  scene.point_lights.push_back({"light", Vec3d(0.0, 0.0, kHeight), Vec3d(kPower)});
  return finish_scene(std::move(scene));
}

LightField make_spot() {
  SceneDescription scene = floor_scene();
  SpotLightDescription spot;
  spot.name = "light";
  spot.position = Vec3d(0.0, 0.0, kHeight);
  spot.intensity = Vec3d(kPower);
  spot.inner_angle_deg = 10.0;
  scene.spot_lights.push_back(spot);
  return finish_scene(std::move(scene));
}

LightField make_directional() {
  SceneDescription scene = floor_scene();
  scene.directional_lights.push_back(
      {"light", Vec3d(0.0, 0.0, -1.0), Rgb(static_cast<float>(kPower))});
  return finish_scene(std::move(scene));
}

constexpr std::array<DeltaCase, 3> kCases{{
    {"point", kPower / (kHeight * kHeight), make_point},
    {"spot", kPower / (kHeight * kHeight), make_spot},
    {"directional", kPower, make_directional},
}};

std::string delta_fault(const LightField& field, double irradiance) {
  const Light& light = field.scene->lights()[0];
  const ShadingPoint& point = field.point;
  const auto sample = sample_delta(light, point.position, point.geometric_normal);
  if (!sample) return "no light arrives";
  if (sample_delta(light, point.position, -point.geometric_normal)) {
    return "light arrives from below the horizon";
  }
  const std::vector<double> found{static_cast<double>(sample->irradiance.y),
                                  static_cast<double>(sample->wi.z)};
  return values_fault("irradiance and direction", found, std::vector<double>{irradiance, 1.0},
                      1e-4);
}

void time_delta(benchmark::State& state, Suite& suite, const DeltaCase& c) {
  const LightField& field = suite.field(c.name, c.make);
  if (!suite.passes(state, fmt::format("light/{}", c.name),
                    [&] { return delta_fault(field, c.irradiance); })) {
    return;
  }
  const Light& light = field.scene->lights()[0];
  const ShadingPoint& point = field.point;
  time_kernel(state, {"sample", 1.0, &suite.ray_meter()}, [&] {
    benchmark::DoNotOptimize(&point);
    benchmark::ClobberMemory();
    benchmark::DoNotOptimize(sample_delta(light, point.position, point.geometric_normal));
  });
}

}  // namespace

void register_delta_light_kernels(Suite& suite) {
  for (const DeltaCase& c : kCases) {
    benchmark::RegisterBenchmark(
        fmt::format("light/{}/sample", c.name).c_str(),
        [&suite, &c](benchmark::State& state) { time_delta(state, suite, c); });
  }
}

}  // namespace penumbra::micro
