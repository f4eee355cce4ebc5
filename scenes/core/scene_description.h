#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "scenes/core/vec.h"

/// A scene as its file states it: plain data in double precision and world units, nothing derived.
/// `load_scene_description` (scene_file.h) makes it from JSON; tests make it by hand; `Scene`
/// consumes it.
namespace penumbra {

/// Perfectly diffuse reflection.
struct LambertMaterial {
  Rgb reflectance{0.5f};  ///< albedo, each channel in [0, 1]
};

/// Rough conductor: GGX microfacets, exact conductor Fresnel.
struct ConductorMaterial {
  Rgb eta{0.2f};      ///< real part of the index of refraction, > 0
  Rgb k{3.9f};        ///< absorption coefficient, >= 0
  float alpha{0.1f};  ///< GGX width alpha (not perceptual roughness), in [1e-4, 1]
  Rgb tint{1.0f};     ///< factor on the reflected radiance, each channel in [0, 1]
};

/// Modified Phong lobe over a diffuse base: kd/pi + ks (s+2)/(2 pi) max(0, r.wi)^s.
/// The fixtures of the estimator tests are stated with it. Energy: kd + ks <= 1.
/// Source: Lafortune and Willems 1994, "Using the modified Phong reflectance model for physically
/// based rendering".
struct PhongMaterial {
  Rgb diffuse{0.5f};
  Rgb specular{0.0f};
  float exponent{20.0f};  ///< s, in [1, 1e6]
};

/// Convex mixture of a diffuse base and a glossy conductor lobe.
struct MixtureMaterial {
  LambertMaterial diffuse;
  ConductorMaterial glossy;
  float glossy_weight{0.5f};  ///< share of the glossy lobe, in [0, 1]
};

/// Metallic-roughness surface of glTF 2.0: a diffuse base under a dielectric coat of F0 = 0.04, or
/// a metal of F0 = base colour, both GGX with Schlick's Fresnel term, blended by `metallic`.
struct MetallicRoughnessMaterial {
  Rgb base_color{1.0f};   ///< each channel in [0, 1]
  float metallic{1.0f};   ///< in [0, 1]
  float roughness{1.0f};  ///< perceptual, in [0, 1]; the GGX width is its square
};

/// Perfect mirror: a delta function, so its direct light comes only from what the mirrored ray
/// hits.
struct MirrorMaterial {
  Rgb reflectance{1.0f};  ///< each channel in [0, 1]
};

/// How coordinates outside [0, 1] are taken back into an image.
enum class TextureWrap : std::uint8_t { Repeat, Clamp, Mirror };

/// An image on a surface.
struct TextureDescription {
  std::string file;          ///< absolute path
  std::string content_hash;  ///< of the file's bytes, hexadecimal; decides the truth, not the path
  bool srgb{false};          ///< colours are decoded from the sRGB transfer function
  int channel{0};            ///< of scalars: which channel holds them, from 0
  TextureWrap wrap_u{TextureWrap::Repeat}, wrap_v{TextureWrap::Repeat};
};

/// Holes in a surface: it exists where the texture's channel is at least `cutoff`.
struct MaskDescription {
  TextureDescription texture;
  float cutoff{0.5f};  ///< in [0, 1]
};

struct MaterialDescription {
  std::string name;
  std::variant<LambertMaterial, ConductorMaterial, PhongMaterial, MixtureMaterial,
               MetallicRoughnessMaterial, MirrorMaterial>
      model;
  /// Factor on the colour: reflectance of `lambert`, of a mixture's diffuse base and of `mirror`,
  /// `diffuse` of `phong`, tint of `conductor`, base colour of metallic-roughness.
  std::optional<TextureDescription> reflectance_texture{};
  /// Factor t on the perceptual roughness, in [0, 1]: the GGX width becomes max(1e-4, alpha t^2).
  std::optional<TextureDescription> roughness_texture{};
  /// Factor on `metallic` of metallic-roughness.
  std::optional<TextureDescription> metallic_texture{};
  std::optional<MaskDescription> mask{};
};

/// Emission of a shape; a shape that has one is an area light.
struct EmissionDescription {
  Rgb radiance{1.0f};     ///< [W/(m^2 sr)], each channel finite and >= 0
  bool two_sided{false};  ///< otherwise only the side that the geometric normal points to emits
};

/// Parallelogram with perpendicular edges; the normal is edge_u x edge_v.
struct RectangleShape {
  Vec3d origin, edge_u, edge_v;
};

struct SphereShape {
  Vec3d center;
  double radius{1.0};
};

/// Indexed triangles, counter-clockwise seen from the front.
struct TriangleMeshShape {
  std::vector<Vec3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Vec3> normals{};  ///< [vertex], any length; 0: flat there; empty: flat triangles
  std::vector<Vec2>
      uvs{};  ///< [vertex], (0, 0) is an image's upper left corner; empty: no textures
};

/// Indexed quadrilaterals, counter-clockwise; split along the diagonal 1-3 where they are not flat.
struct QuadMeshShape {
  std::vector<Vec3d> vertices;
  std::vector<std::array<std::uint32_t, 4>> quads;
};

/// Catmull-Clark subdivision surface of a control cage, tessellated with a fixed level.
struct SubdivisionShape {
  std::vector<Vec3d> vertices;
  std::vector<std::uint32_t> face_sizes;  ///< corners of each face, >= 3
  std::vector<std::uint32_t> indices;     ///< of all faces in turn, counter-clockwise
  int level{4};                           ///< segments per edge of the cage, in [1, 64]
};

using Shape =
    std::variant<RectangleShape, SphereShape, TriangleMeshShape, QuadMeshShape, SubdivisionShape>;

struct ShapeDescription {
  std::string name;           ///< unique; names a light in tables and maps
  std::uint32_t material{0};  ///< index into SceneDescription::materials
  Shape shape;
  std::optional<EmissionDescription> emission;
};

/// Radiance from infinitely far away on a latitude-longitude grid (environment.h); one texel: the
/// same from everywhere.
struct EnvironmentDescription {
  std::string name{"environment"};  ///< unique among shapes and lights
  std::uint32_t columns{1}, rows{1};
  std::vector<Rgb> texels;  ///< row-major [W/(m^2 sr)], each channel finite and >= 0
  double rotation_deg{0};   ///< azimuth of column 0, from +x over +z; finite
};

/// A light without extent.
struct PointLightDescription {
  std::string name;  ///< unique among shapes and lights
  Vec3d position{0.0};
  Vec3d intensity{1.0};  ///< RGB: irradiance x distance^2, so [W/sr] where lengths are metres; each
                         ///< channel finite and >= 0
};

/// A light without extent that shines into a cone. The intensity falls from the inner to the outer
/// angle with the square of the linear share of cosines, as in glTF's KHR_lights_punctual.
struct SpotLightDescription {
  std::string name;  ///< unique among shapes and lights
  Vec3d position{0.0};
  Vec3d direction{0, 0, -1};   ///< of the axis, away from the light; any length but 0
  Vec3d intensity{1.0};        ///< on the axis, as PointLightDescription::intensity
  double inner_angle_deg{0};   ///< half angle of the undimmed part, in [0, outer)
  double outer_angle_deg{45};  ///< half angle beyond which there is no light, in (0, 90]
};

/// Parallel light from infinitely far away.
struct DirectionalLightDescription {
  std::string name;           ///< unique among shapes and lights
  Vec3d direction{0, -1, 0};  ///< in which the light travels; any length but 0
  Rgb irradiance{1.0f};       ///< on a surface that faces the light [W/m^2]
};

struct CameraDescription {
  Vec3d position{0, 0, 0};
  Vec3d look_at{0, 0, -1};
  Vec3d up{0, 1, 0};
  double vertical_fov_deg{45};              ///< full angle, in (0, 180)
  std::array<int, 2> resolution{480, 270};  ///< width, height [pixels]
};

struct SceneDescription {
  std::string name;
  std::string summary;  ///< one sentence: what the scene stresses
  CameraDescription camera;
  std::vector<MaterialDescription> materials;
  std::vector<ShapeDescription> shapes;
  std::vector<PointLightDescription> point_lights;
  std::vector<SpotLightDescription> spot_lights;
  std::vector<DirectionalLightDescription> directional_lights;
  std::optional<EnvironmentDescription> environment;
  std::vector<std::string> warnings;  ///< e.g. degenerate triangles that were left out
  /// Where shapes of type "model" came from; "own" where there is none of them.
  std::string geometry{"own"};  ///< "own", "generated" or "models"
};

/// Whether anything gives light, black or not.
inline bool has_light(const SceneDescription& scene) {
  return !scene.point_lights.empty() || !scene.spot_lights.empty() ||
         !scene.directional_lights.empty() || scene.environment ||
         std::any_of(scene.shapes.begin(), scene.shapes.end(),
                     [](const ShapeDescription& shape) { return shape.emission.has_value(); });
}

}  // namespace penumbra
