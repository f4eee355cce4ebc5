#pragma once

#include <ImathMatrix.h>

#include "scenes/core/models/gltf_document.h"
#include "scenes/core/vec.h"

namespace penumbra {

/// Where a node of glTF puts its contents, in double precision.
class Placement {
 public:
  Placement() = default;
  /// @param world_from_local  for row vectors, as Imath has it
  explicit Placement(const Imath::M44d& world_from_local);

  const Imath::M44d& matrix() const { return matrix_; }
  Vec3d point(const Vec3d& local) const { return local * matrix_; }
  /// An edge between two points.
  Vec3d vector(const Vec3d& local) const;
  /// A normal: by the inverse transpose, up to its length, which may become 0.
  Vec3d normal(const Vec3d& local) const;
  /// Whether the orientation of triangles turns round.
  bool mirrors() const { return mirrors_; }

 private:
  Imath::M44d matrix_;
  Imath::M33d cofactors_;
  bool mirrors_{false};
};

/// A node's own transform: its matrix, or scale, then rotation, then translation.
/// @param node  that exists
/// @throws InputError when a property has a wrong size, or a rotation another length than 1
Imath::M44d local_matrix(const GltfDocument& document, int node);

}  // namespace penumbra
