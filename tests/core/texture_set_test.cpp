// Lookups of the texture system against bilinear interpolation in double precision.

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <array>
#include <barrier>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "scenes/core/error.h"
#include "scenes/core/images/image_module.h"
#include "tests/support/fixtures.h"
#include "tests/support/image_files.h"

namespace penumbra {
namespace {

using test::ImageFolder;

constexpr int kWidth = 5;  // not a power of two
constexpr int kHeight = 3;

/// Index of a texel outside the image, by the wrap mode.
int wrapped(int i, int size, TextureWrap wrap) {
  if (wrap == TextureWrap::Clamp) return std::clamp(i, 0, size - 1);
  const int period = wrap == TextureWrap::Mirror ? 2 * size : size;
  const int phase = ((i % period) + period) % period;
  return phase < size ? phase : period - 1 - phase;
}

/// Texel centres lie at (i + 0.5)/size; (0, 0) is the upper left corner.
double bilinear(const std::vector<double>& texels, const Vec2& uv, TextureWrap wrap_u,
                TextureWrap wrap_v) {
  const double x = static_cast<double>(uv.x) * kWidth - 0.5;
  const double y = static_cast<double>(uv.y) * kHeight - 0.5;
  const int x0 = static_cast<int>(std::floor(x));
  const int y0 = static_cast<int>(std::floor(y));
  double sum = 0.0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const double weight = (dx == 1 ? x - x0 : 1.0 - x + x0) * (dy == 1 ? y - y0 : 1.0 - y + y0);
      const int column = wrapped(x0 + dx, kWidth, wrap_u);
      const int row = wrapped(y0 + dy, kHeight, wrap_v);
      sum += weight * texels[static_cast<std::size_t>(row * kWidth + column)];
    }
  }
  return sum;
}

std::vector<std::uint16_t> noise(int channels) {
  std::mt19937 random(1);
  std::vector<std::uint16_t> values(static_cast<std::size_t>(kWidth * kHeight * channels));
  for (std::uint16_t& value : values) value = static_cast<std::uint16_t>(random() % 256);
  return values;
}

/// One channel in [0, 1].
std::vector<double> channel_of(const std::vector<std::uint16_t>& values, int channels, int channel,
                               bool srgb) {
  std::vector<double> result;
  for (std::size_t i = static_cast<std::size_t>(channel); i < values.size();
       i += static_cast<std::size_t>(channels)) {
    const double x = values[i] / 255.0;
    const double linear = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    result.push_back(srgb ? linear : x);
  }
  return result;
}

std::vector<Vec2> places() {
  std::vector<Vec2> uvs = {{0, 0}, {1, 1}, {0.5f, 0.5f}, {0.1f, 1.0f / 6.0f}, {-0.001f, 2.0f}};
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(-3.0f, 4.0f);
  for (int i = 0; i < 2000; ++i) uvs.emplace_back(uniform(random), uniform(random));
  return uvs;
}

/// Float coordinates up to 4 times 5 texels, rounded at 2^-21 of a texel, on differences up to 1.
constexpr double kRounding = 4e-6;

TEST(TextureSet, ColoursAreBilinearOfDecodedTexelsInEveryWrapMode) {
  const ImageFolder folder;
  const std::vector<std::uint16_t> values = noise(3);
  test::write_png(folder / "a.png", kWidth, kHeight, 3, values);
  const auto set = image_module().make_textures();
  for (const bool srgb : {false, true}) {
    for (const TextureWrap u : {TextureWrap::Repeat, TextureWrap::Clamp, TextureWrap::Mirror}) {
      for (const TextureWrap v : {TextureWrap::Repeat, TextureWrap::Clamp, TextureWrap::Mirror}) {
        TextureDescription description = test::texture(folder / "a.png", srgb);
        description.wrap_u = u, description.wrap_v = v;
        const std::uint32_t texture = set->add(description);
        for (const Vec2& uv : places()) {
          const Rgb color = set->color(texture, uv);
          for (int c = 0; c < 3; ++c) {
            ASSERT_NEAR(static_cast<double>(color[c]),
                        bilinear(channel_of(values, 3, c, srgb), uv, u, v), kRounding)
                << uv << ", wrap " << int(u) << ' ' << int(v) << ", channel " << c;
          }
        }
      }
    }
  }
}

TEST(TextureSet, ScalarsComeFromTheChannelNamed) {
  const ImageFolder folder;
  for (int channels = 1; channels <= 4; ++channels) {
    const std::filesystem::path file = folder / ("c" + std::to_string(channels) + ".png");
    const std::vector<std::uint16_t> values = noise(channels);
    test::write_png(file, kWidth, kHeight, channels, values);
    const auto set = image_module().make_textures();
    for (int c = 0; c < channels; ++c) {
      const std::uint32_t texture = set->add(test::texture(file, false, c));
      const std::vector<double> texels = channel_of(values, channels, c, false);
      for (const Vec2& uv : places()) {
        ASSERT_NEAR(static_cast<double>(set->scalar(texture, uv)),
                    bilinear(texels, uv, TextureWrap::Repeat, TextureWrap::Repeat), kRounding)
            << channels << " channels, channel " << c;
      }
    }
    EXPECT_EQ(set->memory_bytes(), static_cast<std::size_t>(kWidth * kHeight * channels) * 4)
        << "textures of one file share their texels";
    EXPECT_THROW(set->add(test::texture(file, false, channels)), InputError);
  }
}

TEST(TextureSet, AlphaIsNeitherDecodedNorMultiplied) {
  const ImageFolder folder;
  test::write_png(folder / "a.png", 1, 1, 4, {255, 188, 0, 51});
  const auto set = image_module().make_textures();
  const std::uint32_t alpha = set->add(test::texture(folder / "a.png", true, 3));
  EXPECT_NEAR(set->scalar(alpha, Vec2(0.5f)), 0.2f, 1e-6f);
  EXPECT_EQ(set->color(alpha, Vec2(0.5f)).x, 1.0f);
}

TEST(TextureSet, GreyImagesGiveGreyColours) {
  const ImageFolder folder;
  test::write_png(folder / "g.png", 1, 1, 2, {51, 0});
  const auto set = image_module().make_textures();
  const Rgb color = set->color(set->add(test::texture(folder / "g.png")), Vec2(0.3f));
  EXPECT_NEAR(color.x, 0.2f, 1e-6f);
  EXPECT_EQ(color, Rgb(color.x));
}

TEST(TextureSet, EachSetHasItsOwnImages) {
  const ImageFolder folder;
  test::write_png(folder / "a.png", 1, 1, 1, {0});
  const auto first = image_module().make_textures();
  const std::uint32_t black = first->add(test::texture(folder / "a.png"));
  test::write_png(folder / "a.png", 1, 1, 1, {255});
  const auto second = image_module().make_textures();
  EXPECT_EQ(second->scalar(second->add(test::texture(folder / "a.png")), Vec2(0.5f)), 1.0f);
  EXPECT_EQ(first->scalar(black, Vec2(0.5f)), 0.0f);
}

TEST(TextureSet, RefusesNumbersAboveOneAndEncodedFloats) {
  const ImageFolder folder;
  test::write_rgb_exr(folder / "a.exr", 2, 1, {Rgb(0.5f), Rgb(0.5f, 1.5f, 0.5f)});
  const auto set = image_module().make_textures();
  try {
    set->add(test::texture(folder / "a.exr"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(
        std::string(error.what()).find("(column 1, row 0 from the upper left), channel 1 is 1.5"),
        std::string::npos)
        << error.what();
  }
  EXPECT_THROW(set->add(test::texture(folder / "a.exr", true)), InputError);
}

TEST(TextureSet, ManyThreadsSeeTheSameBits) {
  const ImageFolder folder;
  constexpr int kSide = 256;
  std::vector<std::uint16_t> values(kSide * kSide * 3);
  std::mt19937 random(3);
  for (std::uint16_t& value : values) value = static_cast<std::uint16_t>(random() % 256);
  test::write_png(folder / "a.png", kSide, kSide, 3, values);
  const auto set = image_module().make_textures();
  const std::uint32_t texture = set->add(test::texture(folder / "a.png", true));
  std::vector<Vec2> uvs(20000);
  std::uniform_real_distribution<float> uniform(-2.0f, 2.0f);
  for (Vec2& uv : uvs) uv = {uniform(random), uniform(random)};
  std::vector<Rgb> serial(uvs.size());
  for (std::size_t i = 0; i < uvs.size(); ++i) serial[i] = set->color(texture, uvs[i]);
  for (int round = 0; round < 3; ++round) {
    std::vector<Rgb> parallel(uvs.size());
    tbb::parallel_for(std::size_t{0}, uvs.size(),
                      [&](std::size_t i) { parallel[i] = set->color(texture, uvs[i]); });
    ASSERT_EQ(parallel, serial);
  }
}

TEST(TextureSet, SetsOneAfterTheOtherDoNotSeeEachOthersTexels) {
  const ImageFolder folder;
  constexpr int kThreads = 3;
  constexpr int kRounds = 60;
  std::unique_ptr<TextureSet> set;
  std::uint32_t texture = 0;
  std::array<std::array<float, kRounds>, kThreads> seen{};
  // The threads outlive the sets, as those of the harness outlive scenes.
  std::barrier<> gate(kThreads + 1);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t round = 0; round < kRounds; ++round) {
        gate.arrive_and_wait();
        seen[t][round] = set->scalar(texture, Vec2(0.5f));
        gate.arrive_and_wait();
      }
    });
  }
  for (std::size_t round = 0; round < kRounds; ++round) {
    test::write_png(folder / "a.png", 1, 1, 1, {static_cast<std::uint16_t>(round)});
    set = nullptr;
    set = image_module().make_textures();
    texture = set->add(test::texture(folder / "a.png"));
    gate.arrive_and_wait();
    gate.arrive_and_wait();
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t t = 0; t < kThreads; ++t) {
    for (std::size_t round = 0; round < kRounds; ++round) {
      EXPECT_NEAR(seen[t][round], static_cast<float>(round) / 255.0f, 1e-6f) << t;
    }
  }
}

TEST(TextureSet, AConstantImageIsConstant) {
  const ImageFolder folder;
  test::write_rgb_exr(folder / "a.exr", kWidth, kHeight,
                      std::vector<Rgb>(kWidth * kHeight, Rgb(0.5f, 0.25f, 1.0f)));
  const auto set = image_module().make_textures();
  const std::uint32_t texture = set->add(test::texture(folder / "a.exr"));
  for (const Vec2& uv : places()) {
    const Rgb color = set->color(texture, uv);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(color[c], Rgb(0.5f, 0.25f, 1.0f)[c], 2e-7f) << uv;
  }
}

}  // namespace
}  // namespace penumbra
