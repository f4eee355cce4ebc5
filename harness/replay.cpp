#include "harness/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "harness/exr.h"
#include "harness/pixel_record.h"
#include "harness/tile.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

bool same_bits(const Rgb& a, const Rgb& b) {
  for (int i = 0; i < 3; ++i) {
    if (std::bit_cast<std::uint32_t>(a[i]) != std::bit_cast<std::uint32_t>(b[i])) return false;
  }
  return true;
}

std::string material_name(const LoadedScene& scene, const ShadingPoint& point) {
  if (!point.valid()) return {};
  if (point.material < scene.material_names.size()) return scene.material_names[point.material];
  return "irradiance";
}

ReplayedEstimate describe(const LoadedScene& scene, const Tile& tile, int pixel, int estimate,
                          const Rgb& value) {
  ReplayedEstimate result;
  result.camera_sample = estimate % tile.camera_samples;
  result.point = tile.point(pixel, estimate);
  const SceneTraits& traits = scene.scene->traits();
  if (result.point.valid()) {
    result.position_world = traits.center + Vec3d(result.point.position) / traits.scale;
  }
  result.material = material_name(scene, result.point);
  result.value = value;
  result.record.estimate = estimate;
  return result;
}

void take_record(std::vector<ReplayedEstimate>& estimates, EstimateRecord record) {
  ReplayedEstimate& estimate = estimates.at(static_cast<std::size_t>(record.estimate));
  for (const SampleRecord& sample : record.samples) {
    // A black sample adds nothing, also where its weight is infinite.
    if (!is_black(sample.f)) estimate.weighted_sum += Vec3d(sample.f) * sample.weight;
  }
  estimate.record = std::move(record);
  estimate.recorded = true;
}

void compare_with_picture(const StoredRow& stored, PixelReplay& replay) {
  if (stored.row().block != 0) {
    replay.why_not_stored =
        fmt::format("pictures are of block 0, the row is of block {}", stored.row().block);
    return;
  }
  const std::filesystem::path file = stored.image();
  if (!std::filesystem::exists(file)) {
    replay.why_not_stored = "there is no " + file.string();
    return;
  }
  const ExrFile exr = read_exr(file);
  const auto cell = exr.metadata.find("cell");
  const RunRow& row = stored.row();
  if (cell == exr.metadata.end() || cell->second != row.cell || exr.width != row.width ||
      exr.height != row.height) {
    throw ReferenceError(fmt::format("{}: is not the picture of cell {}, {} x {} pixels",
                                     file.string(), row.cell, row.width, row.height));
  }
  const std::size_t place = pixel_index(row.width, replay.x, replay.y);
  replay.stored = {file, exr.image("reflected").pixels[place]};
}

}  // namespace

double ReplayedEstimate::relative_difference() const {
  double difference = 0.0;
  double largest = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double sum = weighted_sum[i] + static_cast<double>(record.delta[i]) +
                       static_cast<double>(record.control[i]);
    const double error = std::abs(sum - static_cast<double>(value[i]));
    if (!(error <= difference)) difference = error;
    largest = std::max(largest, static_cast<double>(std::abs(value[i])));
  }
  return difference == 0.0 ? 0.0 : difference / largest;
}

bool PixelReplay::differs() const { return stored && !same_bits(stored->value, value); }

PixelReplay replay_pixel(const StoredRow& stored, int x, int y) {
  const LoadedScene& scene = stored.scene();
  const ShadingPoints& points = scene.points;
  if (x < 0 || y < 0 || x >= points.width || y >= points.height) {
    throw InputError(fmt::format(
        "--pixel: {},{} is outside the image of {} x {} pixels (from 0,0 at the upper left)", x, y,
        points.width, points.height));
  }
  const RenderSettings settings = stored.settings(1);
  PixelRecord recorded = record_pixel(*scene.scene, points, settings, x, y);
  const Tile& tile = recorded.tile;

  PixelReplay replay;
  replay.x = x;
  replay.y = y;
  replay.tile = {tile.x0, tile.y0, tile.width, tile.height, 0};
  replay.mean = pixel_mean(tile, recorded.estimates);
  replay.value = stored_pixel(replay.mean);
  for (int e = 0; e < tile.spp; ++e) {
    replay.estimates.push_back(
        describe(scene, tile, recorded.pixel, e, recorded.estimates[static_cast<std::size_t>(e)]));
  }
  for (EstimateRecord& record : recorded.records) {
    take_record(replay.estimates, std::move(record));
  }
  compare_with_picture(stored, replay);
  return replay;
}

RowCheck verify_row(const StoredRow& stored, int threads) {
  if (stored.row().image_hash.empty()) {
    throw ReferenceError(
        fmt::format("--verify: row {} has no image_hash: it was measured by an older version",
                    stored.row().run_id));
  }
  const LoadedScene& scene = stored.scene();
  const RenderResult result = render(*scene.scene, scene.points, stored.settings(threads));
  return {stored.row().image_hash, result.radiance_hash()};
}

}  // namespace penumbra
