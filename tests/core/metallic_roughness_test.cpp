// Metallic-roughness surfaces and mirrors: energy, limits, and blocks of directions. Chi-squared,
// reciprocity and extreme values are in bsdf_test.cpp, for all materials alike.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "scenes/core/bsdf.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

const Vec3 kUp(0.0f, 0.0f, 1.0f);

Bsdf coated(const Rgb& color, float metallic, float roughness) {
  return Bsdf({"coated", MetallicRoughnessMaterial{color, metallic, roughness}});
}

Vec3 at_cosine(float cosine, double azimuth = 0.4) {
  const double r = std::sqrt(1.0 - double{cosine} * double{cosine});
  return {static_cast<float>(r * std::cos(azimuth)), static_cast<float>(r * std::sin(azimuth)),
          cosine};
}

/// Directional albedo by quadrature: the estimate f cos/pdf at the midpoints of a grid of variates,
/// once for each lobe.
double albedo(const Bsdf& bsdf, float cosine, int grid = 96) {
  const BoundBsdf bound(bsdf, at_cosine(cosine));
  const double p = double{bound.glossy_probability()};
  double sum = 0.0;
  for (const bool glossy : {true, false}) {
    const double share = glossy ? p : 1.0 - p;
    if (share == 0.0) continue;
    for (int i = 0; i < grid * grid; ++i) {
      const Vec2 u((static_cast<float>(i % grid) + 0.5f) / static_cast<float>(grid),
                   (static_cast<float>(i / grid) + 0.5f) / static_cast<float>(grid));
      const auto wi = bound.sample({u, glossy ? 0.0f : 1.0f - 0x1p-24f});
      if (!wi) continue;
      const BsdfValue value = bound.evaluate(*wi);
      sum += share * double{value.f_cos.x} / double{value.pdf_w};
    }
  }
  return sum / (grid * grid);
}

double schlick(double f0, double cosine) { return f0 + (1.0 - f0) * std::pow(1.0 - cosine, 5); }

const std::vector<float> kRoughness = {0.0f, 0.1f, 0.2f, 0.3f, 0.45f, 0.6f, 0.8f, 1.0f};
const std::vector<float> kCosines = {1.0f, 0.9f, 0.8f, 0.7f,  0.6f,  0.5f,  0.4f,
                                     0.3f, 0.2f, 0.1f, 0.05f, 0.02f, 1e-2f, 1e-3f};

// The quadrature is good to 1e-4 (twice as fine a grid differs by less).
TEST(MetallicRoughness, WhiteFurnaceGainsNothing) {
  for (const float metallic : {0.0f, 0.25f, 0.5f, 0.75f, 1.0f}) {
    for (const float roughness : kRoughness) {
      const Bsdf bsdf = coated(Rgb(1.0f), metallic, roughness);
      for (const float cosine : kCosines) {
        const double value = albedo(bsdf, cosine);
        EXPECT_LE(value, 1.0 + 1e-4) << metallic << " " << roughness << " cos " << cosine;
        // Rough surfaces lose what their microfacets pass on, coats at grazing angles most of it.
        EXPECT_GT(value, cosine >= 0.3f ? 0.25 : 0.05)
            << metallic << " " << roughness << " cos " << cosine;
      }
    }
  }
}

// Negative control: the base normalised to what a smooth coat lets in would gain energy on a rough
// one, and the test above would see it.
TEST(MetallicRoughness, FurnaceSeesThatTheNormalisedBaseWouldGain) {
  double largest = 0.0;
  for (const float roughness : kRoughness) {
    const Bsdf bsdf = coated(Rgb(1.0f), 0.0f, roughness);
    for (const float cosine : kCosines) {
      const double base = 20.0 / 21.0 * (1.0 - schlick(0.04, double{cosine}));
      largest = std::max(largest, albedo(bsdf, cosine) + base / 20.0);
    }
  }
  EXPECT_GT(largest, 1.0 + 1e-3);
}

// Exactly what is stated at set_metallic_roughness: F of the mirror direction plus 20/21 of what
// enters.
TEST(MetallicRoughness, SmoothSurfaceHasTheClosedFormAlbedo) {
  for (const float color : {0.0f, 0.5f, 1.0f}) {
    for (const float metallic : {0.0f, 0.3f, 1.0f}) {
      const Bsdf bsdf = coated(Rgb(color), metallic, 0.0f);
      const double f0 = 0.04 * (1.0 - double{metallic}) + double{color} * double{metallic};
      for (const float cosine : {1.0f, 0.7f, 0.4f, 0.2f}) {
        const double f = schlick(f0, double{cosine});
        const double exact = f + 20.0 / 21.0 * double{color} * (1.0 - double{metallic}) * (1.0 - f);
        EXPECT_NEAR(albedo(bsdf, cosine), exact, 2e-3 * exact + 1e-6)
            << color << " " << metallic << " cos " << cosine;
      }
    }
  }
}

TEST(MetallicRoughness, SmoothMetalReflectsIntoTheMirrorDirection) {
  const Bsdf bsdf = coated(Rgb(0.9f, 0.6f, 0.3f), 1.0f, 0.0f);
  EXPECT_EQ(bsdf.min_alpha(), 1e-4f);
  test::TestRandom random;
  for (const float cosine : {1.0f, 0.5f, 0.1f}) {
    const BoundBsdf bound(bsdf, at_cosine(cosine));
    EXPECT_EQ(bound.glossy_probability(), 1.0f) << "there is no base to sample";
    int near = 0;
    for (int i = 0; i < 1000; ++i) {
      const auto wi = bound.sample(random.variates());
      near += wi && (*wi - bound.mirrored()).length() < 1e-2f ? 1 : 0;
    }
    EXPECT_GE(near, 999) << cosine;
  }
}

TEST(MetallicRoughness, RoughDielectricIsCloseToLambert) {
  const Bsdf bsdf = coated(Rgb(0.8f), 0.0f, 1.0f);
  for (const float cos_o : {1.0f, 0.7f, 0.5f}) {
    const BoundBsdf bound(bsdf, at_cosine(cos_o));
    for (const float cos_i : {1.0f, 0.8f, 0.5f}) {
      for (const double azimuth : {0.4, 2.0, 3.5}) {
        const Vec3 wi = at_cosine(cos_i, azimuth);
        const float ratio = bound.evaluate(wi).f_cos.x * std::numbers::pi_v<float> / (0.8f * wi.z);
        EXPECT_GT(ratio, 0.88f) << cos_o << " " << cos_i;
        EXPECT_LT(ratio, 1.0f) << cos_o << " " << cos_i;
      }
    }
  }
}

TEST(MetallicRoughness, ColourTintsTheMetalAndTheBaseButNotTheCoat) {
  const Rgb color(1.0f, 0.5f, 0.0f);
  const Vec3 wo = at_cosine(0.8f);
  const Bsdf smooth_metal = coated(color, 1.0f, 0.0f);
  const BoundBsdf metal(smooth_metal, wo);
  const Rgb f = metal.evaluate(metal.mirrored()).f_cos;
  const double share = std::pow(0.2, 5);
  EXPECT_NEAR(double{f.y / f.x}, 0.5 + 0.5 * share, 1e-5);
  EXPECT_NEAR(double{f.z / f.x}, share, 1e-5);
  const Bsdf smooth_plastic = coated(color, 0.0f, 0.1f);
  const BoundBsdf plastic(smooth_plastic, wo);
  const Rgb base = plastic.evaluate(at_cosine(0.2f, 4.0)).f_cos;  // far from the lobe
  EXPECT_NEAR(double{base.y / base.x}, 0.5, 1e-3);
  const Rgb peak = plastic.evaluate(plastic.mirrored()).f_cos;
  EXPECT_GT(peak.z, 0.99f * peak.x);
}

TEST(MetallicRoughness, TheCoatsShareOfSamplesGrowsTowardsGrazingAngles) {
  const Bsdf bsdf = coated(Rgb(0.8f), 0.0f, 0.5f);
  float before = 0.0f;
  for (const float cosine : {1.0f, 0.5f, 0.2f, 0.05f, 1e-3f}) {
    const float p = BoundBsdf(bsdf, at_cosine(cosine)).glossy_probability();
    EXPECT_GE(p, before) << cosine;
    EXPECT_GE(p, 0.05f);
    EXPECT_LE(p, 0.95f);
    before = p;
  }
  EXPECT_EQ(before, 0.95f);
}

TEST(Mirror, HasNoDensityAndReflectsTheMirroredDirection) {
  const Bsdf mirror({"mirror", MirrorMaterial{Rgb(0.9f, 0.8f, 0.7f)}});
  EXPECT_TRUE(mirror.is_delta());
  EXPECT_EQ(mirror.delta_reflectance(), Rgb(0.9f, 0.8f, 0.7f));
  EXPECT_FALSE(mirror.is_black());
  EXPECT_TRUE(Bsdf({"black", MirrorMaterial{Rgb(0.0f)}}).is_black());
  const Vec3 wo = at_cosine(0.3f);
  const BoundBsdf bound(mirror, wo);
  EXPECT_EQ(bound.mirrored(), Vec3(-wo.x, -wo.y, wo.z));
  EXPECT_FALSE(bound.uses_choice());
  test::TestRandom random;
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(bound.sample(random.variates()).has_value());
  for (const Vec3& wi : {bound.mirrored(), kUp, wo, -wo}) {
    EXPECT_TRUE(is_black(bound.evaluate(wi).f_cos));
    EXPECT_EQ(bound.evaluate(wi).pdf_w, 0.0f);
  }
  const Bsdf other = coated(Rgb(1.0f), 1.0f, 0.0f);
  EXPECT_FALSE(other.is_delta());
  EXPECT_TRUE(is_black(other.delta_reflectance()));
}

// Vector loops and scalar forms share their formulas, and no contraction is allowed: equal bits.
TEST(BsdfBlocks, EqualTheScalarForms) {
  MixtureMaterial mixture;
  mixture.glossy.alpha = 0.3f;
  const std::vector<MaterialDescription> materials = {
      {"lambert", LambertMaterial{Rgb(0.2f, 0.4f, 0.8f)}},
      {"conductor", ConductorMaterial{}},
      {"phong", PhongMaterial{Rgb(0.3f), Rgb(0.5f), 40.0f}},
      {"mixture", mixture},
      {"plastic", MetallicRoughnessMaterial{Rgb(0.9f, 0.5f, 0.1f), 0.0f, 0.4f}},
      {"half metal", MetallicRoughnessMaterial{Rgb(0.9f, 0.5f, 0.1f), 0.5f, 0.7f}},
      {"metal", MetallicRoughnessMaterial{Rgb(0.9f, 0.5f, 0.1f), 1.0f, 0.0f}},
      {"mirror", MirrorMaterial{Rgb(0.9f)}}};
  test::TestRandom random;
  for (const MaterialDescription& material : materials) {
    const Bsdf bsdf(material);
    for (const float cosine : {1.0f, 0.4f, 1e-3f}) {
      const BoundBsdf bound(bsdf, at_cosine(cosine));
      for (const std::size_t count : {std::size_t{1}, std::size_t{13}, kBlock}) {
        VariateBlock variates;
        std::vector<Variates> drawn(count);
        for (std::size_t i = 0; i < count; ++i) {
          drawn[i] = random.variates();
          variates.x[i] = drawn[i].u.x;
          variates.y[i] = drawn[i].u.y;
          variates.choice[i] = drawn[i].choice;
        }
        VectorBlock wi;
        bound.sample(variates, count, 0, wi);
        VectorBlock above;
        for (std::size_t i = 0; i < count; ++i) {
          const auto scalar = bound.sample(drawn[i]);
          ASSERT_EQ(wi[i].z > 0.0f, scalar.has_value()) << material.name;
          if (scalar) {
            ASSERT_EQ(wi[i], *scalar) << material.name << " lane " << i;
          }
          above.set(i, scalar ? *scalar : at_cosine(0.5f, static_cast<double>(i)));
        }
        VectorBlock f_cos;
        Block<float> pdf;
        bound.evaluate(above, count, f_cos, pdf);
        for (std::size_t i = 0; i < count; ++i) {
          const BsdfValue scalar = bound.evaluate(above[i]);
          ASSERT_EQ(f_cos[i], scalar.f_cos) << material.name << " lane " << i;
          ASSERT_EQ(pdf[i], scalar.pdf_w) << material.name << " lane " << i;
        }
      }
    }
  }
}

}  // namespace
}  // namespace penumbra
