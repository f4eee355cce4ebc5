// Estimators that are wrong on purpose, naive formulas among them, must be found by the cases that
// are there for their fault, and by no other. Seeds follow from the names of case and estimator.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/stability/glossy_answer.h"
#include "tests/stability/suite_support.h"

namespace penumbra::stability {
namespace {

/// Adds up an estimate for each point of a tile that needs no random numbers but its own.
template <typename PerPoint>
class Naive final : public Estimator {
 public:
  Naive(const Scene& scene, const Budget& budget) : scene_(scene), budget_(budget) {}
  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    for (int pixel = 0; pixel < tile.pixel_count(); ++pixel) {
      for (int s = 0; s < tile.spp; ++s) {
        const StreamKey key{seed, tile.pixel_index(pixel), static_cast<std::uint32_t>(s), 0, 0};
        out.radiance[static_cast<std::size_t>(pixel * tile.spp + s)] =
            Rgb(PerPoint{}(scene_, tile.point(pixel, s), key, budget_.srl()));
        ++out.counters.estimates;
      }
    }
  }

 private:
  const Scene& scene_;
  Budget budget_;
};

template <typename PerPoint>
std::unique_ptr<Estimator> make_naive(const Scene& scene, const ParamSet&, const Budget& budget) {
  return std::make_unique<Naive<PerPoint>>(scene, budget);
}

template <typename PerPoint>
constexpr EstimatorEntry naive(std::string_view name) {
  EstimatorEntry entry;
  entry.name = name;
  entry.params = no_params;
  entry.bias_reason = claims_unbiased;
  entry.create = make_naive<PerPoint>;
  return entry;
}

constexpr float kGreyOverPi = 0.5f * 0.318309886f;

/// Cone of a sphere from 1 - cos in single precision, which has no digits left for small spheres.
struct NaiveSphere {
  float operator()(const Scene& scene, const ShadingPoint& p, const StreamKey& key, int n) const {
    const Light& light = scene.lights()[0];
    const Vec3 to = light.center - p.position;
    const float distance = to.length();
    const float cos_max = std::sqrt(1.0f - light.radius * light.radius / (distance * distance));
    const float solid_angle = 2.0f * 3.14159265f * (1.0f - cos_max);
    const PointSet points(SamplerKind::Independent, key, static_cast<std::uint32_t>(n));
    const Frame frame(to / distance);
    float sum = 0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
      const Variates v = points(i);
      const float z = 1.0f - v.u.x * (1.0f - cos_max);
      const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
      const float phi = 6.2831853f * v.u.y;
      const Vec3 w = frame.to_world({r * std::cos(phi), r * std::sin(phi), z});
      sum += std::max(0.0f, dot(w, p.shading_normal));
    }
    return kGreyOverPi * light.radiance.x * solid_angle * sum / static_cast<float>(n);
  }
};

/// Area sampling that keeps r^2 above a constant, against the fireflies of near lights.
struct ClampedDistance {
  float operator()(const Scene& scene, const ShadingPoint& p, const StreamKey& key, int n) const {
    const Light& light = scene.lights()[0];
    const PointSet points(SamplerKind::Independent, key, static_cast<std::uint32_t>(n));
    float sum = 0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
      const Variates v = points(i);
      const Vec3 d = light.origin + light.edge_u * v.u.x + light.edge_v * v.u.y - p.position;
      const float r2 = std::max(d.length2(), 1e-2f);
      sum += std::max(0.0f, dot(d, p.shading_normal)) * std::max(0.0f, -dot(d, light.normal)) /
             (r2 * r2);
    }
    return kGreyOverPi * light.radiance.x * static_cast<float>(light.area) * sum /
           static_cast<float>(n);
  }
};

/// A cosine-weighted direction about the frame's normal, by the textbook.
Vec3 cosine_direction(const Frame& frame, const Vec2& u) {
  const float r = std::sqrt(u.x);
  const float phi = 6.2831853f * u.y;
  return frame.to_world(
      {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0f, 1.0f - u.x))});
}

/// Rays that start a fixed distance away from their point, as with an absolute tnear: they jump
/// over what is thinner.
struct FixedStart {
  float operator()(const Scene& scene, const ShadingPoint& p, const StreamKey& key, int n) const {
    const PointSet points(SamplerKind::Independent, key, static_cast<std::uint32_t>(n));
    const Frame frame(p.shading_normal);
    RayBatch rays(static_cast<std::size_t>(n));
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
      const Vec3 w = cosine_direction(frame, points(i).u);
      rays.add(p.position + w * 0.01f, w);
    }
    scene.intersect(rays);
    float sum = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const std::int32_t light = scene.emitter(rays.hits[i], rays.direction(i));
      if (light == kNoLight) continue;
      sum += scene.lights()[static_cast<std::size_t>(light)].radiance_along(rays.direction(i)).x;
    }
    return 0.5f * sum / static_cast<float>(n);
  }
};

/// Uniform points on every light that nothing hides; what is wrong is up to `Rule`.
template <typename Rule>
struct AreaSampling {
  float operator()(const Scene& scene, const ShadingPoint& p, const StreamKey& key, int n) const {
    RayBatch ray(1);
    float sum = 0;
    for (std::uint32_t l = 0; l < scene.lights().size(); ++l) {
      const Light& light = scene.lights()[l];
      StreamKey light_key = key;
      light_key.component = l;
      const PointSet points(SamplerKind::Independent, light_key, static_cast<std::uint32_t>(n));
      for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
        const Variates v = points(i);
        const Vec3 d = light.origin + light.edge_u * v.u.x + light.edge_v * v.u.y - p.position;
        const float r2 = d.length2();
        const float slope = Rule::light_cosine(-dot(d, light.normal));
        ray.clear();
        ray.add(p.position, d / std::sqrt(r2));
        scene.intersect(ray);
        if (!Rule::is_lit(scene, ray.hits[0], static_cast<std::int32_t>(l), d)) continue;
        sum += light.radiance.x * static_cast<float>(light.area) *
               std::max(0.0f, dot(d, p.shading_normal)) * slope / (r2 * r2);
      }
    }
    return kGreyOverPi * sum / static_cast<float>(n);
  }
};

/// Light leaves both sides of every light.
struct BothSides {
  static float light_cosine(float cosine) { return std::abs(cosine); }
  static bool is_lit(const Scene&, const RayHit&, std::int32_t, const Vec3&) { return true; }
};

/// What emits does not shadow.
struct LightsDoNotShadow {
  static float light_cosine(float cosine) { return std::max(0.0f, cosine); }
  static bool is_lit(const Scene& scene, const RayHit& hit, std::int32_t, const Vec3& d) {
    return scene.emitter(hit, d) != kNoLight;
  }
};

/// Rays that start on the surface itself.
struct NoOffset {
  float operator()(const Scene& scene, const ShadingPoint& p, const StreamKey& key, int n) const {
    RayBatch back(1);
    back.add(p.position, -p.geometric_normal);
    scene.intersect(back);
    const Vec3 start = p.position - p.geometric_normal * back.hits[0].distance;
    const PointSet points(SamplerKind::Independent, key, static_cast<std::uint32_t>(n));
    const Frame frame(p.shading_normal);
    RayBatch rays(static_cast<std::size_t>(n));
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
      rays.add(start, cosine_direction(frame, points(i).u));
    }
    scene.intersect(rays);
    int free = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) free += rays.hits[i].hit() ? 0 : 1;
    return 0.5f * static_cast<float>(free) / static_cast<float>(n);
  }
};

/// GGX with the distribution of normals worked out from the cosine in single precision, as in
/// (cos^2 (alpha^2 - 1) + 1)^2; half vectors are drawn from the exact one.
struct GgxFromCosine {
  float operator()(const Scene& scene, const ShadingPoint& p, const StreamKey& key, int n) const {
    const Bsdf& metal = scene.bsdf(p.material);
    if (metal.is_delta()) return 0.75f;
    const double alpha = static_cast<double>(metal.min_alpha());
    const GlossyPoint point{alpha, 0.2, 3.9, Vec3d(p.wo)};
    const PointSet points(SamplerKind::Independent, key, static_cast<std::uint32_t>(n));
    const Light& light = scene.lights()[0];
    double sum = 0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
      const Variates v = points(i);
      const double u = static_cast<double>(v.u.x);
      const double cosine = std::sqrt((1 - u) / (1 - u + alpha * alpha * u));
      const double sine = std::sqrt(1 - cosine * cosine);
      const double phi = 2 * M_PI * static_cast<double>(v.u.y);
      const Vec3d h(sine * std::cos(phi), sine * std::sin(phi), cosine);
      const Vec3d wi = h * (2 * point.wo.dot(h)) - point.wo;
      LightProposal proposal;
      if (!(wi.z > 0) || !proposal.set_up(light, LightSampling::Area, p.position, Vec3(0, 0, 1)) ||
          !(proposal.pdf_w(Vec3(wi)) > 0)) {
        continue;
      }
      const auto a2 = static_cast<float>(alpha * alpha);
      const auto c = static_cast<float>(cosine);
      const float naive = (c * c) * (a2 - 1.0f) + 1.0f;
      const double exact = sine * sine + alpha * alpha * cosine * cosine;
      const double ratio = naive != 0.0f ? exact / static_cast<double>(naive)
                                         : std::numeric_limits<double>::infinity();
      // f cos / pdf of wi, pdf = D cos_h / (4 wo.h), with D taken naively in f alone.
      const double density = alpha * alpha / (M_PI * exact * exact) * h.z / (4 * point.wo.dot(h));
      sum += glossy_f_cos(point, wi) / density * ratio * ratio;
    }
    return static_cast<float>(sum / n);
  }
};

constexpr EstimatorEntry kBothSides = naive<AreaSampling<BothSides>>("both sides");
constexpr EstimatorEntry kLightsDoNotShadow =
    naive<AreaSampling<LightsDoNotShadow>>("lights do not shadow");
constexpr EstimatorEntry kNoOffset = naive<NoOffset>("no offset");
constexpr EstimatorEntry kGgxFromCosine = naive<GgxFromCosine>("ggx from cosine");
constexpr EstimatorEntry kNaiveSphere = naive<NaiveSphere>("naive sphere");
constexpr EstimatorEntry kClamped = naive<ClampedDistance>("clamped");
constexpr EstimatorEntry kFixedStart = naive<FixedStart>("fixed start");

// Every case is able to find an error: one of 10 %, or the least light where it is dark.
TEST(StabilityNegativeControls, TenPercentAreFoundInEveryCase) {
  const StabilityResult result = run_on(all_cases(), {&kTooBright});
  EXPECT_FALSE(passed(result));
  for (const auto& cells : matrix_of(result)) {
    const std::vector<const StabilityRow*>& steps = cells[0].steps;
    // `population` is swept where estimators have one.
    if (steps.empty()) continue;
    const bool found = std::any_of(steps.begin(), steps.end(), [](const StabilityRow* row) {
      return row->verdict >= Verdict::Biased;
    });
    EXPECT_TRUE(found) << steps[0]->case_name;
  }
}

TEST(StabilityNegativeControls, OneBadEstimateBreaksAndSaysHowToMakeItAgain) {
  for (const EstimatorEntry* entry : {&kNanOnce, &kNegativeOnce}) {
    const StabilityResult result = run_on({case_of("small_light")}, {entry});
    EXPECT_FALSE(passed(result));
    for (const StabilityRow& row : result.rows) {
      EXPECT_EQ(row.verdict, Verdict::Breaks) << row.value;
      EXPECT_NE(row.replay.find("pixel 18, estimate 13"), std::string::npos) << row.replay;
    }
  }
}

Verdict verdict_at(const StabilityResult& result, double value) {
  for (const StabilityRow& row : result.rows) {
    if (row.value == value) return row.verdict;
  }
  ADD_FAILURE() << "no step " << value;
  return Verdict::Ok;
}

TEST(StabilityNegativeControls, SmallSpheresFindTheNaiveCone) {
  const StabilityResult result = run_on({case_of("small_sphere")}, {&kNaiveSphere}, false);
  EXPECT_EQ(verdict_at(result, 0.3), Verdict::Ok);
  Verdict worst = Verdict::Ok;
  for (const StabilityRow& row : result.rows) worst = std::max(worst, row.verdict);
  EXPECT_GE(worst, Verdict::Biased);
  // Its cone is empty there: no light at all.
  EXPECT_EQ(verdict_at(result, 1e-5), Verdict::Noisy);
}

TEST(StabilityNegativeControls, NearLightsFindTheClampedDistance) {
  const StabilityResult result = run_on({case_of("near_light")}, {&kClamped}, false);
  EXPECT_EQ(verdict_at(result, 1), Verdict::Ok);
  EXPECT_GE(verdict_at(result, 0.01), Verdict::Biased);
  EXPECT_EQ(verdict_at(result, 1e-6), Verdict::Breaks);
}

TEST(StabilityNegativeControls, ThinWallsFindRaysThatStartAFixedDistanceAway) {
  const StabilityResult result = run_on({case_of("thin_wall")}, {&kFixedStart}, false);
  EXPECT_EQ(verdict_at(result, 0.1), Verdict::Ok);
  EXPECT_EQ(verdict_at(result, 1e-6), Verdict::Breaks);
}

TEST(StabilityNegativeControls, TurnedLightsFindLightFromBehind) {
  const StabilityResult result = run_on({case_of("turned_light")}, {&kBothSides});
  EXPECT_EQ(verdict_at(result, 0), Verdict::Ok);
  EXPECT_EQ(verdict_at(result, 180), Verdict::Breaks);
}

TEST(StabilityNegativeControls, StackedLightsFindLightsThatDoNotShadow) {
  const StabilityResult result = run_on({case_of("stacked_lights")}, {&kLightsDoNotShadow});
  for (const StabilityRow& row : result.rows) EXPECT_EQ(row.verdict, Verdict::Breaks) << row.value;
}

TEST(StabilityNegativeControls, ConvexSpheresFindRaysWithoutOffset) {
  const StabilityResult result = run_on({case_of("convex_sphere")}, {&kNoOffset});
  for (const StabilityRow& row : result.rows) EXPECT_EQ(row.verdict, Verdict::Biased) << row.value;
}

TEST(StabilityNegativeControls, SmoothMetalsFindTheDistributionFromTheCosine) {
  const StabilityResult result = run_on({case_of("roughness")}, {&kGgxFromCosine}, false);
  EXPECT_LE(verdict_at(result, 0.1), Verdict::Noisy);
  EXPECT_GE(verdict_at(result, 1e-4), Verdict::Biased);
}

// The literal reading of PMC-HI loses lights; the default does not.
TEST(StabilityNegativeControls, LiteralPmcHiIsBiasedWhereLittleIsVisible) {
  const StabilityResult result =
      run_on({case_of("visible_strip")}, {find_estimator("pmc_hi")}, false);
  bool found = false;
  for (const StabilityRow& row : result.rows) {
    const bool is_literal = row.method == "pmc_hi literal";
    EXPECT_EQ(row.declared_bias.empty(), !is_literal);
    if (is_literal) {
      found = found || row.verdict >= Verdict::Biased;
    } else {
      EXPECT_LE(row.verdict, Verdict::Noisy) << row.method << ' ' << row.value << row.reason;
    }
  }
  EXPECT_TRUE(found);
  EXPECT_TRUE(passed(result)) << "a declared bias is no fault";
}

}  // namespace
}  // namespace penumbra::stability
