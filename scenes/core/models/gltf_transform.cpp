#include "scenes/core/models/gltf_transform.h"

namespace penumbra {
namespace {

Vec3d row(const Imath::M44d& m, int i) { return {m[i][0], m[i][1], m[i][2]}; }

}  // namespace

Placement::Placement(const Imath::M44d& world_from_local) : matrix_(world_from_local) {
  const Vec3d x = row(matrix_, 0), y = row(matrix_, 1), z = row(matrix_, 2);
  mirrors_ = x.dot(y.cross(z)) < 0.0;
  // The inverse transpose times |determinant|, which exists for flattening transforms as well. The
  // sign makes normals of mirrored surfaces stay on their side.
  const double sign = mirrors_ ? -1.0 : 1.0;
  const Vec3d rows[3] = {y.cross(z) * sign, z.cross(x) * sign, x.cross(y) * sign};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) cofactors_[i][j] = rows[i][j];
  }
}

Vec3d Placement::vector(const Vec3d& local) const {
  Vec3d result;
  matrix_.multDirMatrix(local, result);
  return result;
}

Vec3d Placement::normal(const Vec3d& local) const { return local * cofactors_; }

}  // namespace penumbra
