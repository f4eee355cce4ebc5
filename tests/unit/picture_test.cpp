#include "harness/picture.h"

#include <cairo.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "harness/color_bar.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A PNG read back through Cairo.
class Png {
 public:
  explicit Png(const fs::path& path) : surface_(cairo_image_surface_create_from_png(path.c_str())) {
    EXPECT_EQ(cairo_surface_status(surface_), CAIRO_STATUS_SUCCESS) << path;
  }
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;
  ~Png() { cairo_surface_destroy(surface_); }

  int width() const { return cairo_image_surface_get_width(surface_); }
  int height() const { return cairo_image_surface_get_height(surface_); }
  Rgb8 at(int x, int y) const {
    std::uint32_t packed = 0;
    std::memcpy(&packed,
                cairo_image_surface_get_data(surface_) +
                    static_cast<std::ptrdiff_t>(y) * cairo_image_surface_get_stride(surface_) +
                    static_cast<std::ptrdiff_t>(x) * 4,
                sizeof packed);
    return {static_cast<std::uint8_t>(packed >> 16), static_cast<std::uint8_t>(packed >> 8),
            static_cast<std::uint8_t>(packed)};
  }
  std::size_t count(Rgb8 color) const {
    std::size_t n = 0;
    for (int i = 0; i < width() * height(); ++i) n += at(i % width(), i / width()) == color ? 1 : 0;
    return n;
  }

 private:
  cairo_surface_t* surface_;
};

/// A folder of its own for the running test, removed afterwards.
class Picture : public testing::Test {
 protected:
  Picture() { fs::create_directories(folder_); }
  ~Picture() override { fs::remove_all(folder_); }

  const fs::path folder_ =
      fs::path(testing::TempDir()) / ("penumbra_picture_" + std::to_string(::getpid()));
};

/// Rises from 0 at the left to 1 at the right.
ScalarImage ramp(int width, int height) {
  ScalarImage image = make_scalar_image(width, height);
  for (int i = 0; i < width * height; ++i) {
    image.at(i % width, i / width) = static_cast<float>(i % width) / static_cast<float>(width - 1);
  }
  return image;
}

TEST(DownscaleBox, KeepsTheMeanForEveryRatio) {
  ScalarImage image = make_scalar_image(97, 61);
  std::uint32_t noise = 7;
  double mean = 0.0;
  for (float& pixel : image.pixels) {
    noise = noise * 1664525u + 1013904223u;
    pixel = static_cast<float>(noise >> 8);
    mean += static_cast<double>(pixel) / static_cast<double>(image.pixels.size());
  }
  for (const auto& [width, height] : {std::pair(97, 61), {48, 30}, {31, 7}, {96, 60}, {1, 1}}) {
    const ScalarImage small = downscale_box(image, width, height);
    double small_mean = 0.0;
    for (const float pixel : small.pixels) small_mean += static_cast<double>(pixel);
    small_mean /= static_cast<double>(small.pixels.size());
    // Each result is rounded to float once, by at most 2^-24 of itself.
    EXPECT_NEAR(small_mean, mean, mean * 0x1p-23) << width << " x " << height;
  }
}

TEST(DownscaleBox, SpreadsANaNOnlyToThePixelsThatCoverIt) {
  ScalarImage image = make_scalar_image(9, 6, 1.0f);
  image.at(4, 3) = kNaN;
  const ScalarImage small = downscale_box(image, 3, 2);  // blocks of 3 x 3
  EXPECT_EQ(count_nonfinite(small), 1u);
  EXPECT_TRUE(std::isnan(small.at(1, 1)));
}

TEST(Crop, TakesThePixelsOfTheRectangleAndRefusesOthers) {
  const ScalarImage part = crop(ramp(11, 4), {3, 1, 5, 2});
  EXPECT_EQ(part.width, 5);
  EXPECT_EQ(part.height, 2);
  EXPECT_EQ(part.at(0, 1), ramp(11, 4).at(3, 2));
  EXPECT_EQ(upscale_nearest(part, 3).at(14, 5), part.at(4, 1));
  for (const PixelRect& bad :
       {PixelRect{-1, 0, 2, 2}, {0, 0, 12, 1}, {10, 3, 1, 2}, {0, 0, 0, 1}}) {
    EXPECT_THROW(crop(ramp(11, 4), bad), InputError) << bad.x << ' ' << bad.y;
  }
}

TEST(Ticks, AreRoundNumbersInTheRange) {
  const auto texts = [](double min, double max, int n) {
    std::string result;
    for (const Tick& tick : make_ticks(min, max, n)) result += tick.text + " ";
    return result;
  };
  EXPECT_EQ(texts(0.0, 1.0, 6), "0 0.2 0.4 0.6 0.8 1.0 ");
  EXPECT_EQ(texts(-0.07, 0.07, 4), "−0.05 0 0.05 ");
  EXPECT_EQ(texts(0.0, 2e-5, 3), "0 1×10⁻⁵ 2×10⁻⁵ ");
  EXPECT_EQ(texts(0.0, 3e6, 4), "0 1×10⁶ 2×10⁶ 3×10⁶ ");
}

TEST_F(Picture, RgbPixelsAreTheToneMappedOnes) {
  Image image = make_image(3, 2, Rgb(0.5f, 0.1f, 0.02f));
  image.at(2, 1) = Rgb(0.25f, kNaN, 0.0f);
  image.at(0, 1) = Rgb(4.0f, 0.125f, 0.0f);
  write_png_rgb(folder_ / "a.png", image, 1.0f);
  const Png png(folder_ / "a.png");
  ASSERT_EQ(png.width(), 3);
  ASSERT_EQ(png.height(), 2);
  EXPECT_EQ(png.at(1, 0), tone_map(image.at(1, 0), 1.0f));
  EXPECT_EQ(png.at(0, 1), (Rgb8{255, 137, 0}));  // 0.25 -> 1.055 * 0.25^(1/2.4) - 0.055 = 0.5371
  EXPECT_EQ(png.at(2, 1), (Rgb8{255, 0, 255}));
}

TEST_F(Picture, MapPixelsHaveTheColoursOfTheScale) {
  ScalarImage map = ramp(200, 170);
  map.at(70, 80) = kNaN;
  const MapStyle style{"α_{L1}", {"weight [1]", 0.25f, 0.75f, ColorMap::Viridis}};
  const PixelRect place = write_png_map(folder_ / "m.png", map, style);
  EXPECT_EQ(place.width, 200);
  EXPECT_EQ(place.height, 170);
  const Png png(folder_ / "m.png");
  for (int i = 0; i < map.width * map.height; ++i) {
    const int x = i % map.width;
    const int y = i / map.width;
    ASSERT_EQ(png.at(place.x + x, place.y + y), scale_color(style.scale, map.at(x, y))) << i;
  }
  EXPECT_EQ(png.at(place.x + 70, place.y + 80), (Rgb8{255, 0, 255}));
}

TEST_F(Picture, SmallMapsAreEnlargedByWholePixels) {
  const ScalarImage map = ramp(8, 8);
  const PixelRect place = write_png_map(folder_ / "s.png", map, {"", {}});
  EXPECT_EQ(place.height, 160);
  const Png png(folder_ / "s.png");
  EXPECT_EQ(png.at(place.x, place.y), scale_color({}, 0.0f));
  EXPECT_EQ(png.at(place.x + 159, place.y + 159), scale_color({}, 1.0f));
}

TEST_F(Picture, NonFinitePixelsAreAnnouncedByASwatchOutsideOfTheMap) {
  ScalarImage map = ramp(300, 200);
  write_png_map(folder_ / "clean.png", map, {"t", {}});
  EXPECT_EQ(Png(folder_ / "clean.png").count(kNonFiniteColor), 0u);
  map.at(5, 5) = kInfinity;
  write_png_map(folder_ / "bad.png", map, {"t", {}});
  EXPECT_GT(Png(folder_ / "bad.png").count(kNonFiniteColor), 50u);
}

TEST_F(Picture, StripPanelsLieApartInsideTheSheetAndKeepTheirColours) {
  std::vector<Panel> panels(5, Panel{"α_{cone}", ramp(400, 300)});
  panels[1] = {"MIS", make_image(400, 300, Rgb(0.5f))};
  std::get<ScalarImage>(panels[4].content).at(0, 0) = kNaN;
  StripStyle style;
  style.columns = 3;
  style.max_panel_width = 100;
  const auto places = write_png_strip(folder_ / "s.png", panels, "title", style);
  const Png png(folder_ / "s.png");
  ASSERT_EQ(places.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    const PixelRect& a = places[i];
    EXPECT_TRUE(a.width == 100 && a.height == 75);
    EXPECT_TRUE(a.x > 0 && a.y > 0 && a.x + a.width < png.width() && a.y + a.height < png.height());
    for (std::size_t j = i + 1; j < 5; ++j) {
      const PixelRect& b = places[j];
      EXPECT_TRUE(a.x + a.width < b.x || a.y + a.height < b.y) << i << " overlaps " << j;
    }
  }
  EXPECT_EQ(png.at(places[1].x + 50, places[1].y + 37), (Rgb8{188, 188, 188}));
  EXPECT_EQ(png.at(places[4].x, places[4].y), kNonFiniteColor);
  const float mean = downscale_box(ramp(400, 300), 100, 75).at(40, 0);
  EXPECT_EQ(png.at(places[0].x + 40, places[0].y + 9), scale_color(style.scale, mean));
}

TEST_F(Picture, FaultsAreRunErrorsWithThePath) {
  const auto message = [](auto&& action) -> std::string {
    try {
      action();
      return "no RunError";
    } catch (const RunError& error) {
      return error.what();
    }
  };
  const fs::path path = folder_ / "f.png";
  const ScalarImage map = ramp(9, 9);
  const std::vector<Panel> sizes{{"a", map}, {"b", ramp(9, 8)}};
  for (const std::string& text :
       {message([&] { write_png_rgb(path, Image{}); }),
        message([&] { write_png_rgb(path, make_image(40000, 1)); }), message([&] {
          write_png_map(path, map, {"", {"", 1.0f, 1.0f, ColorMap::Viridis}});
        }),
        message([&] {
          write_png_map(path, map, {"", {"", 0.0f, 1.0f, ColorMap::BlueWhiteRed}});
        }),
        message([&] {
          write_png_map(path, map, {"not UTF-8: \xff", {}});
        }),
        message([&] { write_png_strip(path, {}, ""); }),
        message([&] { write_png_strip(path, sizes, ""); })}) {
    EXPECT_NE(text.find("f.png"), std::string::npos) << text;
  }
  EXPECT_FALSE(fs::exists(path));
  const std::string missing =
      message([&] { write_png_rgb(folder_ / "none/f.png", make_image(1, 1)); });
  EXPECT_NE(missing.find("No such file"), std::string::npos) << missing;
}

}  // namespace
}  // namespace penumbra
