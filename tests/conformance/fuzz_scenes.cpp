#include "tests/conformance/fuzz_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>

#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"

namespace penumbra::conformance {
namespace {

class Generator {
 public:
  explicit Generator(std::uint64_t seed)
      : engine_(fixtures::seed_from("fuzz scene " + std::to_string(seed))) {}

  FuzzScene make(std::uint64_t seed) {
    FuzzScene result;
    result.seed = seed;
    scene_ = &result.description;
    scene_->name = "fuzz " + std::to_string(seed);
    const bool sharp = uniform() < 0.4;
    const int materials = integer(1, 3);
    for (int i = 0; i < materials; ++i) add_material(sharp, result.rough);
    add_camera();
    scene_->shapes.push_back(
        test::shape("floor", RectangleShape{{-4, 0, 4}, {8, 0, 0}, {0, 0, -8}}, any_material()));
    add_lights();
    const int occluders = integer(0, 5);
    for (int i = 0; i < occluders; ++i) add_occluder(i);
    place();
    return result;
  }

 private:
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }
  int integer(int low, int high) {
    return low + static_cast<int>(uniform() * static_cast<double>(high - low + 1));
  }
  Rgb color(double low, double high) {
    const auto r = static_cast<float>(uniform(low, high));
    const auto g = static_cast<float>(uniform(low, high));
    const auto b = static_cast<float>(uniform(low, high));
    return {r, g, b};
  }
  std::uint32_t any_material() {
    return static_cast<std::uint32_t>(integer(0, static_cast<int>(scene_->materials.size()) - 1));
  }

  Vec3d direction() {
    const double y = uniform(-1, 1);
    const double phi = uniform(0, 2 * std::numbers::pi);
    const double r = std::sqrt(1 - y * y);
    return {r * std::cos(phi), y, r * std::sin(phi)};
  }
  std::pair<Vec3d, Vec3d> perpendicular_pair() {
    const Vec3d a = direction();
    Vec3d b = direction().cross(a);
    while (b.length() < 0.1) b = direction().cross(a);
    return {a, b.normalized()};
  }

  float lobe_width(bool sharp, bool& rough) {
    const double alpha = sharp ? log_uniform(1e-3, 0.1) : uniform(0.1, 1.0);
    const auto result = static_cast<float>(alpha);
    rough = rough && result >= kRoughAlpha;
    return result;
  }

  void add_material(bool sharp, bool& rough) {
    const std::string name = "material" + std::to_string(scene_->materials.size());
    switch (integer(0, 4)) {
      case 0:
        scene_->materials.push_back({name, LambertMaterial{color(0.1, 0.9)}});
        return;
      case 1:
        scene_->materials.push_back(
            {name, ConductorMaterial{color(0.1, 2.0), color(1.0, 6.0), lobe_width(sharp, rough),
                                     color(0.5, 1.0)}});
        return;
      case 2: {
        const auto exponent =
            static_cast<float>(sharp ? log_uniform(50.0, 1e5) : log_uniform(1.0, 100.0));
        rough = rough && exponent <= kRoughExponent;
        scene_->materials.push_back(
            {name, PhongMaterial{color(0.0, 0.4), color(0.1, 0.6), exponent}});
        return;
      }
      case 3: {
        MetallicRoughnessMaterial coated;
        coated.base_color = color(0.1, 0.9);
        coated.metallic = static_cast<float>(uniform() < 0.5 ? integer(0, 1) : uniform());
        coated.roughness = std::sqrt(lobe_width(sharp, rough));
        scene_->materials.push_back({name, coated});
        return;
      }
      default: {
        MixtureMaterial mixture;
        mixture.diffuse.reflectance = color(0.1, 0.9);
        mixture.glossy.alpha = lobe_width(sharp, rough);
        mixture.glossy_weight = static_cast<float>(uniform(0.1, 0.9));
        scene_->materials.push_back({name, mixture});
      }
    }
  }

  void add_camera() {
    const double azimuth = uniform(0, 2 * std::numbers::pi);
    const double distance = uniform(3, 4);
    scene_->camera = {
        {distance * std::cos(azimuth), uniform(0.8, 3.0), distance * std::sin(azimuth)},
        {uniform(-0.3, 0.3), uniform(0.0, 0.5), uniform(-0.3, 0.3)},
        {0, 1, 0},
        uniform(25, 45),
        {kFuzzWidth, kFuzzHeight}};
  }

  // A quarter of the plane for each area light, half extents at most 0.5 in it, all above 1.4.
  void add_lights() {
    const int lights = integer(1, 4);
    for (int i = 0; i < lights; ++i) {
      const Vec3d center((i & 1 ? 1 : -1) * uniform(0.6, 1.4), uniform(1.9, 2.6),
                         (i & 2 ? 1 : -1) * uniform(0.6, 1.4));
      const std::string name = "light" + std::to_string(i);
      const int kind = integer(0, 6);
      if (kind == 4 && !scene_->environment) {
        add_environment();
      } else if (kind >= 4) {
        add_delta_light(kind, name, center);
      } else {
        add_area_light(kind, name, center);
      }
    }
  }

  void add_delta_light(int kind, const std::string& name, const Vec3d& center) {
    const Vec3d aim = Vec3d(uniform(-0.8, 0.8), 0, uniform(-0.8, 0.8)) - center;
    if (kind == 4) {
      scene_->point_lights.push_back({name, center, color(0.5, 4.0)});
    } else if (kind == 5) {
      const double outer = log_uniform(5.0, 90.0);
      scene_->spot_lights.push_back(
          {name, center, aim, Vec3d(color(0.5, 8.0)), uniform(0.0, 0.99) * outer, outer});
    } else {
      scene_->directional_lights.push_back({name, aim, color(0.1, 2.0)});
    }
  }

  void add_area_light(int kind, const std::string& name, const Vec3d& center) {
    const Rgb radiance = color(0.5, 8.0);
    const bool two_sided = uniform() < 0.3;
    if (kind == 0) {
      const auto [a, b] = perpendicular_pair();
      Vec3d u = a * uniform(0.3, 0.7);
      Vec3d v = b * uniform(0.3, 0.7);
      if (u.cross(v).y > 0 && uniform() < 0.8) std::swap(u, v);  // most face the floor
      scene_->shapes.push_back(
          test::light(name, RectangleShape{center - (u + v) * 0.5, u, v}, radiance, two_sided));
    } else if (kind == 1) {
      scene_->shapes.push_back(
          test::light(name, SphereShape{center, uniform(0.15, 0.4)}, radiance, two_sided));
    } else {
      // Few triangles, or enough for a ray scene of the light's own.
      const double size = uniform(0.25, 0.5);
      const TriangleMeshShape mesh = kind == 2 ? test::tetrahedron_mesh({0, 0, 0}, size)
                                               : test::sphere_mesh({0, 0, 0}, size, 8, 10);
      scene_->shapes.push_back(test::light(name, turned(mesh, center), radiance, two_sided));
    }
  }

  void add_environment() {
    EnvironmentDescription environment;
    if (uniform() < 0.7) {
      environment.columns = static_cast<std::uint32_t>(integer(2, 12));
      environment.rows = static_cast<std::uint32_t>(integer(2, 6));
    }
    const std::size_t texels = std::size_t{environment.columns} * environment.rows;
    for (std::size_t i = 0; i < texels; ++i) {
      environment.texels.push_back(uniform() < 0.2 ? Rgb(0.0f) : color(0.05, 1.0));
    }
    environment.texels.front() = color(0.1, 1.0);
    scene_->environment = environment;
  }

  // All below 1.4.
  void add_occluder(int index) {
    const Vec3d center(uniform(-1.3, 1.3), uniform(0.1, 0.85), uniform(-1.3, 1.3));
    const std::string name = "occluder" + std::to_string(index);
    const int kind = integer(0, 3);
    const double size = uniform(0.1, 0.5);
    if (kind == 0) {
      const auto [a, b] = perpendicular_pair();
      const Vec3d u = a * size;
      const Vec3d v = b * uniform(0.1, 0.6);
      scene_->shapes.push_back(
          test::shape(name, RectangleShape{center - (u + v) * 0.5, u, v}, any_material()));
    } else if (kind == 1) {
      scene_->shapes.push_back(test::shape(name, SphereShape{center, size}, any_material()));
    } else if (kind == 2) {
      scene_->shapes.push_back(
          test::shape(name, turned(test::cube_mesh({0, 0, 0}, size), center), any_material()));
    } else {
      scene_->shapes.push_back(test::shape(
          name, turned(test::tetrahedron_mesh({0, 0, 0}, size), center), any_material()));
    }
  }

  TriangleMeshShape turned(TriangleMeshShape mesh, const Vec3d& center) {
    const auto [x, y] = perpendicular_pair();
    const Vec3d z = x.cross(y);
    for (Vec3d& v : mesh.vertices) v = center + x * v.x + y * v.y + z * v.z;
    return mesh;
  }

  // Scale and offset of the whole scene. A point light's intensity grows with the square of
  // lengths, so that its irradiance stays.
  void place() {
    const double scale = log_uniform(1e-3, 1e3);
    const Vec3d offset =
        uniform() < 0.5 ? Vec3d(0.0) : direction() * (log_uniform(1.0, 1e3) * scale);
    const auto point = [&](Vec3d& p) { p = p * scale + offset; };
    point(scene_->camera.position);
    point(scene_->camera.look_at);
    for (PointLightDescription& light : scene_->point_lights) {
      point(light.position);
      light.intensity *= static_cast<float>(scale * scale);
    }
    for (SpotLightDescription& light : scene_->spot_lights) {
      point(light.position);
      light.intensity *= scale * scale;
    }
    for (ShapeDescription& s : scene_->shapes) {
      if (auto* r = std::get_if<RectangleShape>(&s.shape)) {
        point(r->origin);
        r->edge_u *= scale;
        r->edge_v *= scale;
      } else if (auto* ball = std::get_if<SphereShape>(&s.shape)) {
        point(ball->center);
        ball->radius *= scale;
      } else if (auto* mesh = std::get_if<TriangleMeshShape>(&s.shape)) {
        for (Vec3d& v : mesh->vertices) point(v);
      }
    }
  }

  std::mt19937_64 engine_;
  SceneDescription* scene_{nullptr};
};

}  // namespace

FuzzScene fuzz_scene(std::uint64_t seed) { return Generator(seed).make(seed); }

}  // namespace penumbra::conformance
