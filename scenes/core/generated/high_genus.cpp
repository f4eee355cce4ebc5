#include <cmath>

#include "scenes/core/generated/distances.h"
#include "scenes/core/generated/generated.h"
#include "scenes/core/generated/isosurface.h"

namespace penumbra {
namespace {

constexpr double kPeriod = 0.62;
constexpr double kHalfThickness = 0.035;
const Vec3d kRadii(1.2, 0.82, 0.82);
const Vec3d kCenter(0.0, 0.8, 0.0);

// Distance to the gyroid sin x cos y + sin y cos z + sin z cos x = 0, to first order.
double gyroid_distance(const Vec3d& p) {
  const double w = 2.0 * M_PI / kPeriod;
  const Vec3d q = p * w;
  const Vec3d s(std::sin(q.x), std::sin(q.y), std::sin(q.z));
  const Vec3d c(std::cos(q.x), std::cos(q.y), std::cos(q.z));
  const double value = s.x * c.y + s.y * c.z + s.z * c.x;
  const Vec3d gradient(c.x * c.y - s.z * s.x, c.y * c.z - s.x * s.y, c.z * c.x - s.y * s.z);
  // The gradient vanishes where the field is extreme, far from the sheet.
  return value / (w * std::max(gradient.length(), 0.5));
}

double field(const Vec3d& p) {
  const double body = generated::ellipsoid(p, kCenter, kRadii);
  if (body > 0.1) return body;
  const double sheet = std::abs(gyroid_distance(p - kCenter)) - kHalfThickness;
  return generated::smooth_max(sheet, body, 0.03);
}

}  // namespace

TriangleMeshShape generate_high_genus(double detail) {
  const Vec3d margin(0.08);
  return polygonise(field, {kCenter - kRadii - margin, kCenter + kRadii + margin, 0.024 / detail});
}

}  // namespace penumbra
