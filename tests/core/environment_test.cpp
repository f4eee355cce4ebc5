#include "scenes/core/environment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "scenes/core/light.h"
#include "tests/support/statistics_support.h"

namespace penumbra {
namespace {

// All statistical checks of this file together (fewer than 50) raise a false alarm with probability
// 1e-4.
const double kLevel = test::sidak(1e-4, 50);
constexpr double kPi = 3.14159265358979323846;

/// A grid, from which each test makes the environment under test.
struct Grid {
  std::string name;
  std::uint32_t columns, rows;
  std::vector<Rgb> texels;

  Environment environment() const { return Environment(texels, columns, rows); }
  const Rgb& at(std::uint32_t row, std::uint32_t column) const {
    return texels[std::size_t{row} * columns + column];
  }
  double step_theta() const { return kPi / rows; }
  double step_phi() const { return 2.0 * kPi / columns; }
  /// Solid angle of a texel: azimuth times difference of cosines.
  double solid_angle(std::uint32_t row) const {
    return step_phi() * (std::cos(row * step_theta()) - std::cos((row + 1) * step_theta()));
  }
  double power() const {
    double sum = 0.0;
    for (std::uint32_t r = 0; r < rows; ++r) {
      for (std::uint32_t c = 0; c < columns; ++c)
        sum += double{luminance(at(r, c))} * solid_angle(r);
    }
    return sum;
  }
};

Vec3 direction(double theta, double phi) {
  return {static_cast<float>(std::sin(theta) * std::cos(phi)), static_cast<float>(std::cos(theta)),
          static_cast<float>(std::sin(theta) * std::sin(phi))};
}

/// Random radiance, a few texels black, one very bright.
Grid random_grid(std::uint32_t columns, std::uint32_t rows) {
  test::TestRandom random(std::uint64_t{columns} << 32 | rows);
  Grid grid{std::to_string(columns) + " x " + std::to_string(rows), columns, rows, {}};
  for (std::uint32_t i = 0; i < columns * rows; ++i) {
    const auto value = [&] { return static_cast<float>(random.uniform(0.1, 2.0)); };
    grid.texels.push_back(i % 5 == 3 ? Rgb(0.0f) : Rgb(value(), value(), value()));
  }
  grid.texels[grid.texels.size() / 2] = Rgb(50.0f, 40.0f, 30.0f);
  return grid;
}

std::vector<Grid> grids() {
  std::vector<Grid> result = {random_grid(1, 1), random_grid(3, 1), random_grid(1, 4),
                              random_grid(7, 5), random_grid(16, 8)};
  Grid poles{"poles only", 4, 6, std::vector<Rgb>(24, Rgb(0.0f))};
  for (const std::size_t i : {0u, 2u, 20u, 23u})
    poles.texels[i] = Rgb(1.0f + static_cast<float>(i));
  result.push_back(poles);
  return result;
}

TEST(Environment, DensityIsThePowersShareAndIntegratesToOne) {
  for (const Grid& grid : grids()) {
    const Environment environment = grid.environment();
    double integral = 0.0;
    for (std::uint32_t r = 0; r < grid.rows; ++r) {
      for (std::uint32_t c = 0; c < grid.columns; ++c) {
        const Vec3 w = direction((r + 0.5) * grid.step_theta(), (c + 0.5) * grid.step_phi());
        const double pdf = double{environment.pdf_w(w)};
        const double expected = double{luminance(grid.at(r, c))} / grid.power();
        EXPECT_NEAR(pdf, expected, 1e-6 * expected) << grid.name << " " << r << " " << c;
        EXPECT_NEAR(environment.texel_solid_angle(r), grid.solid_angle(r), 1e-12) << grid.name;
        integral += pdf * grid.solid_angle(r);
      }
    }
    EXPECT_NEAR(integral, 1.0, 1e-6) << grid.name;
  }
}

TEST(CompensatedDensity, IsTheLuminanceAboveTheMeanAndIntegratesToOne) {
  for (const Grid& grid : grids()) {
    const Environment environment = grid.environment();
    const CompensatedDensity density(environment);
    const double mean = grid.power() / (4.0 * kPi);
    const auto above = [&](std::uint32_t r, std::uint32_t c) {
      return std::max(0.0, double{luminance(grid.at(r, c))} - mean);
    };
    double excess = 0.0;
    for (std::uint32_t r = 0; r < grid.rows; ++r) {
      for (std::uint32_t c = 0; c < grid.columns; ++c) excess += above(r, c) * grid.solid_angle(r);
    }
    const bool is_even = excess < 1e-6 * grid.power();  // of one texel: the luminance itself
    EXPECT_EQ(is_even, grid.texels.size() == 1) << grid.name;
    double integral = 0.0;
    for (std::uint32_t r = 0; r < grid.rows; ++r) {
      for (std::uint32_t c = 0; c < grid.columns; ++c) {
        const Vec3 w = direction((r + 0.5) * grid.step_theta(), (c + 0.5) * grid.step_phi());
        const double expected = is_even ? double{environment.pdf_w(w)} : above(r, c) / excess;
        EXPECT_NEAR(double{density.pdf_w(w)}, expected, 2e-6 * expected + 1e-9) << grid.name;
        integral += double{density.pdf_w(w)} * grid.solid_angle(r);
      }
    }
    EXPECT_NEAR(integral, 1.0, 2e-6) << grid.name;
  }
}

TEST(CompensatedDensity, SamplesFallWhereItIsPositiveAndWeighTheLightThere) {
  const Grid grid = random_grid(16, 8);
  const Environment environment = grid.environment();
  const CompensatedDensity density(environment);
  const double mean = grid.power() / (4.0 * kPi);
  double bright = 0.0;  // power of the texels above the mean
  for (std::uint32_t r = 0; r < grid.rows; ++r) {
    for (std::uint32_t c = 0; c < grid.columns; ++c) {
      const double radiance{luminance(grid.at(r, c))};
      if (radiance > mean) bright += radiance * grid.solid_angle(r);
    }
  }
  ASSERT_LT(bright, 0.95 * grid.power());
  test::TestRandom random;
  test::Moments moments;
  for (int i = 0; i < 100'000; ++i) {
    const Environment::Sample sample = density.sample(random.variates().u);
    ASSERT_EQ(sample.pdf_w, density.pdf_w(sample.w));
    moments.add(sample.pdf_w > 0.0f
                    ? double{luminance(environment.radiance(sample.w))} / double{sample.pdf_w}
                    : 0.0);
  }
  EXPECT_LT(moments.z(bright, 1e-6), test::z_bound(kLevel));
  // The negative control: alone, it misses what is below the mean.
  EXPECT_GT(moments.z(grid.power(), 1e-6), test::z_bound(kLevel));
}

// Counts of samples over texels, each cut into 3 x 3 parts of equal solid angle, found by an own
// lookup in double.
double chi_square(const Grid& drawn, const Grid& claimed) {
  constexpr std::uint32_t kParts = 3;
  constexpr int kDraws = 200'000;
  const Environment environment = drawn.environment();
  const std::size_t parts = drawn.texels.size() * kParts * kParts;
  std::vector<double> observed(parts, 0.0), expected(parts, 0.0);
  test::TestRandom random;
  for (int i = 0; i < kDraws; ++i) {
    const Vec3d w(environment.sample(random.variates().u).w);
    const double theta = std::atan2(std::hypot(w.x, w.z), w.y);
    double phi = std::atan2(w.z, w.x);
    if (phi < 0.0) phi += 2.0 * kPi;
    const auto row =
        std::min(static_cast<std::uint32_t>(theta / drawn.step_theta()), drawn.rows - 1);
    const double high = std::cos(row * drawn.step_theta());
    const double low = std::cos((row + 1) * drawn.step_theta());
    const auto depth =
        std::min(static_cast<std::uint32_t>((high - w.y) / (high - low) * kParts), kParts - 1);
    const auto across = std::min(static_cast<std::uint32_t>(phi / drawn.step_phi() * kParts),
                                 drawn.columns * kParts - 1);
    ++observed[(std::size_t{row} * kParts + depth) * drawn.columns * kParts + across];
  }
  for (std::uint32_t r = 0; r < drawn.rows * kParts; ++r) {
    for (std::uint32_t c = 0; c < drawn.columns * kParts; ++c) {
      const double share = double{luminance(claimed.at(r / kParts, c / kParts))} *
                           claimed.solid_angle(r / kParts) / claimed.power();
      expected[std::size_t{r} * drawn.columns * kParts + c] = kDraws * share / (kParts * kParts);
    }
  }
  return test::chi_square_p(observed, expected);
}

TEST(Environment, SampledDirectionsMatchTheDensityByChiSquare) {
  for (const Grid& grid : grids()) EXPECT_GT(chi_square(grid, grid), kLevel) << grid.name;
}

TEST(Environment, ChiSquareRejectsAnotherGrid) {  // negative control
  const Grid grid = random_grid(7, 5);
  Grid other = grid;
  other.texels[1] *= 1.3f;  // of the polar row
  EXPECT_LT(chi_square(grid, other), kLevel);
}

TEST(Environment, SamplesHaveTheDensityOfTheirDirectionAndAWeightThatIsThePower) {
  for (const Grid& grid : grids()) {
    const Environment environment = grid.environment();
    test::TestRandom random;
    int lost = 0;
    for (int i = 0; i < 100'000; ++i) {
      const Environment::Sample s = environment.sample(random.variates().u);
      ASSERT_NEAR(s.w.length(), 1.0f, 5e-7f) << grid.name;
      ASSERT_EQ(s.pdf_w, environment.pdf_w(s.w)) << grid.name;
      if (s.pdf_w == 0.0f) {
        ++lost;
        continue;
      }
      const double weight = double{luminance(environment.radiance(s.w))} / double{s.pdf_w};
      ASSERT_NEAR(weight, grid.power(), 1e-6 * grid.power()) << grid.name << " " << s.w;
    }
    // Rounding over a border into a black texel: directions have 2^-24, texels 0.4 or more radians.
    EXPECT_LE(lost, 5) << grid.name;
  }
}

TEST(Environment, ExtremeVariatesGiveUnitDirections) {
  for (const Grid& grid : grids()) {
    const Environment environment = grid.environment();
    for (const float x : {0.0f, 0x1p-32f, 0.5f, 1.0f - 0x1p-24f}) {
      for (const float y : {0.0f, 0x1p-32f, 0.5f, 1.0f - 0x1p-24f}) {
        const Environment::Sample s = environment.sample({x, y});
        EXPECT_NEAR(s.w.length(), 1.0f, 5e-7f) << grid.name;
        EXPECT_TRUE(std::isfinite(s.pdf_w) && s.pdf_w >= 0.0f) << grid.name;
      }
    }
  }
}

TEST(Environment, LookupFindsTheTexelUpToItsBorders) {
  constexpr double kInside = 2e-6;  // [rad], some roundings of float
  for (const Grid& grid : grids()) {
    const Environment environment = grid.environment();
    for (std::uint32_t r = 0; r < grid.rows; ++r) {
      for (std::uint32_t c = 0; c < grid.columns; ++c) {
        for (const double theta : {r * grid.step_theta() + kInside, (r + 0.5) * grid.step_theta(),
                                   (r + 1) * grid.step_theta() - kInside}) {
          // Next to a pole a rounding is a large angle around it.
          const double margin = kInside / std::sin(theta);
          if (margin > 0.1 * grid.step_phi()) continue;
          for (const double phi : {c * grid.step_phi() + margin, (c + 0.5) * grid.step_phi(),
                                   (c + 1) * grid.step_phi() - margin}) {
            ASSERT_EQ(environment.radiance(direction(theta, phi)), grid.at(r, c))
                << grid.name << " texel " << r << ", " << c << " at " << theta << ", " << phi;
          }
        }
      }
    }
  }
}

TEST(Environment, AxesAndPolesAreWhereTheFormatSays) {
  Grid grid{"axes", 4, 3, {}};
  for (int i = 0; i < 12; ++i) grid.texels.emplace_back(static_cast<float>(i));
  const Environment e = grid.environment();
  const float tiny = std::numeric_limits<float>::denorm_min();
  for (const float zero : {0.0f, -0.0f, tiny, -tiny}) {
    EXPECT_LT(e.radiance({zero, 1.0f, zero}).x, 4.0f) << "row 0";
    EXPECT_GE(e.radiance({zero, -1.0f, zero}).x, 8.0f) << "last row";
  }
  // Row 1 holds the horizon; columns begin at +x, +z, -x, -z.
  EXPECT_EQ(e.radiance(Vec3(1.0f, 0.0f, 0.1f).normalized()).x, 4.0f);
  EXPECT_EQ(e.radiance(Vec3(-0.1f, 0.0f, 1.0f).normalized()).x, 5.0f);
  EXPECT_EQ(e.radiance(Vec3(-1.0f, 0.0f, -0.1f).normalized()).x, 6.0f);
  EXPECT_EQ(e.radiance(Vec3(0.1f, 0.0f, -1.0f).normalized()).x, 7.0f);
  // The seam: an azimuth that rounds to 2 pi belongs to the last column.
  EXPECT_EQ(e.radiance({1.0f, 0.0f, -tiny}).x, 7.0f);
  EXPECT_EQ(e.radiance({1.0f, 0.0f, 0.0f}).x, 4.0f);
}

TEST(Environment, PowerIsTheSumOfRadianceTimesSolidAngle) {
  for (const Grid& grid : grids()) {
    Vec3d sum(0.0);
    for (std::uint32_t r = 0; r < grid.rows; ++r) {
      for (std::uint32_t c = 0; c < grid.columns; ++c) {
        sum += Vec3d(grid.at(r, c)) * grid.solid_angle(r);
      }
    }
    EXPECT_LT((grid.environment().power() - sum).length(), 1e-12 * sum.length()) << grid.name;
  }
  const Environment one(std::vector<Rgb>{Rgb(2.0f)}, 1, 1);
  EXPECT_NEAR(one.power().x, 8.0 * kPi, 1e-12);
}

TEST(Environment, ConstantRadianceIsSampledUniformly) {
  for (const std::uint32_t rows : {1u, 3u, 8u}) {
    const std::uint32_t columns = 2 * rows - 1;
    const Environment e(std::vector<Rgb>(std::size_t{columns} * rows, Rgb(3.0f)), columns, rows);
    test::TestRandom random;
    for (int i = 0; i < 1000; ++i) {
      EXPECT_NEAR(double{e.pdf_w(random.direction())}, 0.25 / kPi, 1e-7);
    }
  }
}

TEST(Environment, BlackOneIsNoProposal) {
  Light light;
  light.type = LightType::Environment;
  light.environment = Environment(std::vector<Rgb>(6, Rgb(0.0f)), 3, 2);
  EXPECT_TRUE(light.environment.black());
  LightProposal proposal;
  const Vec3 up(0.0f, 1.0f, 0.0f);
  EXPECT_FALSE(proposal.set_up(light, LightSampling::Area, Vec3(0.0f), up));
  light.environment = random_grid(3, 2).environment();
  EXPECT_FALSE(light.environment.black());
  EXPECT_TRUE(proposal.set_up(light, LightSampling::Area, Vec3(0.0f), up));
}

TEST(Environment, ProposalDrawsFromTheEnvironment) {
  const Grid grid = random_grid(7, 5);
  Light light;
  light.type = LightType::Environment;
  light.environment = grid.environment();
  LightProposal proposal;
  ASSERT_TRUE(
      proposal.set_up(light, LightSampling::SolidAngle, Vec3(1.0f), Vec3(0.0f, 1.0f, 0.0f)));
  test::TestRandom random;
  for (int i = 0; i < 1000; ++i) {
    const Variates v = random.variates();
    const auto sample = proposal.sample(v);
    ASSERT_TRUE(sample.has_value());
    EXPECT_EQ(sample->wi, light.environment.sample(v.u).w);
    EXPECT_EQ(sample->pdf_w, proposal.pdf_w(sample->wi));
    EXPECT_EQ(light.radiance_along(sample->wi), light.environment.radiance(sample->wi));
  }
}

}  // namespace
}  // namespace penumbra
