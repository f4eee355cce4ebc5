#include "scenes/core/bsdf.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

using test::SphereGrid;
using Real = long double;

// All statistical checks of this file together (fewer than 300) raise a false alarm with
// probability 1e-4.
const double kLevel = test::sidak(1e-4, 300);
const Vec3 kUp(0.0f, 0.0f, 1.0f);

MaterialDescription conductor(float alpha, float eta = 0.2f, float k = 3.9f) {
  return {"conductor " + std::to_string(alpha),
          ConductorMaterial{Rgb(eta), Rgb(k), alpha, Rgb(1.0f)}};
}
MaterialDescription mirror_like(float alpha) { return conductor(alpha, 0.01f, 1e4f); }
MaterialDescription phong(float diffuse, float specular, float exponent) {
  return {"phong " + std::to_string(exponent),
          PhongMaterial{Rgb(diffuse), Rgb(specular), exponent}};
}
MaterialDescription mixture(float reflectance, float alpha, float weight) {
  MixtureMaterial m;
  m.diffuse.reflectance = Rgb(reflectance);
  m.glossy.alpha = alpha;
  m.glossy_weight = weight;
  return {"mixture " + std::to_string(alpha), m};
}
MaterialDescription coated(float color, float metallic, float roughness) {
  return {"metallic-roughness " + std::to_string(metallic) + " " + std::to_string(roughness),
          MetallicRoughnessMaterial{Rgb(color), metallic, roughness}};
}
MaterialDescription lambertian(float reflectance) {
  return {"lambert", LambertMaterial{Rgb(reflectance)}};
}

std::vector<MaterialDescription> broad_materials() {
  return {lambertian(0.7f),         conductor(1.0f),           conductor(0.5f),
          conductor(0.15f),         phong(0.4f, 0.5f, 20.0f),  phong(0.0f, 1.0f, 5.0f),
          phong(0.8f, 0.0f, 9.0f),  mixture(0.5f, 0.2f, 0.5f), mixture(0.9f, 0.3f, 0.05f),
          coated(0.8f, 0.0f, 1.0f), coated(1.0f, 0.0f, 0.45f), coated(0.9f, 1.0f, 0.5f),
          coated(0.6f, 0.4f, 0.7f), coated(0.0f, 0.0f, 0.5f)};
}
std::vector<MaterialDescription> sharp_materials() {
  return {conductor(1e-2f),        conductor(1e-3f),        conductor(1e-4f),
          phong(0.0f, 1.0f, 1e4f), phong(0.0f, 1.0f, 1e6f), coated(1.0f, 1.0f, 0.05f),
          coated(1.0f, 1.0f, 0.0f)};
}
std::vector<MaterialDescription> all_materials() {
  auto all = broad_materials();
  for (auto& m : sharp_materials()) all.push_back(m);
  all.push_back(mixture(0.5f, 1e-3f, 0.5f));
  all.push_back(phong(0.3f, 0.6f, 1e5f));
  for (const float roughness : {0.0f, 0.1f, 1.0f}) {
    all.push_back(coated(1.0f, 0.0f, roughness));
    all.push_back(coated(0.7f, 0.5f, roughness));
  }
  all.push_back({"mirror", MirrorMaterial{Rgb(0.9f)}});
  return all;
}

Vec3 at_cosine(float cosine, double azimuth = 0.7) {
  const double r = std::sqrt(1.0 - double{cosine} * double{cosine});
  return {static_cast<float>(r * std::cos(azimuth)), static_cast<float>(r * std::sin(azimuth)),
          cosine};
}

test::DirectionFit fit(const BoundBsdf& bsdf, const SphereGrid& grid, int draws, int sub) {
  test::TestRandom random;
  return test::fit_directions(
      grid, [&] { return bsdf.sample(random.variates()); },
      [&](const Vec3& wi) { return double{bsdf.evaluate(wi).pdf_w}; }, draws, sub);
}

class BsdfAtCosine : public testing::TestWithParam<float> {};
INSTANTIATE_TEST_SUITE_P(Outgoing, BsdfAtCosine, testing::Values(1.0f, 0.5f, 0.1f, 0.01f));

// Draws below the horizon are a bin of their own, whose expectation is 1 minus the integral of the
// density.
TEST_P(BsdfAtCosine, SampleMatchesPdfByChiSquare) {
  constexpr int kDraws = 60000;
  // At grazing angles the lobe is alpha (cos_o + cos_i) wide in azimuth.
  const int sub = GetParam() < 0.05f ? 64 : 24;
  for (const MaterialDescription& material : broad_materials()) {
    const Bsdf bsdf(material);
    const auto result =
        fit(BoundBsdf(bsdf, at_cosine(GetParam())), SphereGrid::cap(kUp, 1.0, 16, 24), kDraws, sub);
    EXPECT_GT(result.p, kLevel) << material.name << " cos " << GetParam();
    EXPECT_LT(result.integral, 1.0 + 1e-3) << material.name;
    const double spread =
        std::sqrt((result.missing + 1.0 / kDraws) * (1.0 - result.missing) / kDraws);
    EXPECT_NEAR(result.integral, 1.0 - result.missing, 1e-3 + test::z_bound(kLevel) * spread)
        << material.name;
  }
}

// At cosines below 0.1 the float directions do not resolve lobes this sharp.
TEST(Bsdf, NearSpecularSampleMatchesPdfByChiSquare) {
  for (const float cosine : {1.0f, 0.5f, 0.1f}) {
    const Vec3 wo = at_cosine(cosine);
    for (const MaterialDescription& material : sharp_materials()) {
      const Bsdf bsdf(material);
      double width = double{bsdf.min_alpha()};
      if (const auto* p = std::get_if<PhongMaterial>(&material.model)) {
        width = 1.0 / std::sqrt(double{p->exponent});
      }
      // Rings around the mirror direction in multiples of the lobe's width, up to the whole sphere.
      std::vector<double> edges = {0.0};
      for (double depth = 0.02 * width * width; depth < 2.0; depth *= 1.7) edges.push_back(depth);
      edges.push_back(2.0);
      const SphereGrid grid(Vec3(-wo.x, -wo.y, wo.z), edges, 12);
      const auto result = fit(BoundBsdf(bsdf, wo), grid, 40000, 16);
      EXPECT_GT(result.p, kLevel) << material.name << " cos " << cosine;
      EXPECT_NEAR(result.integral, 1.0 - result.missing, 5e-3) << material.name;
    }
  }
}

TEST(Bsdf, ChiSquareRejectsTheDensityOfAnotherAlpha) {  // negative control
  test::TestRandom random;
  const Bsdf drawn(conductor(0.5f));
  const Bsdf claimed(conductor(0.45f));
  const BoundBsdf sampled(drawn, at_cosine(0.5f));
  const BoundBsdf evaluated(claimed, at_cosine(0.5f));
  const auto result = test::fit_directions(
      SphereGrid::cap(kUp, 1.0, 16, 24), [&] { return sampled.sample(random.variates()); },
      [&](const Vec3& wi) { return double{evaluated.evaluate(wi).pdf_w}; }, 60000, 16);
  EXPECT_LT(result.p, kLevel);
}

TEST(Bsdf, SampledDirectionsHaveAPositiveFiniteDensity) {
  test::TestRandom random;
  for (const MaterialDescription& material : all_materials()) {
    const Bsdf bsdf(material);
    for (const float cosine : {1.0f, 0.7f, 0.1f, 0.01f, 1e-4f, 1e-6f}) {
      const BoundBsdf bound(bsdf, at_cosine(cosine));
      for (int i = 0; i < 3000; ++i) {
        Variates v = random.variates();
        if (i % 10 == 0) v.u.x = i % 20 == 0 ? 0.0f : 1.0f - 0x1p-24f;
        if (i % 15 == 0) v.u.y = i % 30 == 0 ? 0.0f : 1.0f - 0x1p-24f;
        const auto wi = bound.sample(v);
        if (!wi) continue;
        ASSERT_NEAR(wi->length(), 1.0f, 5e-7f) << material.name;
        const BsdfValue value = bound.evaluate(*wi);
        ASSERT_TRUE(value.pdf_w > 0.0f && std::isfinite(value.pdf_w))
            << material.name << " cos " << cosine << " u " << v.u << " wi " << *wi;
        ASSERT_TRUE(std::isfinite(value.f_cos.x) && value.f_cos.x >= 0.0f) << material.name;
      }
    }
  }
}

// f(a, b) = f(b, a), with f = f_cos/cos; the tolerance is some float roundings, magnified by a
// Phong exponent of 20.
RC_GTEST_PROP(Bsdf, IsReciprocal, (std::uint16_t a, std::uint16_t b, std::uint16_t turn)) {
  const Vec3 wo = at_cosine((static_cast<float>(a) + 0.5f) / 65536.0f, 0.0);
  const Vec3 wi =
      at_cosine((static_cast<float>(b) + 0.5f) / 65536.0f, static_cast<double>(turn) * 1e-4);
  for (const MaterialDescription& material : broad_materials()) {
    const Bsdf bsdf(material);
    const float forward = BoundBsdf(bsdf, wo).evaluate(wi).f_cos.x / wi.z;
    const float backward = BoundBsdf(bsdf, wi).evaluate(wo).f_cos.x / wo.z;
    RC_ASSERT(std::abs(forward - backward) <= 2e-5f * std::max(forward, backward) + 1e-12f);
  }
}

test::Moments albedo(const Bsdf& bsdf, const Vec3& wo, int draws, float* largest = nullptr) {
  test::TestRandom random;
  const BoundBsdf bound(bsdf, wo);
  test::Moments moments;
  for (int i = 0; i < draws; ++i) {
    const auto wi = bound.sample(random.variates());
    double weight = 0.0;
    if (wi) {
      const BsdfValue value = bound.evaluate(*wi);
      weight = double{value.f_cos.x} / double{value.pdf_w};
      if (largest != nullptr) *largest = std::max(*largest, static_cast<float>(weight));
    }
    moments.add(weight);
  }
  return moments;
}

TEST(Bsdf, WhiteFurnaceOfAMirrorLikeConductorGainsNothing) {
  for (const float alpha : {1e-4f, 1e-3f, 1e-2f, 0.1f, 0.5f, 1.0f}) {
    const Bsdf bsdf(mirror_like(alpha));
    for (const float cosine : {1.0f, 0.5f, 0.1f, 1e-2f, 1e-3f, 1e-4f, 1e-5f, 1e-6f, 1e-7f}) {
      // G2/G1 <= 1: no single sample gains energy, so the mean needs no error bound.
      float largest = 0.0f;
      const auto moments = albedo(bsdf, at_cosine(cosine), 3000, &largest);
      EXPECT_LE(largest, 1.0f + 1e-4f) << alpha << " cos " << cosine;
      EXPECT_GT(moments.mean(), alpha <= 1e-2f && cosine > 0.4f ? 0.99 : 0.0)
          << alpha << " cos " << cosine;
    }
  }
}

TEST(Bsdf, AlbedoIsTheClosedForm) {
  const Bsdf lambert(lambertian(0.7f));
  EXPECT_NEAR(albedo(lambert, at_cosine(0.3f), 1000).mean(), 0.7, 1e-6);
  // At normal incidence the modified Phong lobe integrates to ks, whatever the exponent.
  for (const float exponent : {1.0f, 5.0f, 20.0f, 1000.0f}) {
    const Bsdf bsdf(phong(0.4f, 0.5f, exponent));
    EXPECT_LT(albedo(bsdf, kUp, 50000).z(0.9, 1e-6), test::z_bound(kLevel)) << exponent;
  }
}

TEST(Bsdf, NoMaterialGainsEnergy) {
  for (const MaterialDescription& material : all_materials()) {
    const Bsdf bsdf(material);
    for (const float cosine : {1.0f, 0.5f, 0.1f, 1e-3f, 1e-6f}) {
      const auto moments = albedo(bsdf, at_cosine(cosine), 5000);
      EXPECT_LE(moments.mean() - test::z_bound(kLevel) * moments.standard_error(), 1.0 + 1e-4)
          << material.name << " cos " << cosine;
      EXPECT_TRUE(std::isfinite(moments.mean())) << material.name;
    }
  }
}

TEST(Bsdf, DegenerateDirectionsGiveZeroOrFiniteValues) {
  const Vec3 edge(1.0f, 0.0f, 1e-25f);  // |wo + wi|^2 underflows for the opposite edge
  for (const MaterialDescription& material : all_materials()) {
    const Bsdf bsdf(material);
    for (const Vec3& wo : {kUp, at_cosine(0.5f), at_cosine(1e-6f), edge}) {
      const BoundBsdf bound(bsdf, wo);
      const Vec3 mirrored(-wo.x, -wo.y, wo.z);
      for (const Vec3& wi : {-wo, Vec3(1, 0, 0), Vec3(0, 0, -1)}) {
        EXPECT_EQ(bound.evaluate(wi).pdf_w, 0.0f) << material.name;
        EXPECT_TRUE(is_black(bound.evaluate(wi).f_cos)) << material.name;
      }
      for (const Vec3& wi : {wo, mirrored, kUp, at_cosine(1e-6f), Vec3(-1.0f, 0.0f, 1e-25f)}) {
        const BsdfValue value = bound.evaluate(wi);
        EXPECT_TRUE(std::isfinite(value.pdf_w) && value.pdf_w >= 0.0f) << material.name << wo << wi;
        EXPECT_TRUE(std::isfinite(value.f_cos.x) && value.f_cos.x >= 0.0f)
            << material.name << wo << wi;
      }
    }
  }
}

// Exact density of the modified Phong lobe by powers of the cosine, in long double.
TEST(PhongBsdf, KeepsItsDigitsUpToTheLargestExponent) {
  test::TestRandom random;
  for (const float exponent : {1.0f, 100.0f, 1e4f, 1e6f}) {
    const Bsdf bsdf(phong(0.0f, 1.0f, exponent));
    for (int i = 0; i < 2000; ++i) {
      const Vec3 wo =
          at_cosine(static_cast<float>(random.uniform(0.2, 1.0)), random.uniform(0.0, 6.28));
      const BoundBsdf bound(bsdf, wo);
      const auto wi = bound.sample(random.variates());
      if (!wi) continue;
      const Imath::Vec3<Real> r(-wo.x, -wo.y, wo.z);
      const Imath::Vec3<Real> w(*wi);
      const Real cosine = r.dot(w) / std::sqrt(r.dot(r) * w.dot(w));
      const Real exact = (exponent + 1.0L) / (2.0L * std::numbers::pi_v<Real>)*std::pow(
                                                 cosine, static_cast<Real>(exponent));
      // Draws of u next to 0 lie 16 widths out, where the power magnifies a rounding by its
      // logarithm.
      EXPECT_NEAR(double{bound.evaluate(*wi).pdf_w} / static_cast<double>(exact), 1.0, 1e-4)
          << exponent << " " << wo;
    }
  }
}

// The textbook form of the microfacet model, with a tangent in every term, in long double.
TEST(ConductorBsdf, MatchesTheTextbookFormula) {
  test::TestRandom random;
  for (const float alpha : {1e-3f, 1e-2f, 0.1f, 0.5f, 1.0f}) {
    const Bsdf bsdf(mirror_like(alpha));
    for (int i = 0; i < 3000; ++i) {
      const Vec3 wo =
          at_cosine(static_cast<float>(random.uniform(0.05, 1.0)), random.uniform(0.0, 6.28));
      const BoundBsdf bound(bsdf, wo);
      const auto wi = bound.sample(random.variates());
      if (!wi || wi->z < 1e-3f) continue;
      const Imath::Vec3<Real> o = Imath::Vec3<Real>(wo).normalized();
      const Imath::Vec3<Real> in = Imath::Vec3<Real>(*wi).normalized();
      const Imath::Vec3<Real> h = (o + in).normalized();
      const Real a2 = static_cast<Real>(alpha) * static_cast<Real>(alpha);
      const auto tan2 = [](const Imath::Vec3<Real>& w) {
        return (w.x * w.x + w.y * w.y) / (w.z * w.z);
      };
      const auto lambda = [&](const Imath::Vec3<Real>& w) {
        return 0.5L * (std::sqrt(1.0L + a2 * tan2(w)) - 1.0L);
      };
      const Real t = 1.0L + tan2(h) / a2;
      const Real d = 1.0L / (std::numbers::pi_v<Real> * a2 * h.z * h.z * h.z * h.z * t * t);
      const Real f_cos =
          d / (1.0L + lambda(o) + lambda(in)) / (4.0L * o.z);  // Fresnel is 1 to 1e-9
      const Real pdf = d / (1.0L + lambda(o)) / (4.0L * o.z);
      const BsdfValue value = bound.evaluate(*wi);
      // Where wo + wi cancels at grazing angles, roundings of the lengths come back divided by |wo
      // + wi|.
      ASSERT_NEAR(double{value.f_cos.x} / static_cast<double>(f_cos), 1.0, 2e-3)
          << alpha << wo << *wi;
      ASSERT_NEAR(double{value.pdf_w} / static_cast<double>(pdf), 1.0, 2e-3) << alpha << wo << *wi;
    }
  }
}

TEST(GgxDistribution, MatchesLongDoubleForEveryAlpha) {
  test::TestRandom random;
  for (const float alpha : {1e-4f, 3e-4f, 1e-3f, 1e-2f, 0.1f, 1.0f}) {
    for (int i = 0; i < 20000; ++i) {
      const double v = random.uniform(0.0, 0.9999);
      const double tangent = double{alpha} * std::sqrt(v / (1.0 - v));
      const double phi = random.uniform(0.0, 2.0 * std::numbers::pi);
      const Vec3 h(Vec3d(tangent * std::cos(phi), tangent * std::sin(phi), 1.0).normalized());
      // Walter et al. eq. 33 by the tangent, of the same float vector.
      const Real x = h.x, y = h.y, z = h.z,
                 a2 = static_cast<Real>(alpha) * static_cast<Real>(alpha);
      const Real tan2 = (x * x + y * y) / (z * z);
      const Real cos2 = z * z / (x * x + y * y + z * z);
      const Real exact = a2 / (std::numbers::pi_v<Real> * cos2 * cos2 * (a2 + tan2) * (a2 + tan2));
      ASSERT_NEAR(double{ggx_distribution(h, alpha)} / static_cast<double>(exact), 1.0, 1e-5)
          << alpha << " " << h;
    }
  }
}

TEST(GgxDistribution, ProjectedAreaIntegratesTo1) {
  for (const float alpha : {1e-4f, 1e-3f, 1e-2f, 0.1f, 0.5f, 1.0f}) {
    // cos dw = pi d(sin^2): sum over rings with sin^2 in geometric steps from 1e-6 alpha^2 to 1.
    const double first = 1e-6 * double{alpha} * double{alpha};
    constexpr int kRings = 20000;
    const auto sin2 = [&](double i) { return first * std::pow(1.0 / first, i / kRings); };
    double sum = 0.0;
    for (int i = 0; i < kRings; ++i) {
      const double s2 = sin2(i + 0.5);
      const Vec3 h(Vec3d(std::sqrt(s2), 0.0, std::sqrt(1.0 - s2)));
      const double ring = sin2(i + 1.0) - sin2(i);
      sum += double{ggx_distribution(h, alpha)} * std::numbers::pi * ring;
    }
    EXPECT_NEAR(sum, 1.0, 1e-4) << alpha;
  }
}

TEST(ConductorFresnel, MatchesComplexArithmeticInLongDouble) {
  using Complex = std::complex<Real>;
  test::TestRandom random;
  for (int i = 0; i < 20000; ++i) {
    Rgb eta;
    Rgb k;
    for (int c = 0; c < 3; ++c) {
      eta[c] = static_cast<float>(std::pow(10.0, random.uniform(-2.0, 1.0)));
      k[c] = i % 5 == 0 ? 0.0f : static_cast<float>(std::pow(10.0, random.uniform(-2.0, 2.0)));
    }
    const float cosine = i % 7 == 0 ? 1.0f : static_cast<float>(random.uniform());
    const Rgb value = conductor_fresnel(cosine, eta, k);
    for (int c = 0; c < 3; ++c) {
      const Complex n(static_cast<Real>(eta[c]), static_cast<Real>(k[c]));
      const Real ci = static_cast<Real>(cosine);
      const Complex ct = std::sqrt(1.0L - (1.0L - ci * ci) / (n * n));
      const Real s = std::norm((ci - n * ct) / (ci + n * ct));
      const Real p = std::norm((n * ci - ct) / (n * ci + ct));
      // Without absorption the reflectance has a vertical tangent at the critical angle.
      ASSERT_NEAR(double{value[c]}, static_cast<double>(0.5L * (s + p)), k[c] > 0.0f ? 3e-6 : 3e-4)
          << "cos " << cosine << " eta " << eta[c] << " k " << k[c];
    }
  }
}

TEST(Bsdf, TraitsFollowTheMaterial) {
  EXPECT_EQ(Bsdf(lambertian(0.5f)).min_alpha(), 1.0f);
  EXPECT_EQ(Bsdf(conductor(0.25f)).min_alpha(), 0.25f);
  EXPECT_TRUE(Bsdf(mixture(0.5f, 0.1f, 0.5f)).has_glossy());
  EXPECT_FALSE(Bsdf(phong(0.5f, 0.5f, 3.0f)).has_glossy());
  EXPECT_TRUE(Bsdf(lambertian(0.0f)).is_black());
  EXPECT_FALSE(Bsdf(phong(0.0f, 0.1f, 3.0f)).is_black());
}

}  // namespace
}  // namespace penumbra
