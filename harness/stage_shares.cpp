#include "harness/stage_shares.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "harness/statistics.h"
#include "harness/tile.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

// What one change of stages costs in ticks: the least over a few rows of changes.
double least_ticks_per_change() {
  constexpr int kChanges = 4096;
  double least = 1e9;
  for (int row = 0; row < 8; ++row) {
    StageClock clock;
    for (int i = 0; i < kChanges; ++i) clock.enter(EstimateStage::Sample);
    const auto spent = clock.spent()[static_cast<std::size_t>(EstimateStage::Sample)];
    least = std::min(least, static_cast<double>(spent) / (kChanges - 1));
  }
  return least;
}

// Ticks of the stages, inside and around estimates.
std::array<double, kStages> ticks_of(const StageClock& clock, double ticks_per_change) {
  std::array<double, kStages> ticks{};
  for (std::size_t s = 0; s < kStages; ++s) {
    const double changes = static_cast<double>(clock.entered()[s]);
    ticks[s] = std::max(static_cast<double>(clock.spent()[s]) - ticks_per_change * changes, 0.0);
  }
  return ticks;
}

double sum_of(const std::array<double, kStages>& ticks) {
  return std::accumulate(ticks.begin(), ticks.end(), 0.0);
}

constexpr int kPlaces = 64;
constexpr int kLargestSide = 8;  // [pixels]
constexpr double kSamples = 1 << 16;
constexpr int kTries = 32 * kPlaces;              // to find places where something is seen
constexpr double kStep[2] = {0.754877666246693,   // of the additive recurrence R2, the inverse of
                             0.569840290998053};  // the plastic number and its square

// A square with its upper left corner at a pixel, cut off at the border of the pixel's tile.
// @return false, `result` untouched, where nothing is seen
bool add_square(const ShadingPoints& all, int x, int y, int side, ShadingPoints& result) {
  const TileRect& tile = all.tiles[tile_index_at(all, x, y)];
  const auto samples = static_cast<std::size_t>(all.camera_samples);
  const int width = std::min(side, tile.x0 + tile.width - x);
  const int height = std::min(side, tile.y0 + tile.height - y);
  const std::size_t first = result.points.size();
  std::size_t valid = 0;
  for (int row = y; row < y + height; ++row) {
    const std::size_t place = static_cast<std::size_t>(row - tile.y0) * tile.width + (x - tile.x0);
    const std::size_t begin = tile.first + place * samples;
    for (std::size_t i = begin; i < begin + static_cast<std::size_t>(width) * samples; ++i) {
      valid += all.points[i].valid() ? 1 : 0;
      result.points.push_back(all.points[i]);
      if (!all.surfaces.empty()) result.surfaces.push_back(all.surfaces[i]);
    }
  }
  if (valid == 0) {
    result.points.resize(first);
    if (!all.surfaces.empty()) result.surfaces.resize(first);
    return false;
  }
  result.tiles.push_back({x, y, width, height, first});
  result.valid_count += valid;
  return true;
}

}  // namespace

std::string_view to_string(EstimateStage stage) {
  constexpr std::array<std::string_view, kStages> kNames{"outside", "set_up", "sample",
                                                         "trace",   "weigh",  "adapt"};
  return kNames[static_cast<std::size_t>(stage)];
}

StageTimer::StageTimer(const Scene& scene, const ShadingPoints& points,
                       const RenderSettings& settings)
    : scene_(scene),
      points_(points),
      settings_(settings),
      ticks_per_change_(least_ticks_per_change()) {
  PN_CHECK(settings.threads == 1, "a clock is for one thread");
}

void StageTimer::render_both() {
  const RenderResult plain = render(scene_, points_, settings_);
  total_s_.push_back(plain.time_cpu_s);
  counters_ = plain.counters;
  StageClock clock;
  RenderSettings clocked = settings_;
  clocked.clock = &clock;
  render(scene_, points_, clocked);
  const std::array<double, kStages> ticks = ticks_of(clock, ticks_per_change_);
  if (total_s_.size() == 1 || sum_of(ticks) < sum_of(least_ticks_)) least_ticks_ = ticks;
}

StageShares StageTimer::result() const {
  const auto estimates = static_cast<double>(std::max<std::uint64_t>(1, counters_.estimates));
  StageShares result;
  result.samples = static_cast<double>(counters_.samples) / estimates;
  result.rays = static_cast<double>(counters_.rays) / estimates;
  result.lit = static_cast<double>(counters_.lit) / estimates;
  result.total_ns = median(total_s_) * 1e9 / estimates;
  const double ns_per_tick = result.total_ns / sum_of(least_ticks_);
  for (std::size_t s = 0; s < kStages; ++s) result.stage_ns[s] = least_ticks_[s] * ns_per_tick;
  return result;
}

StageWork stage_work(const ShadingPoints& points, int spp, double samples_per_estimate) {
  const double samples_per_place = kSamples / kPlaces;
  const double pixels = samples_per_place / (samples_per_estimate * spp);
  const int side = std::clamp(static_cast<int>(std::sqrt(pixels)), 1, kLargestSide);
  StageWork work;
  work.spp = spp;
  if (pixels < 1.0) {
    work.spp =
        std::max(points.camera_samples, static_cast<int>(samples_per_place / samples_per_estimate));
  }
  work.points.width = points.width;
  work.points.height = points.height;
  work.points.camera_samples = points.camera_samples;
  work.points.quantity = points.quantity;
  double u = 0.5, v = 0.5;
  int places = 0;
  for (int i = 0; i < kTries && places < kPlaces; ++i) {
    const int x = static_cast<int>(u * points.width);
    const int y = static_cast<int>(v * points.height);
    places += add_square(points, x, y, side, work.points) ? 1 : 0;
    u += kStep[0] - (u + kStep[0] >= 1.0 ? 1.0 : 0.0);
    v += kStep[1] - (v + kStep[1] >= 1.0 ? 1.0 : 0.0);
  }
  return work;
}

}  // namespace penumbra
