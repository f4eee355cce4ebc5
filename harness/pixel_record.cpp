#include "harness/pixel_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "harness/tile.h"

namespace penumbra {
namespace {

// Whether a float can hold a sample's part of the estimate, and it may be there.
bool is_sound(const Vec3d& part) {
  constexpr auto kMost = static_cast<double>(std::numeric_limits<float>::max());
  for (int i = 0; i < 3; ++i) {
    if (!(part[i] >= 0.0 && part[i] <= kMost)) return false;
  }
  return true;
}

std::string sample_text(const EstimateRecord& record, std::size_t index) {
  const SampleRecord& sample = record.samples[index];
  return fmt::format("component {}, sample {}: f ({:g}, {:g}, {:g}), weight {:g}",
                     record.components[static_cast<std::size_t>(sample.component)], index,
                     sample.f.x, sample.f.y, sample.f.z, sample.weight);
}

// The first sample that is bad by itself, or else the largest: the sum is too large then.
std::string cause_in(const EstimateRecord& record) {
  if (is_bad(record.delta)) return "component of delta lights and mirrors";
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(record.control[i])) return "control variates";
  }
  double most = 0.0;
  std::optional<std::size_t> largest;
  for (std::size_t i = 0; i < record.samples.size(); ++i) {
    const SampleRecord& sample = record.samples[i];
    // A black sample adds nothing, also where its weight is infinite.
    if (is_black(sample.f)) continue;
    const Vec3d part = Vec3d(sample.f) * sample.weight;
    if (!is_sound(part)) return sample_text(record, i);
    const double size = std::max({part.x, part.y, part.z});
    if (largest && size <= most) continue;
    most = size;
    largest = i;
  }
  if (!largest) return "component unknown: no recorded sample is bad or brings light";
  return "sum of all; the largest is " + sample_text(record, *largest);
}

std::string cause_of(const EstimatorEntry& estimator, const PixelRecord& pixel,
                     const BadEstimate& bad) {
  if (!is_bad_estimate(estimator, pixel.estimates[static_cast<std::size_t>(bad.estimate)])) {
    return "component unknown: run again, the estimate is sound";
  }
  const auto record =
      std::find_if(pixel.records.begin(), pixel.records.end(),
                   [&](const EstimateRecord& r) { return r.estimate == bad.estimate; });
  if (record == pixel.records.end()) return "component unknown: the estimator left no record";
  return cause_in(*record);
}

}  // namespace

PixelRecord record_pixel(const Scene& scene, const ShadingPoints& points,
                         const RenderSettings& settings, int x, int y) {
  PixelRecord result;
  result.tile = make_tile(points, points.tiles[tile_index_at(points, x, y)], settings.spp);
  result.pixel = (y - result.tile.y0) * result.tile.width + (x - result.tile.x0);
  std::vector<Rgb> radiance(result.tile.estimate_count());
  EstimateRecorder recorder{result.pixel, {}};
  TileOutput out;
  out.radiance = radiance;
  out.recorder = &recorder;
  const DenormalMode mode(settings.denormals);
  settings.estimator->create(scene, settings.params, settings.budget)
      ->estimate(result.tile, settings.seed, out);
  const std::span<const Rgb> estimates = estimates_of(result.tile, result.pixel, radiance);
  result.estimates.assign(estimates.begin(), estimates.end());
  result.records = std::move(recorder.estimates);
  return result;
}

void find_causes(const Scene& scene, const ShadingPoints& points, const RenderSettings& settings,
                 RenderResult& result) {
  std::optional<PixelRecord> pixel;
  const BadEstimate* last = nullptr;
  // In image order, so those of one pixel follow each other.
  for (BadEstimate& bad : result.bad) {
    if (last == nullptr || last->x != bad.x || last->y != bad.y) {
      pixel = record_pixel(scene, points, settings, bad.x, bad.y);
    }
    bad.cause = cause_of(*settings.estimator, *pixel, bad);
    last = &bad;
  }
}

}  // namespace penumbra
