// The estimators of the project with a planted fault, for tests of the gate: the program
// penumbra_planted is penumbra with this registry. PENUMBRA_PLANT names the fault; without it the
// estimators are as they are.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string_view>
#include <thread>
#include <utility>

#include "estimators/estimator.h"
#include "harness/clocks.h"
#include "scenes/core/error.h"

namespace penumbra {

/// The real registry, compiled under another name.
std::span<const EstimatorEntry* const> sound_estimators();

namespace {

// More error or time, so that the efficiency falls to 0.95.
constexpr double kLoss = 1.0 / 0.95 - 1.0;
constexpr int kTilesPerRepeat = 20;

enum class Plant { None, Noise, Slow, MoreRays, Energy, Streams, NotANumber, Random, Crash, Hang };

Plant plant_of_environment() {
  const char* const text = std::getenv("PENUMBRA_PLANT");
  const std::string_view name = text == nullptr ? "" : text;
  constexpr std::pair<std::string_view, Plant> kNames[] = {
      {"", Plant::None},          {"noise", Plant::Noise},
      {"slow", Plant::Slow},      {"more_rays", Plant::MoreRays},
      {"energy", Plant::Energy},  {"streams", Plant::Streams},
      {"nan", Plant::NotANumber}, {"random", Plant::Random},
      {"crash", Plant::Crash},    {"hang", Plant::Hang}};
  for (const auto& [known, plant] : kNames) {
    if (known == name) return plant;
  }
  std::fprintf(stderr, "PENUMBRA_PLANT: \"%s\" is no fault that can be planted\n", text);
  std::exit(2);
}

// Cheap, so that more noise does not come with more work. Source: SplitMix64, Steele et al. 2014.
std::uint64_t mixed(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15U;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31U);
}

class Planted final : public Estimator {
 public:
  Planted(std::unique_ptr<Estimator> sound, Plant plant)
      : sound_(std::move(sound)), plant_(plant) {}

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    const double start_s = thread_cpu_s();
    sound_->estimate(tile, plant_ == Plant::Streams ? ~seed : seed, out);
    const double end_s = thread_cpu_s();
    switch (plant_) {
      case Plant::None:
      case Plant::Streams:
        return;
      case Plant::Noise:
        return repeat_samples(tile, seed, out);
      case Plant::Slow:
        while (thread_cpu_s() < end_s + kLoss * (end_s - start_s)) continue;
        return;
      case Plant::MoreRays:
        return repeat_tile(tile, seed, out);
      case Plant::Energy:
        for (Rgb& value : out.radiance) value *= 1.02f;
        return;
      case Plant::NotANumber:
        if (tile.x0 == 0 && tile.y0 == 0) {
          out.radiance[0] = Rgb(std::numeric_limits<float>::quiet_NaN());
        }
        return;
      case Plant::Random:
        out.radiance[0] *= 1.0f + 1e-4f * static_cast<float>(std::rand() % 1000);
        return;
      case Plant::Crash:
        std::abort();
      case Plant::Hang:
        for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
    }
  }

  std::vector<MapInfo> maps() const override { return sound_->maps(); }

 private:
  // Some estimates are those before them at the same shading point again: of n independent ones
  // each that repeats its neighbour with probability q has the variance (1 + 2 q (n-1)/n) / n.
  static void repeat_samples(const Tile& tile, std::uint64_t seed, TileOutput& out) {
    const int n = tile.spp / tile.camera_samples;
    if (n < 2) return;
    const double q = kLoss * n / (2.0 * (n - 1));
    for (int pixel = 0; pixel < tile.pixel_count(); ++pixel) {
      for (int e = tile.spp - 1; e >= tile.camera_samples; --e) {
        const std::uint64_t key =
            mixed(seed ^ mixed(tile.pixel_index(pixel) * 4096U + static_cast<std::uint64_t>(e)));
        if (static_cast<double>(key >> 11U) * 0x1p-53 >= q) continue;
        const auto place = static_cast<std::size_t>(pixel) * static_cast<std::size_t>(tile.spp) +
                           static_cast<std::size_t>(e);
        out.radiance[place] = out.radiance[place - static_cast<std::size_t>(tile.camera_samples)];
      }
    }
  }

  // Every twentieth tile is estimated twice.
  void repeat_tile(const Tile& tile, std::uint64_t seed, TileOutput& out) {
    const int tiles_per_row = (tile.image_width + tile.width - 1) / tile.width;
    const int index = tile.y0 / tile.height * tiles_per_row + tile.x0 / tile.width;
    if (index % kTilesPerRepeat != kTilesPerRepeat / 2) return;
    sound_->estimate(tile, seed, out);
  }

  std::unique_ptr<Estimator> sound_;
  Plant plant_;
};

template <std::size_t index>
std::unique_ptr<Estimator> create_planted(const Scene& scene, const ParamSet& params,
                                          const Budget& budget) {
  static const Plant plant = plant_of_environment();
  return std::make_unique<Planted>(sound_estimators()[index]->create(scene, params, budget), plant);
}

constexpr std::size_t kMostEstimators = 24;

template <std::size_t... index>
std::vector<EstimatorEntry> planted_entries(std::index_sequence<index...>) {
  using Create = std::unique_ptr<Estimator> (*)(const Scene&, const ParamSet&, const Budget&);
  constexpr Create kCreate[] = {&create_planted<index>...};
  const auto sound = sound_estimators();
  PN_CHECK(sound.size() <= kMostEstimators, "every estimator gets its fault");
  std::vector<EstimatorEntry> entries;
  for (std::size_t i = 0; i < sound.size(); ++i) {
    entries.push_back(*sound[i]);
    entries.back().create = kCreate[i];
  }
  return entries;
}

}  // namespace

std::span<const EstimatorEntry* const> all_estimators() {
  static const std::vector<EstimatorEntry> entries =
      planted_entries(std::make_index_sequence<kMostEstimators>());
  static const std::vector<const EstimatorEntry*> pointers = [] {
    std::vector<const EstimatorEntry*> result;
    for (const EstimatorEntry& entry : entries) result.push_back(&entry);
    return result;
  }();
  return pointers;
}

const EstimatorEntry* find_estimator(std::string_view name) {
  for (const EstimatorEntry* entry : all_estimators()) {
    if (entry->name == name) return entry;
  }
  return nullptr;
}

}  // namespace penumbra
