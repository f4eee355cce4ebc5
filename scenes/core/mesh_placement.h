#pragma once

#include <optional>

#include "scenes/core/scene_description.h"

/// What is done to the mesh of a model before it becomes a shape of a scene.
namespace penumbra {

/// How a model is set into a scene.
struct ModelPlacement {
  std::vector<Vec3d> rotations_deg;  ///< one after the other; each about x, then y, then z
  std::optional<double> height;      ///< of the bounding box after rotation; sets the scale
  double scale{1.0};                 ///< where there is no height
  /// Where the centre of the bounding box's base goes; without it the origin stays in place.
  std::optional<Vec3d> position;
};

/// The bounding box is that of the vertices: of a subdivision surface, that of its cage.
/// @return false, with nothing changed, where a height is asked for and the model has none
bool place_mesh(TriangleMeshShape& mesh, const ModelPlacement& placement);
bool place_mesh(SubdivisionShape& cage, const ModelPlacement& placement);

/// Appends a mesh. Normals and texture coordinates are kept where either has them; vertices of the
/// other then have none (0).
void append_mesh(TriangleMeshShape& mesh, const TriangleMeshShape& other);
void append_mesh(SubdivisionShape& cage, const SubdivisionShape& other);

/// Gives the vertices that have no normal the mean of their faces' normals, weighted by area.
/// Vertices are smooth where faces share them: a file that repeats a position keeps an edge there.
void smooth_normals(TriangleMeshShape& mesh);

/// Sets normals that are not finite to 0, the face's own.
/// @return how many
std::size_t drop_unusable_normals(TriangleMeshShape& mesh);

}  // namespace penumbra
