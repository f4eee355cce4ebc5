#include "scenes/core/models/gltf_lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace penumbra {
namespace {

constexpr double kMaxIntensity = 1e30;
constexpr int kLongSide = 480;  ///< of a camera's picture [pixels], as of CameraDescription

double degrees(double radians) { return radians * 180.0 / std::numbers::pi; }

Vec3d forward(const GltfDocument& document, const Placement& world, int node) {
  const Vec3d direction = world.vector({0, 0, -1});
  if (direction.length() == 0.0) {
    document.fault("node " + std::to_string(node) + ": its transform has no direction -z");
  }
  return direction.normalized();
}

Vec3d intensity_of(const GltfDocument& document, const tinygltf::Light& light,
                   const std::string& place) {
  if (!light.color.empty() && light.color.size() != 3) {
    document.fault(place + ": color needs 3 numbers, found " + std::to_string(light.color.size()));
  }
  Vec3d intensity(light.intensity);
  for (int c = 0; c < 3; ++c) {
    if (!light.color.empty()) intensity[c] *= light.color[static_cast<std::size_t>(c)];
    if (!(intensity[c] >= 0.0 && intensity[c] <= kMaxIntensity)) {
      document.fault(place + ": color and intensity must be >= 0");
    }
  }
  return intensity;
}

SpotLightDescription spot_of(const GltfDocument& document, const tinygltf::SpotLight& spot,
                             const std::string& place) {
  SpotLightDescription result;
  result.inner_angle_deg = degrees(spot.innerConeAngle);
  const double outer = degrees(spot.outerConeAngle);
  // A quarter turn in single precision may lie above 90 degrees by rounding.
  if (!(result.inner_angle_deg >= 0.0 && result.inner_angle_deg < outer && outer <= 90.0 + 1e-4)) {
    document.fault(place + ": expected 0 <= innerConeAngle < outerConeAngle <= pi/2, found " +
                   std::to_string(spot.innerConeAngle) + " and " +
                   std::to_string(spot.outerConeAngle));
  }
  result.outer_angle_deg = std::min(outer, 90.0);
  return result;
}

}  // namespace

bool add_camera(const GltfDocument& document, ModelBuilder& builder, int node,
                const Placement& world) {
  const int index = document.model().nodes[static_cast<std::size_t>(node)].camera;
  const tinygltf::Camera& camera = document.at(document.model().cameras, index, "camera");
  if (camera.type != "perspective") {
    builder.warn("camera " + std::to_string(index) + " is " + camera.type +
                 ", which is not supported; it is left out");
    return true;
  }
  if (builder.model().camera) return false;
  CameraDescription result;
  result.vertical_fov_deg = degrees(camera.perspective.yfov);
  if (!(result.vertical_fov_deg > 0.0 && result.vertical_fov_deg < 180.0)) {
    document.fault("camera " + std::to_string(index) + ": yfov must be in (0, pi), found " +
                   std::to_string(camera.perspective.yfov));
  }
  const Vec3d view = forward(document, world, node);
  result.position = world.point(Vec3d(0.0));
  result.look_at = result.position + view;
  result.up = world.vector({0, 1, 0});
  if (result.up.normalized().cross(view).length() < 1e-6) {
    document.fault("node " + std::to_string(node) + ": its transform flattens the camera");
  }
  if (const double aspect = camera.perspective.aspectRatio; aspect > 0.0) {
    const auto side = [](double share) {
      return std::clamp(static_cast<int>(std::lround(kLongSide * std::min(share, 1.0))), 1,
                        kLongSide);
    };
    result.resolution = {side(aspect), side(1.0 / aspect)};
  }
  builder.model().camera = result;
  return true;
}

void add_light(const GltfDocument& document, ModelBuilder& builder, int node, int index,
               const Placement& world) {
  const tinygltf::Light& light = document.at(document.model().lights, index, "light");
  const std::string& node_name = document.model().nodes[static_cast<std::size_t>(node)].name;
  const std::string name = builder.unique_name(!node_name.empty()    ? node_name
                                               : !light.name.empty() ? light.name
                                                                     : "light");
  const std::string place = "light \"" + name + "\"";
  const Vec3d intensity = intensity_of(document, light, place);
  if (light.range != 0.0) builder.warn(place + ": range is not supported and left out");
  if (intensity == Vec3d(0.0)) {
    builder.warn(place + " has an intensity of zero and is not a light");
    return;
  }
  Model& model = builder.model();
  if (light.type == "point") {
    model.point_lights.push_back({name, world.point(Vec3d(0.0)), intensity});
  } else if (light.type == "directional") {
    model.directional_lights.push_back(
        {name, forward(document, world, node), Rgb(Vec3(intensity))});
  } else if (light.type == "spot") {
    SpotLightDescription spot = spot_of(document, light.spot, place);
    spot.name = name;
    spot.position = world.point(Vec3d(0.0));
    spot.direction = forward(document, world, node);
    spot.intensity = intensity;
    model.spot_lights.push_back(spot);
  } else {
    document.fault(place + ": unknown type \"" + light.type +
                   "\", expected point, spot or directional");
  }
}

}  // namespace penumbra
