#include "scenes/core/models/gltf_transform.h"

#include <cmath>

namespace penumbra {
namespace {

Vec3d row(const Imath::M44d& m, int i) { return {m[i][0], m[i][1], m[i][2]}; }

Imath::M44d rotation(const GltfDocument& document, const std::vector<double>& xyzw, int index) {
  const double length = std::hypot(std::hypot(xyzw[0], xyzw[1]), std::hypot(xyzw[2], xyzw[3]));
  // Stored in single precision, a unit quaternion is off by some 1e-7.
  if (!(std::abs(length - 1.0) < 1e-3)) {
    document.fault("node " + std::to_string(index) + ": rotation must have length 1, found " +
                   std::to_string(length));
  }
  const double x = xyzw[0] / length, y = xyzw[1] / length, z = xyzw[2] / length,
               w = xyzw[3] / length;
  Imath::M44d m;
  const double rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)},
                             {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)},
                             {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m[i][j] = rows[i][j];
  }
  return m;
}

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

Imath::M44d local_matrix(const GltfDocument& document, int index) {
  const tinygltf::Node& node = document.at(document.model().nodes, index, "node");
  const auto check = [&](const std::vector<double>& values, std::size_t size, const char* name) {
    if (values.empty() || values.size() == size) return;
    document.fault("node " + std::to_string(index) + ": " + name + " needs " +
                   std::to_string(size) + " numbers, found " + std::to_string(values.size()));
  };
  check(node.matrix, 16, "matrix");
  check(node.translation, 3, "translation");
  check(node.rotation, 4, "rotation");
  check(node.scale, 3, "scale");
  // Rows of Imath's matrices are glTF's columns, so the numbers keep their order.
  Imath::M44d m;
  if (!node.matrix.empty()) {
    for (std::size_t i = 0; i < 16; ++i) {
      m[static_cast<int>(i / 4)][static_cast<int>(i % 4)] = node.matrix[i];
    }
    if (m[0][3] != 0.0 || m[1][3] != 0.0 || m[2][3] != 0.0 || m[3][3] != 1.0) {
      document.fault("node " + std::to_string(index) +
                     ": the last row of its matrix must be 0, 0, 0, 1");
    }
    return m;
  }
  if (!node.rotation.empty()) m = rotation(document, node.rotation, index);
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    const double scale = node.scale.empty() ? 1.0 : node.scale[k];
    for (int j = 0; j < 3; ++j) m[axis][j] *= scale;
    m[3][axis] = node.translation.empty() ? 0.0 : node.translation[k];
  }
  return m;
}

}  // namespace penumbra
