// The suite itself: its cases, its bits on any number of threads, its files, and estimators that
// are wrong on purpose, which must be found where their fault shows and nowhere else.

#include "harness/stability/stability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "harness/csv.h"
#include "harness/stability/matrix.h"
#include "harness/stability/measure.h"

namespace penumbra::stability {
namespace {

const StabilityCase* case_of(std::string_view name) { return &case_named(name); }

StabilityResult run_on(std::vector<const StabilityCase*> cases,
                       std::vector<const EstimatorEntry*> estimators, bool quick = true,
                       int threads = 2) {
  StabilityOptions options;
  options.cases = std::move(cases);
  options.estimators = std::move(estimators);
  options.quick = quick;
  options.threads = threads;
  return run_stability(options);
}

std::vector<const StabilityCase*> all_cases() {
  std::vector<const StabilityCase*> cases;
  for (const StabilityCase& c : stability_cases()) cases.push_back(&c);
  return cases;
}

// Estimators that are wrong on purpose.

std::span<const ParamSpec> no_params() { return {}; }
std::string claims_unbiased(const ParamSet&) { return {}; }

/// Wraps `mis` with solid-angle sampling and spoils its results.
template <typename Spoil>
class Spoiled final : public Estimator {
 public:
  Spoiled(const Scene& scene, const Budget& budget, Spoil spoil) : spoil_(spoil) {
    const EstimatorEntry& mis = *find_estimator("mis");
    std::vector<ParamProblem> problems;
    inner_ = mis.create(
        scene,
        resolve_params(mis.params(), {{"light_sampling", std::string("solid_angle")}}, problems),
        budget);
  }
  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    inner_->estimate(tile, seed, out);
    for (std::size_t i = 0; i < out.radiance.size(); ++i)
      out.radiance[i] = spoil_(out.radiance[i], i);
  }

 private:
  Spoil spoil_;
  std::unique_ptr<Estimator> inner_;
};

template <auto spoil>
std::unique_ptr<Estimator> make_spoiled(const Scene& scene, const ParamSet&, const Budget& budget) {
  return std::make_unique<Spoiled<decltype(spoil)>>(scene, budget, spoil);
}

template <auto spoil>
constexpr EstimatorEntry spoiled(std::string_view name) {
  EstimatorEntry entry;
  entry.name = name;
  entry.min_srl = 2;
  entry.params = no_params;
  entry.bias_reason = claims_unbiased;
  entry.create = make_spoiled<spoil>;
  return entry;
}

constexpr EstimatorEntry kTooBright =
    spoiled<[](const Rgb& c, std::size_t) { return c * 1.1f + Rgb(1e-30f); }>("too bright");
constexpr EstimatorEntry kNanOnce = spoiled<[](const Rgb& c, std::size_t i) {
  return i == 301 ? Rgb(std::numeric_limits<float>::quiet_NaN()) : c;
}>("nan once");
constexpr EstimatorEntry kNegativeOnce =
    spoiled<[](const Rgb& c, std::size_t i) { return i == 301 ? Rgb(-1e-6f) : c; }>(
        "negative once");

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

/// Rays that start a fixed distance away from their point, as with an absolute tnear: they jump
/// over what is thinner.
struct FixedStart {
  float operator()(const Scene& scene, const ShadingPoint& p, const StreamKey& key, int n) const {
    const PointSet points(SamplerKind::Independent, key, static_cast<std::uint32_t>(n));
    const Frame frame(p.shading_normal);
    RayBatch rays(static_cast<std::size_t>(n));
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
      const Variates v = points(i);
      const float r = std::sqrt(v.u.x);
      const float phi = 6.2831853f * v.u.y;
      const Vec3 w = frame.to_world(
          {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0f, 1.0f - v.u.x))});
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

constexpr EstimatorEntry kNaiveSphere = naive<NaiveSphere>("naive sphere");
constexpr EstimatorEntry kClamped = naive<ClampedDistance>("clamped");
constexpr EstimatorEntry kFixedStart = naive<FixedStart>("fixed start");

// The cases.

TEST(StabilityCases, NamesAreUniqueAndSweepsHaveEightStepsOrMore) {
  std::set<std::string_view> names;
  for (const StabilityCase& c : stability_cases()) {
    EXPECT_TRUE(names.insert(c.name).second) << c.name;
    EXPECT_GE(c.values.size(), 8u) << c.name;
    EXPECT_TRUE(std::set<double>(c.values.begin(), c.values.end()).size() == c.values.size())
        << c.name;
    for (const std::string_view text : {c.ids, c.summary, c.parameter, c.answer}) {
      EXPECT_FALSE(text.empty()) << c.name;
    }
  }
}

TEST(StabilityCases, EveryAnswerIsANumber) {
  for (const StabilityCase& c : stability_cases()) {
    for (const double value : {c.values.front(), c.values.back()}) {
      const StabilityStep step = c.build(value);
      for (const double exact : step.exact) {
        EXPECT_TRUE(std::isfinite(exact) && exact >= 0) << c.name << ' ' << value;
      }
      for (const ShadingPoint& point : step.points) EXPECT_TRUE(point.valid()) << c.name;
      EXPECT_LT(tolerance_of(step.condition), 0.05) << c.name << ' ' << value;
    }
  }
}

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

// The suite.

TEST(StabilitySuite, AnyNumberOfThreadsGivesTheSameNumbers) {
  const std::vector<const StabilityCase*> cases{case_of("visible_cone"), case_of("convex_sphere")};
  std::vector<const EstimatorEntry*> entries(all_estimators().begin(), all_estimators().end());
  const StabilityResult one = run_on(cases, entries, true, 1);
  const StabilityResult three = run_on(cases, entries, true, 3);
  ASSERT_EQ(one.rows.size(), three.rows.size());
  for (std::size_t i = 0; i < one.rows.size(); ++i) {
    const StabilityRow& a = one.rows[i];
    const StabilityRow& b = three.rows[i];
    EXPECT_EQ(a.method, b.method);
    EXPECT_EQ(a.bias, b.bias) << a.method;
    EXPECT_EQ(a.rel_variance, b.rel_variance) << a.method;
    EXPECT_EQ(a.p_adjusted, b.p_adjusted) << a.method;
    EXPECT_EQ(a.slope, b.slope) << a.method;
    EXPECT_EQ(a.verdict, b.verdict) << a.method;
  }
}

class StabilityFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "stability-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    // A dark step, one that is never seen (an infinite interval), a name with a comma.
    result_ = run_on({case_of("turned_light"), case_of("small_light")},
                     {find_estimator("mis"), find_estimator("uniform"), &kNanOnce});
    std::ofstream(folder_ / "stability.csv", std::ios::binary) << to_csv(result_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  int run(const std::string& program, const std::string& code) const {
    const std::string script = (folder_ / "script").string();
    std::ofstream(script) << code;
    return std::system(
        (program + " " + script + " " + (folder_ / "stability.csv").string()).c_str());
  }
  static bool is_installed(const std::string& program) {
    return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
  }

  std::filesystem::path folder_;
  StabilityResult result_;
};

TEST_F(StabilityFiles, CsvHasALinePerStepAndMethod) {
  const CsvTable table = read_csv(folder_ / "stability.csv");
  EXPECT_EQ(table.rows.size(), result_.rows.size());
  EXPECT_EQ(table.rows.size(), 2u * 4u * 4u);  // cases, quick steps, methods
  const std::size_t verdict = table.column("verdict").value();
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    EXPECT_EQ(table.rows[i][verdict], to_string(result_.rows[i].verdict));
  }
}

TEST_F(StabilityFiles, PythonReadsThemWithoutOptions) {
  if (!is_installed("python3")) GTEST_SKIP() << "python3 is not installed";
  EXPECT_EQ(run("python3", R"(
import csv, sys
with open(sys.argv[1], newline="") as file:
    rows = list(csv.DictReader(file))
assert len(rows) == 32, len(rows)
for row in rows:
    assert None not in row and None not in row.values(), row
    assert row["verdict"] in ("ok", "noisy", "biased", "breaks"), row
    if row["bias_hi"]: float(row["bias_hi"])
)"),
            0);
}

TEST_F(StabilityFiles, RReadsThemWithoutOptions) {
  if (!is_installed("Rscript")) GTEST_SKIP() << "Rscript (package r-base-core) is not installed";
  EXPECT_EQ(run("Rscript", R"(
rows <- read.csv(commandArgs(TRUE)[1])
stopifnot(nrow(rows) == 32)
for (n in c("bias", "bias_hi", "kurtosis", "slope", "cpu_s")) stopifnot(is.numeric(rows[[n]]))
)"),
            0);
}

TEST_F(StabilityFiles, JsonHasTheColumnsOfTheCsvFileAndTheRules) {
  const auto json = nlohmann::json::parse(to_json(result_));
  EXPECT_EQ(json["format"], "penumbra-stability");
  EXPECT_FALSE(json["passed"].get<bool>());
  EXPECT_EQ(json["rules"].size(), 4u);
  EXPECT_EQ(json["cases"].size(), 2u);
  EXPECT_EQ(json["rows"].size(), result_.rows.size());
  const CsvTable table = read_csv(folder_ / "stability.csv");
  ASSERT_EQ(json["columns"].size(), table.header.size());
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    EXPECT_EQ(json["columns"][i]["name"], table.header[i]);
  }
}

TEST_F(StabilityFiles, TextNamesWhatFailsAndThePictureIsAPng) {
  const std::string text = to_terminal(result_);
  EXPECT_NE(text.find("FAIL"), std::string::npos);
  EXPECT_NE(text.find("small_light at 1, nan once: breaks, 1 estimates are not finite"),
            std::string::npos)
      << text;
  write_matrix_picture(folder_ / "matrix.png", result_);
  std::ifstream file(folder_ / "matrix.png", std::ios::binary);
  std::string head(4, ' ');
  file.read(head.data(), 4);
  EXPECT_EQ(head, "\x89PNG");
}

}  // namespace
}  // namespace penumbra::stability
