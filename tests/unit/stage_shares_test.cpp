#include "harness/stage_shares.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <span>
#include <string>

namespace penumbra {
namespace {

// Every point of the right half of an image is seen, and says where it is.
ShadingPoints half_image(int width, int height, int camera_samples) {
  constexpr int kTile = 16;
  ShadingPoints points;
  points.width = width;
  points.height = height;
  points.camera_samples = camera_samples;
  for (int y = 0; y < height; y += kTile) {
    for (int x = 0; x < width; x += kTile) {
      const TileRect tile{x, y, std::min(kTile, width - x), std::min(kTile, height - y),
                          points.points.size()};
      points.tiles.push_back(tile);
      for (int i = 0; i < tile.width * tile.height * camera_samples; ++i) {
        const int pixel = i / camera_samples;
        ShadingPoint& point = points.points.emplace_back();
        point.position = Vec3(static_cast<float>(x + pixel % tile.width),
                              static_cast<float>(y + pixel / tile.width),
                              static_cast<float>(i % camera_samples));
        if (point.position.x < static_cast<float>(width / 2)) continue;
        point.material = 0;
        ++points.valid_count;
      }
    }
  }
  return points;
}

double samples_of(const StageWork& work, double samples_per_estimate) {
  return static_cast<double>(work.points.valid_count) * work.spp / work.points.camera_samples *
         samples_per_estimate;
}

TEST(StageWork, PointsAreThoseOfTheImageInTheirPlaces) {
  const ShadingPoints image = half_image(200, 120, 2);
  const StageWork work = stage_work(image, 4, 10.0);
  EXPECT_EQ(work.points.width, image.width);
  EXPECT_EQ(work.points.height, image.height);
  std::size_t valid = 0;
  for (const TileRect& tile : work.points.tiles) {
    const std::span<const ShadingPoint> points = work.points.of(tile);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int pixel = static_cast<int>(i) / 2;
      EXPECT_EQ(points[i].position,
                Vec3(static_cast<float>(tile.x0 + pixel % tile.width),
                     static_cast<float>(tile.y0 + pixel / tile.width), static_cast<float>(i % 2)));
      valid += points[i].valid() ? 1 : 0;
    }
  }
  EXPECT_EQ(valid, work.points.valid_count);
}

TEST(StageWork, PlacesAreSpreadOverWhatIsSeen) {
  const StageWork work = stage_work(half_image(200, 120, 1), 1, 10.0);
  EXPECT_EQ(work.points.tiles.size(), 64u);
  std::set<int> parts;  // 5 x 6 of the right half, 20 x 20 pixels each
  for (const TileRect& tile : work.points.tiles) {
    const int x = std::max(tile.x0, 100);
    parts.insert((x - 100) / 20 + 5 * (tile.y0 / 20));
  }
  EXPECT_EQ(parts.size(), 30u);
}

TEST(StageWork, IsBoundedWhateverTheEstimatesCost) {
  for (const double samples : {1.0, 16.0, 72.0, 1000.0}) {
    for (const int spp : {2, 8, 64, 1024}) {
      SCOPED_TRACE(std::to_string(samples) + " samples, SPP " + std::to_string(spp));
      const StageWork work = stage_work(half_image(200, 120, 2), spp, samples);
      EXPECT_LE(work.spp, spp);
      EXPECT_GE(work.spp, 2) << "one for each camera sample";
      EXPECT_EQ(work.points.tiles.size(), 64u);
      EXPECT_LE(samples_of(work, samples), std::max(65536.0, 64 * 2 * samples));
    }
  }
  EXPECT_EQ(stage_work(half_image(200, 120, 2), 8, 72.0).spp, 8) << "single pixels are enough";
}

TEST(StageWork, NothingSeenIsNothingToDo) {
  ShadingPoints image = half_image(40, 24, 1);
  for (ShadingPoint& point : image.points) point.material = ShadingPoint::kInvalid;
  const StageWork work = stage_work(image, 1, 10.0);
  EXPECT_EQ(work.points.valid_count, 0u);
  EXPECT_TRUE(work.points.points.empty());
}

}  // namespace
}  // namespace penumbra
