// Environments from image files: their light, and where it comes from.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>

#include "harness/render.h"
#include "scenes/core/environment.h"
#include "scenes/core/images/image_module.h"
#include "scenes/core/scene_file.h"
#include "tests/support/fixtures.h"
#include "tests/support/image_files.h"

namespace penumbra {
namespace {

using test::ImageFolder;

Vec3 direction(double azimuth, double polar) {
  return Vec3(Vec3d(std::sin(polar) * std::cos(azimuth), std::cos(polar),
                    std::sin(polar) * std::sin(azimuth)));
}

/// Loads a white floor under an environment's image.
SceneDescription floor_under(const ImageFolder& folder, const std::string& environment) {
  test::write_bytes(folder / "scene.json", R"({
    "format": "penumbra-scene", "version": 1, "name": "floor",
    "camera": {"position": [0, 2, 0], "look_at": [0, 0, 0], "up": [0, 0, -1],
               "vertical_fov_deg": 30, "resolution": [16, 16]},
    "materials": {"white": {"type": "lambert", "reflectance": 1}},
    "shapes": [{"name": "floor", "type": "rectangle", "origin": [-1, 0, 1], "edge_u": [2, 0, 0],
                "edge_v": [0, 0, -2], "material": "white"}],
    "environment": )" + environment + "}");
  return load_scene_description(folder / "scene.json");
}

/// Irradiance of the floor, by as many estimates as pixels times 64.
double irradiance(const Scene& scene, const char* estimator, std::uint64_t seed) {
  RenderSettings settings;
  settings.estimator = find_estimator(estimator);
  settings.params = fixtures::params_with(*settings.estimator, {});
  settings.budget = {SamplerKind::Independent, 16, 0};
  settings.spp = 64;
  settings.seed = seed;
  const RenderResult result =
      render(scene, make_shading_points(scene, 1, 1, 16, Quantity::Irradiance), settings);
  double sum = 0.0;
  for (const Vec3d& pixel : result.radiance) sum += pixel.x;
  return sum / static_cast<double>(result.radiance.size());
}

TEST(EnvironmentImage, ASunOfOneTexelGivesItsIrradiance) {
  const ImageFolder folder;
  constexpr int kColumns = 64;
  constexpr int kRows = 32;
  constexpr int kRow = 5;
  std::vector<Rgb> texels(kColumns * kRows, Rgb(0.0f));
  texels[kRow * kColumns + 40] = Rgb(1000.0f);
  test::write_rgb_exr(folder / "sun.exr", kColumns, kRows, texels);
  const Scene scene(floor_under(folder, R"({"image": "sun.exr", "scale": 0.5})"));
  // L times the integral of cos(theta) sin(theta) over the texel:
  // delta phi (sin^2 theta_2 - sin^2 theta_1)/2.
  const double upper = std::sin(M_PI * kRow / kRows);
  const double lower = std::sin(M_PI * (kRow + 1) / kRows);
  const double exact = 500.0 * 2.0 * M_PI / kColumns * (lower * lower - upper * upper) / 2.0;
  // Within the texel only the cosine varies, by 11 %: 262144 samples have a relative error below
  // 0.11/512. Five of them: one false alarm in a million.
  EXPECT_NEAR(irradiance(scene, "light", fixtures::test_seed("light")) / exact, 1.0,
              5 * 0.11 / 512);
  EXPECT_NEAR(irradiance(scene, "mis", fixtures::test_seed("mis")) / exact, 1.0, 5 * 0.33 / 512)
      << "with at least a ninth of the samples from the light";
}

TEST(EnvironmentImage, RowsAndColumnsLieWhereTheFormatSays) {
  const ImageFolder folder;
  std::vector<Rgb> texels;
  for (int i = 0; i < 8 * 4; ++i) texels.emplace_back(static_cast<float>(i + 1));
  test::write_rgb_exr(folder / "a.exr", 8, 4, texels);
  const SceneDescription description = floor_under(folder, R"({"image": "a.exr"})");
  const Scene scene(description);
  const Environment& environment =
      scene.lights()[static_cast<std::size_t>(scene.environment_light())].environment;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 8; ++column) {
      const Vec3 w = direction(2 * M_PI * (column + 0.5) / 8, M_PI * (row + 0.5) / 4);
      EXPECT_EQ(environment.radiance(w).x, static_cast<float>(row * 8 + column + 1));
    }
  }
  EXPECT_LE(environment.radiance(Vec3(0, 1, 0)).x, 8.0f) << "the pole +y is the upper row";
  EXPECT_GE(environment.radiance(Vec3(0, -1, 0)).x, 25.0f) << "the pole -y is the lower row";
}

TEST(EnvironmentImage, ARotationTurnsFromXOverZWithoutResampling) {
  std::vector<Rgb> texels;
  for (int i = 0; i < 16 * 8; ++i) texels.emplace_back(static_cast<float>(i + 1));
  const Environment plain(texels, 16, 8);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (const double degrees : {-725.0, -53.0, 0.0, 90.0, 180.0, 359.0, 1234.5}) {
    const Environment turned(texels, 16, 8, degrees);
    EXPECT_EQ(turned.power(), plain.power());
    for (int i = 0; i < 2000; ++i) {
      const double column = 16 * uniform(random);
      // Not at the border of a texel, where the last digit decides.
      if (std::abs(column - std::round(column)) < 1e-4) continue;
      const double azimuth = 2 * M_PI * column / 16;
      const double polar = M_PI * (std::floor(8 * uniform(random)) + 0.5) / 8;
      ASSERT_EQ(turned.radiance(direction(azimuth + degrees * M_PI / 180.0, polar)),
                plain.radiance(direction(azimuth, polar)))
          << degrees << " degrees, azimuth " << azimuth;
    }
    // Sampling knows the rotation: every draw has the density of its own texel, in proportion to
    // the texel's radiance.
    double mean = 0.0;
    constexpr int kDraws = 4096;
    for (int i = 0; i < kDraws; ++i) {
      const Vec2 u(static_cast<float>(uniform(random)), static_cast<float>(uniform(random)));
      const Environment::Sample sample = turned.sample(u);
      ASSERT_EQ(sample.pdf_w, turned.pdf_w(sample.w));
      mean += double{turned.radiance(sample.w).x} / double{sample.pdf_w} / kDraws;
    }
    EXPECT_NEAR(mean / plain.power().x, 1.0, 1e-5) << "grey: every draw gives the power itself";
  }
}

TEST(EnvironmentImage, PoleTexelsGiveTheirPower) {
  const ImageFolder folder;
  constexpr int kColumns = 32;
  constexpr int kRows = 16;
  std::vector<Rgb> texels(kColumns * kRows, Rgb(0.0f));
  for (int column = 0; column < kColumns; ++column)
    texels[static_cast<std::size_t>(column)] = Rgb(10.0f);
  test::write_rgb_exr(folder / "pole.exr", kColumns, kRows, texels);
  const Scene scene(floor_under(folder, R"({"image": "pole.exr", "rotation_deg": 77})"));
  const double sine = std::sin(M_PI / kRows);
  const double exact = 10.0 * M_PI * sine * sine;  // a cap about the normal
  EXPECT_NEAR(irradiance(scene, "light", fixtures::test_seed("light")) / exact, 1.0,
              5 * 0.02 / 512);
}

TEST(EnvironmentImage, LoadsTwoMillionTexels) {
  const ImageFolder folder;
  std::vector<Rgb> texels;
  std::mt19937 random(6);
  std::uniform_real_distribution<float> uniform(0.0f, 2.0f);
  for (int i = 0; i < 2048 * 1024; ++i) texels.emplace_back(uniform(random));
  test::write_rgb_exr(folder / "a.exr", 2048, 1024, texels);
  const auto start = std::chrono::steady_clock::now();
  const SceneDescription description = floor_under(folder, R"({"image": "a.exr"})");
  const auto read = std::chrono::steady_clock::now();
  const Scene scene(description);
  const auto built = std::chrono::steady_clock::now();
  const Environment& environment =
      scene.lights()[static_cast<std::size_t>(scene.environment_light())].environment;
  const auto ms = [](auto from, auto to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
  };
  std::printf("2048 x 1024 EXR: read in %.0f ms, scene made in %.0f ms, %.1f MB of tables\n",
              ms(start, read), ms(read, built),
              static_cast<double>(environment.memory_bytes()) / 1e6);
  // Texel, density and cumulative weight: 12 + 4 + 8 bytes.
  EXPECT_LT(environment.memory_bytes(), std::size_t{2048} * 1024 * 25);
}

}  // namespace
}  // namespace penumbra
