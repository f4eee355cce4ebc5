// Reflection at the ends of roughness and angle: the naive formulas fail the checks that the BSDFs
// pass here and in core/bsdf_test.cpp.

#include "scenes/core/bsdf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "scenes/core/frame.h"
#include "scenes/core/microfacet.h"
#include "tests/stability/naive.h"
#include "tests/support/fixtures.h"
#include "tests/support/scenes_support.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using Real = long double;

const Vec3 kUp(0.0f, 0.0f, 1.0f);

Vec3 at_cosine(double cosine, double phi = 0.0) {
  const double sine = std::sqrt((1.0 - cosine) * (1.0 + cosine));
  return Vec3(Vec3d(sine * std::cos(phi), sine * std::sin(phi), cosine));
}

Bsdf conductor(float alpha) {
  ConductorMaterial material;
  material.eta = Rgb(1e-4f);  // Fresnel is 1
  material.k = Rgb(1e4f);
  material.alpha = alpha;
  return Bsdf(MaterialDescription{"metal", material});
}

// Density of normals from the cosine alone.
PN_NAIVE float ggx_by_cosine(const Vec3& h, float alpha) {
  const float alpha2 = alpha * alpha;
  const float t = h.z * h.z * (alpha2 - 1.0f) + 1.0f;
  return alpha2 / (kPi * t * t);
}

// Walter et al. 2007, eq. 33, of the same float vector.
double exact_ggx(const Vec3& h, float alpha) {
  const Real x = h.x, y = h.y, z = h.z;
  const Real a2 = static_cast<Real>(alpha) * static_cast<Real>(alpha);
  const Real tan2 = (x * x + y * y) / (z * z);
  const Real cos2 = z * z / (x * x + y * y + z * z);
  return static_cast<double>(a2 /
                             (std::numbers::pi_v<Real> * cos2 * cos2 * (a2 + tan2) * (a2 + tan2)));
}

// Largest relative error over normals drawn in proportion to their projected area.
template <typename Density>
double worst_density(float alpha, Density density) {
  test::TestRandom random;
  double worst = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double v = random.uniform(0.0, 0.9999);
    const double tangent = double{alpha} * std::sqrt(v / (1.0 - v));
    const double phi = random.uniform(0.0, 2.0 * std::numbers::pi);
    const Vec3 h(Vec3d(tangent * std::cos(phi), tangent * std::sin(phi), 1.0).normalized());
    worst = std::max(worst, std::abs(double{density(h, alpha)} / exact_ggx(h, alpha) - 1.0));
  }
  return worst;
}

TEST(SharpGgx, DensityKeepsItsDigitsAndThatByTheCosineDoesNot) {
  for (const float alpha : {1.0f, 0.1f, 1e-2f, 1e-3f, 3e-4f, 1e-4f}) {
    EXPECT_LT(worst_density(alpha, ggx_distribution), 1e-5) << alpha;
    if (alpha <= 1e-2f) {
      EXPECT_GT(worst_density(alpha, ggx_by_cosine), 1e-5) << alpha << ": negative control";
    }
  }
  EXPECT_GT(worst_density(1e-4f, ggx_by_cosine), 1.0);
}

// f cos/pdf of a direction reflected by the normal h, as usually written: masking by tangents, and
// divisions by both cosines.
PN_NAIVE float naive_lambda(const Vec3& w, float alpha) {
  const float tangent = std::sqrt(1.0f - w.z * w.z) / w.z;
  return 0.5f * (std::sqrt(1.0f + alpha * alpha * tangent * tangent) - 1.0f);
}

PN_NAIVE float naive_weight(const Vec3& wo, const Vec3& wi, float alpha) {
  const float g1 = 1.0f / (1.0f + naive_lambda(wo, alpha));
  const float g2 = 1.0f / (1.0f + naive_lambda(wo, alpha) + naive_lambda(wi, alpha));
  const float f = g2 / (4.0f * wo.z * wi.z);
  const float pdf = g1 * std::max(0.0f, wo.z) / wo.z / (4.0f * wo.z);
  return f * wi.z / pdf;
}

TEST(GrazingFurnace, GainsNothingDownToACosineOf1eMinus20) {
  test::TestRandom random;
  int naive_failures = 0;
  for (const float alpha : {1e-4f, 1e-3f, 0.1f, 1.0f}) {
    const Bsdf bsdf = conductor(alpha);
    for (const double cosine : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-12, 1e-20}) {
      const Vec3 wo = at_cosine(cosine);
      const BoundBsdf bound(bsdf, wo);
      double sum = 0.0;
      constexpr int kDraws = 3000;
      for (int i = 0; i < kDraws; ++i) {
        const auto wi = bound.sample(random.variates());
        if (!wi) continue;
        const BsdfValue value = bound.evaluate(*wi);
        ASSERT_TRUE(std::isfinite(value.pdf_w) && value.pdf_w > 0.0f) << alpha << " " << cosine;
        const double weight = double{value.f_cos.x} / double{value.pdf_w};
        ASSERT_LE(weight, 1.0 + 1e-4) << alpha << " " << cosine;
        sum += weight;
        const float naive = naive_weight(wo, *wi, alpha);
        naive_failures += std::isfinite(naive) && naive <= 1.0f + 1e-4f ? 0 : 1;
      }
      EXPECT_LE(sum / kDraws, 1.0 + 1e-4);
    }
  }
  EXPECT_GT(naive_failures, 100) << "negative control";
}

PN_NAIVE Vec3 naive_half_vector(const Vec3& a, const Vec3& b) {
  const Vec3 sum = a + b;
  return sum * (1.0f / std::sqrt(dot(sum, sum)));
}

TEST(OppositeDirections, ReflectNothingWhereTheNaiveHalfVectorIsNoNumber) {
  for (const float alpha : {1e-4f, 1.0f}) {
    const Bsdf bsdf = conductor(alpha);
    for (const float z : {1e-25f, 1e-38f}) {
      const Vec3 wo(1.0f, 0.0f, z);
      const Vec3 wi(-1.0f, 0.0f, z);
      const BsdfValue value = BoundBsdf(bsdf, wo).evaluate(wi);
      EXPECT_EQ(value.pdf_w, 0.0f);
      EXPECT_TRUE(is_black(value.f_cos));
      EXPECT_FALSE(std::isfinite(naive_half_vector(wo, wi).x)) << "negative control";
    }
  }
}

// A floor that reflects a panel: the sharper its lobe, the closer to a mirror, whose answer is
// exact: the panel's radiance times the reflectance.
TEST(SharpGgx, ConvergesToTheMirror) {
  double error = 1.0;
  for (const float alpha : {0.1f, 1e-2f, 1e-3f, 1e-4f}) {
    SceneDescription description;
    description.materials = {fixtures::lambert("black", 0.0)};
    ConductorMaterial metal;
    metal.eta = Rgb(1e-4f);
    metal.k = Rgb(1e4f);
    metal.alpha = alpha;
    description.materials.push_back({"metal", metal});
    description.shapes = {
        fixtures::rectangle("floor", 0, {-2, -2, -0.5}, {4, 0, 0}, {0, 4, 0}, 0.0),
        fixtures::rectangle("panel", 0, {-0.2, -0.2, 1}, {0, 0.4, 0}, {0.4, 0, 0}, 1.0)};
    fixtures::PlacedPoint placed{std::make_unique<Scene>(description), {}};
    placed.point = fixtures::place(*placed.scene, Vec3d(0.0), {0, 0, 1}, {0, 0, 1}, 1);
    for (const char* name : {"mis", "bsdf"}) {
      const EstimatorEntry& entry = *find_estimator(name);
      const auto run = fixtures::estimate_many(entry, fixtures::params_with(entry, {}),
                                               Budget{SamplerKind::Independent, 16, 0}, placed, 1.0,
                                               fixtures::test_seed(name), 20000);
      EXPECT_EQ(run.non_finite + run.negative + run.counters.uncovered, 0u);
      // Share of normals that lean less than half of the panel's angle, 0.1 rad, of 1/(1 + tan^2/
      // alpha^2): what is lost of the mirror's 1 is alpha^2/0.01 at most.
      const double lost = double{alpha} * double{alpha} / 0.01;
      EXPECT_LT(1.0 - run.mean, lost + 5.0 * run.standard_error() + 1e-4) << name << " " << alpha;
      EXPECT_LT(run.mean, 1.0 + 5.0 * run.standard_error() + 1e-4) << name << " " << alpha;
      if (std::string(name) == "bsdf") {
        EXPECT_LE(std::abs(run.mean - 1.0), error + 1e-4) << "closer than before";
        error = std::abs(run.mean - 1.0);
      }
    }
  }
  EXPECT_LT(error, 1e-3);
}

// Hughes and Moeller 1999 build a basis from 1/(1 + n.z).
PN_NAIVE float worst_naive_basis(const Vec3& n) {
  const float a = 1.0f / (1.0f + n.z);
  const Vec3 x(1.0f - n.x * n.x * a, -n.x * n.y * a, -n.x);
  const Vec3 y(-n.x * n.y * a, 1.0f - n.y * n.y * a, -n.y);
  const float error =
      std::max({std::abs(x.length() - 1.0f), std::abs(y.length() - 1.0f), std::abs(dot(x, y))});
  return std::isfinite(error) ? error : std::numeric_limits<float>::infinity();
}

TEST(FrameControl, ABasisByOnePlusZFailsNextToTheSouthPole) {  // of Frame.IsOrthonormal... in core
  EXPECT_LT(worst_naive_basis({0, 0.6f, 0.8f}), 1e-6f);
  int failures = 0;
  for (const float tilt : {0.0f, 1e-8f, 1e-4f, 3e-4f, 1e-3f}) {
    const Vec3 n = Vec3(tilt, 0.5f * tilt, -1.0f).normalized();
    failures += worst_naive_basis(n) > 1e-6f ? 1 : 0;
    const Frame frame(n);
    const Vec3 x = frame.to_world({1, 0, 0});
    const Vec3 y = frame.to_world({0, 1, 0});
    EXPECT_LT(std::max({std::abs(x.length() - 1.0f), std::abs(y.length() - 1.0f),
                        std::abs(dot(x, y)), std::abs(dot(x, n)), std::abs(dot(y, n))}),
              1e-6f)
        << tilt;
  }
  EXPECT_GE(failures, 3);
}

}  // namespace
}  // namespace penumbra
