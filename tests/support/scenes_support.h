#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scenes/core/light.h"
#include "scenes/core/scene_description.h"
#include "scenes/core/shading_point.h"
#include "scenes/core/vec.h"

/// Small scenes, lights and shading points made by hand, and exact values for them.
namespace penumbra::test {

// Lights in the coordinates given, without the normalisation that Scene applies.

Light rectangle_light(const Vec3& origin, const Vec3& edge_u, const Vec3& edge_v,
                      bool two_sided = false);
Light sphere_light(const Vec3& center, float radius, bool two_sided = false);
Light mesh_light(const TriangleMeshShape& mesh, bool two_sided = false);

// Shapes.

/// Axis-aligned cube of 12 triangles, normals outwards.
TriangleMeshShape cube_mesh(const Vec3d& center, double side);
/// Regular tetrahedron, normals outwards.
TriangleMeshShape tetrahedron_mesh(const Vec3d& center, double circumradius);
/// Convex tessellation of a sphere by rings and sectors, normals outwards.
TriangleMeshShape sphere_mesh(const Vec3d& center, double radius, std::uint32_t rings,
                              std::uint32_t sectors);

// Descriptions.

MaterialDescription lambert(float reflectance, std::string name = "grey");

ShapeDescription shape(std::string name, Shape geometry, std::uint32_t material = 0);
ShapeDescription light(std::string name, Shape geometry, const Rgb& radiance,
                       bool two_sided = false);

/// Grey floor y = 0, a rectangle light above it that faces down, a mesh light (cube), a sphere
/// light and a quad mesh as occluder; the camera looks at the floor. All coordinates are multiples
/// of 1/64.
SceneDescription small_scene();

/// A shading point without a scene: material 0, no light.
ShadingPoint shading_point_at(const Vec3& position, const Vec3& normal, const Vec3& wo);

// Exact values.

/// Irradiance at a point from a polygon of radiance 1, clipped to the horizon; positive whichever
/// side faces the point. Source: Lambert 1760, "Photometria"; the vector form as in Arvo 1995,
/// "Analytic Methods for Simulated Light Transport".
double polygon_irradiance(std::span<const Vec3d> corners, const Vec3d& from, const Vec3d& normal);

/// The same for a rectangle light.
double rectangle_irradiance(const Light& rectangle, const Vec3& from, const Vec3& normal);

/// Solid angle of a triangle.
/// Source: Van Oosterom and Strackee 1983, "The solid angle of a plane triangle".
long double triangle_solid_angle(const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Solid angle of a rectangle light.
long double rectangle_solid_angle(const Light& rectangle, const Vec3& from);

}  // namespace penumbra::test
