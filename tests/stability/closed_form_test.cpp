// The answers of the stability suite against plain quadrature in double precision: midpoint sums
// over directions or over the light's area, which share nothing with the closed forms. No chance is
// involved; tolerances are what the midpoint rule leaves at the cells' size.

#include "harness/stability/closed_form.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "harness/stability/glossy_answer.h"

namespace penumbra::stability {
namespace {

/// Integral over the hemisphere about z, cells of equal size in polar angle and azimuth.
double over_hemisphere(int rows, const std::function<double(const Vec3d&)>& f) {
  double sum = 0;
  for (int i = 0; i < rows; ++i) {
    const double theta = 0.5 * M_PI * (i + 0.5) / rows;
    double row = 0;
    for (int j = 0; j < 4 * rows; ++j) {
      const double phi = 2 * M_PI * (j + 0.5) / (4 * rows);
      row += f({std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
    }
    sum += row * std::sin(theta);
  }
  return sum * (0.5 * M_PI / rows) * (2 * M_PI / (4 * rows));
}

/// Irradiance from a parallelogram by its area; only what is above the horizon.
double over_area(const Vec3d& origin, const Vec3d& u, const Vec3d& v, const Vec3d& from,
                 const Vec3d& normal, int cells) {
  const Vec3d across = u.cross(v);
  double sum = 0;
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      const Vec3d d = origin + u * ((i + 0.5) / cells) + v * ((j + 0.5) / cells) - from;
      const double r2 = d.dot(d);
      sum += std::max(0.0, d.dot(normal)) * std::abs(d.dot(across)) / (r2 * r2);
    }
  }
  return sum / (cells * cells);
}

std::vector<Vec3d> corners(const Vec3d& o, const Vec3d& u, const Vec3d& v) {
  return {o, o + u, o + u + v, o + v};
}

TEST(StabilityAnswers, PolygonAboveTheHorizonIsTheIntegralOverItsArea) {
  const Vec3d from(0.1, -0.2, 0.05);
  const Vec3d normal = Vec3d(0.2, -0.1, 1).normalized();
  const Vec3d o(-0.4, -0.3, 1.5);
  const Vec3d u(0.3, 1.1, 0.1);
  const Vec3d v(1.1, -0.3, 0.2);
  const double exact = polygon_irradiance(corners(o, u, v), from, normal);
  EXPECT_NEAR(exact / over_area(o, u, v, from, normal, 400), 1, 1e-5);
}

TEST(StabilityAnswers, PolygonIsCutAtTheHorizon) {
  const Vec3d from(0);
  const Vec3d normal(0, 0, 1);
  for (const double height : {0.5, 0.05, 0.005}) {
    const Vec3d o(-0.5, 0.5, -0.5);
    const Vec3d u(1, 0, 0);
    const double exact = polygon_irradiance(corners(o, u, {0, 0, 0.5 + height}), from, normal);
    // Only the part above, so that no cell is cut.
    const double above = over_area({-0.5, 0.5, 0}, u, {0, 0, height}, from, normal, 400);
    EXPECT_NEAR(exact / above, 1, 1e-5) << height;
  }
  EXPECT_EQ(polygon_irradiance(corners({-0.5, 0.5, -1}, {1, 0, 0}, {0, 0, 0.5}), from, normal), 0);
}

TEST(StabilityAnswers, PolygonsKeepTheirDigitsWhenTheyAreTiny) {
  const Vec3d from(0);
  const Vec3d normal(0, 0, 1);
  const Vec3d o(0.3, 0.2, 1);
  const double r2 = o.dot(o);
  for (const double side : {1e-3, 1e-4, 1e-5}) {
    const double exact = polygon_irradiance(corners(o, {side, 0, 0}, {0, side, 0}), from, normal);
    // cos cos / r^2 at the centre; what is left out is of second order in the side.
    const Vec3d c = o + Vec3d(0.5 * side, 0.5 * side, 0);
    const double centre = side * side * c.z * c.z / (c.dot(c) * c.dot(c));
    EXPECT_NEAR(exact / centre, 1, 2 * side * side / r2 + 1e-7) << side;
  }
}

TEST(StabilityAnswers, SphereIsTheIntegralOverItsDirections) {
  const Vec3d center(0.4, -0.3, 1.2);
  const double radius = 0.5;
  const double exact = sphere_irradiance(center, radius, Vec3d(0), {0, 0, 1});
  const Vec3d axis = center.normalized();
  const double cosine = std::sqrt(1 - radius * radius / center.dot(center));
  const double sum =
      over_hemisphere(1500, [&](const Vec3d& w) { return w.dot(axis) >= cosine ? w.z : 0.0; });
  EXPECT_NEAR(exact / sum, 1, 1e-3);
}

TEST(StabilityAnswers, SkyPatchIsTheIntegralOverItsTexel) {
  const double theta0 = 0.25 * M_PI;
  const double theta1 = theta0 + M_PI / 16;
  const double width = M_PI / 16;
  double sum = 0;
  constexpr int kRows = 2000;
  for (int i = 0; i < kRows; ++i) {
    const double theta = theta0 + (theta1 - theta0) * (i + 0.5) / kRows;
    sum += std::cos(theta) * std::sin(theta);
  }
  sum *= width * (theta1 - theta0) / kRows;
  EXPECT_NEAR(sky_patch_irradiance(theta0, theta1, width) / sum, 1, 1e-7);
}

TEST(StabilityAnswers, BentNormalIsTheIntegralOverTheLune) {
  for (const double angle : {0.0, 0.5, 1.2, 1.5}) {
    const Vec3d bent(std::sin(angle), 0, std::cos(angle));
    const double sum =
        over_hemisphere(1000, [&](const Vec3d& w) { return std::max(0.0, w.dot(bent)); });
    EXPECT_NEAR(bent_normal_irradiance(angle) / sum, 1, 1e-5) << angle;
  }
}

TEST(StabilityAnswers, PhongCapIsTheIntegralOverTheCap) {
  for (const double exponent : {1.0, 20.0, 400.0}) {
    const double sine = 0.3;
    constexpr int kRows = 4000;
    double sum = 0;
    for (int i = 0; i < kRows; ++i) {
      const double theta = std::asin(sine) * (i + 0.5) / kRows;
      const double c = std::cos(theta);
      const double brdf = 0.2 / M_PI + 0.7 * (exponent + 2) / (2 * M_PI) * std::pow(c, exponent);
      sum += brdf * c * 2 * M_PI * std::sin(theta);
    }
    sum *= std::asin(sine) / kRows;
    EXPECT_NEAR(phong_cap_radiance(0.2, 0.7, exponent, sine) / sum, 1, 1e-6) << exponent;
  }
}

TEST(StabilityAnswers, ConductorAtNormalIncidenceIsTheTextbookFormula) {
  for (const double k : {0.0, 1.0, 3.9}) {
    const double eta = 0.2;
    const double expected = ((eta - 1) * (eta - 1) + k * k) / ((eta + 1) * (eta + 1) + k * k);
    EXPECT_NEAR(conductor_reflectance(1, eta, k), expected, 1e-12);
  }
  EXPECT_NEAR(conductor_reflectance(0, 0.2, 3.9), 1, 1e-12);
}

TEST(StabilityAnswers, GlossyAlbedoIsTheIntegralOverDirections) {
  for (const double alpha : {0.1, 0.3, 1.0}) {
    for (const double cosine : {1.0, 0.6, 0.1}) {
      const GlossyPoint point{alpha, 0.2, 3.9, {std::sqrt(1 - cosine * cosine), 0, cosine}};
      const double sum =
          over_hemisphere(700, [&](const Vec3d& w) { return glossy_f_cos(point, w); });
      EXPECT_NEAR(glossy_albedo(point) / sum, 1, 2e-4) << alpha << ' ' << cosine;
    }
  }
}

// In half angles about the grazing view the lobe is long and thin; cells that shrink towards the
// horizon resolve it.
TEST(StabilityAnswers, GlossyAlbedoHoldsAtGrazingAngles) {
  for (const double cosine : {1e-2, 1e-3, 1e-4}) {
    const GlossyPoint point{0.3, 0.2, 3.9, {std::sqrt(1 - cosine * cosine), 0, cosine}};
    constexpr int kRows = 2000;
    double sum = 0;
    for (int i = 0; i < kRows; ++i) {
      // z = exp(-t): d omega = z dt dphi
      const double t = 20 * (i + 0.5) / kRows;
      const double z = std::exp(-t);
      const double r = std::sqrt(1 - z * z);
      for (int j = 0; j < 1000; ++j) {
        const double phi = 2 * M_PI * (j + 0.5) / 1000;
        sum += z * glossy_f_cos(point, {r * std::cos(phi), r * std::sin(phi), z});
      }
    }
    sum *= 20.0 / kRows * 2 * M_PI / 1000;
    EXPECT_NEAR(glossy_albedo(point) / sum, 1, 1e-3) << cosine;
  }
}

TEST(StabilityAnswers, GlossyReflectionOfASquareIsTheIntegralOverItsArea) {
  const Vec3d wo = Vec3d(-1, 0, 1).normalized();
  const Vec3d mirrored = Vec3d(1, 0, 1).normalized();
  const Vec3d up = Vec3d(-1, 0, 1).normalized();
  for (const double alpha : {1.0, 0.1, 0.03}) {
    const GlossyPoint point{alpha, 0.2, 3.9, wo};
    const double exact = glossy_radiance(point, [&](const Vec3d& w) {
      const Vec3d p = w / w.dot(mirrored) - mirrored;
      return w.dot(mirrored) > 0 && std::abs(p.y - 0.03) <= 0.15 &&
             std::abs(p.dot(up) + 0.01) <= 0.15;
    });
    constexpr int kCells = 1500;
    double sum = 0;
    for (int i = 0; i < kCells; ++i) {
      for (int j = 0; j < kCells; ++j) {
        const Vec3d d = mirrored + Vec3d(0, -0.12 + 0.3 * (i + 0.5) / kCells, 0) +
                        up * (-0.16 + 0.3 * (j + 0.5) / kCells);
        const double r = d.length();
        sum += glossy_f_cos(point, d / r) * d.dot(mirrored) / (r * r * r);
      }
    }
    sum *= 0.09 / (kCells * kCells);
    EXPECT_NEAR(exact / sum, 1, 1e-4) << alpha;
  }
}

TEST(StabilityAnswers, SmoothMetalReflectsWhatAMirrorWould) {
  const Vec3d wo = Vec3d(-1, 0, 1).normalized();
  const Vec3d mirrored = Vec3d(1, 0, 1).normalized();
  const GlossyPoint point{1e-4, 0.2, 3.9, wo};
  const double exact =
      glossy_radiance(point, [&](const Vec3d& w) { return (w - mirrored).length() < 0.1; });
  EXPECT_NEAR(exact / conductor_reflectance(wo.z, 0.2, 3.9), 1, 1e-5);
}

}  // namespace
}  // namespace penumbra::stability
