#include "scenes/core/normalise.h"

#include <cmath>
#include <limits>
#include <type_traits>

namespace penumbra {
namespace {

struct Box {
  Vec3d low{std::numeric_limits<double>::infinity()};
  Vec3d high{-std::numeric_limits<double>::infinity()};

  void add(const Vec3d& p) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
};

// The vertices of a shape that is a mesh of any kind.
template <typename AnyShape>
auto* mesh_vertices(AnyShape& shape) {
  return std::visit(
      [](auto& s) -> std::conditional_t<std::is_const_v<AnyShape>, const std::vector<Vec3d>*,
                                        std::vector<Vec3d>*> {
        if constexpr (requires { s.vertices; }) {
          return &s.vertices;
        } else {
          return nullptr;
        }
      },
      shape);
}

// Calls point(Vec3d&) for each position and length(Vec3d&) / radius(double&) for each difference of
// a shape.
template <typename Point, typename Edge, typename Radius>
void for_each_coordinate(Shape& shape, Point point, Edge edge, Radius radius) {
  if (auto* rectangle = std::get_if<RectangleShape>(&shape)) {
    point(rectangle->origin);
    edge(rectangle->edge_u);
    edge(rectangle->edge_v);
  } else if (auto* sphere = std::get_if<SphereShape>(&shape)) {
    point(sphere->center);
    radius(sphere->radius);
  } else {
    for (Vec3d& vertex : *mesh_vertices(shape)) point(vertex);
  }
}

Box bounds(const SceneDescription& scene) {
  Box box;
  for (const ShapeDescription& description : scene.shapes) {
    if (const auto* r = std::get_if<RectangleShape>(&description.shape)) {
      box.add(r->origin);
      box.add(r->origin + r->edge_u);
      box.add(r->origin + r->edge_v);
      box.add(r->origin + r->edge_u + r->edge_v);
    } else if (const auto* s = std::get_if<SphereShape>(&description.shape)) {
      box.add(s->center - Vec3d(s->radius));
      box.add(s->center + Vec3d(s->radius));
    } else {
      for (const Vec3d& vertex : *mesh_vertices(description.shape)) box.add(vertex);
    }
  }
  return box;
}

}  // namespace

Normalisation normalise(SceneDescription& scene) {
  const Box box = bounds(scene);
  Normalisation result;
  result.center = (box.low + box.high) * 0.5;
  const double diagonal = (box.high - box.low).length();
  result.scale = diagonal > 0.0 ? std::exp2(std::round(std::log2(4.0 / diagonal))) : 1.0;
  result.diagonal = diagonal * result.scale;

  const auto point = [&](Vec3d& p) { p = (p - result.center) * result.scale; };
  const auto edge = [&](Vec3d& e) { e *= result.scale; };
  const auto radius = [&](double& r) { r *= result.scale; };
  for (ShapeDescription& shape : scene.shapes) {
    for_each_coordinate(shape.shape, point, edge, radius);
  }
  for (PointLightDescription& light : scene.point_lights) {
    point(light.position);
    // Irradiance is intensity / distance^2 in any unit.
    light.intensity *= result.scale * result.scale;
  }
  for (SpotLightDescription& light : scene.spot_lights) {
    point(light.position);
    light.intensity *= result.scale * result.scale;
  }
  point(scene.camera.position);
  point(scene.camera.look_at);
  return result;
}

}  // namespace penumbra
