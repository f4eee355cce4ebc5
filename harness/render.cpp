#include "harness/render.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <mutex>
#include <thread>

#include "harness/clocks.h"
#include "harness/keys.h"
#include "harness/tile.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::size_t kMaxListed = 100;

/// Of one tile; every thread keeps them.
constexpr std::size_t kMaxTileEstimates = std::size_t{1} << 27;

constexpr int kMaxThreads = 4096;  // as the schema of experiments has it

// An estimator with the buffers of one tile; one per thread slot.
struct Worker {
  std::unique_ptr<Estimator> estimator;
  std::vector<Rgb> radiance;
  std::vector<float> maps;
  EstimateCounters counters;
  std::uint64_t bad_count{0};
  std::vector<BadEstimate> bad;
};

class Job {
 public:
  Job(const Scene& scene, const ShadingPoints& points, const RenderSettings& settings,
      RenderResult& result)
      : points_(points), settings_(settings), result_(result), workers_(threads()) {
    const Stopwatch prepare;
    for (Worker& worker : workers_) {
      worker.estimator = settings.estimator->create(scene, settings.params, settings.budget);
    }
    if (settings.maps) result.map_infos = workers_[0].estimator->maps();
    size_buffers();
    result.time_prepare_s = prepare.wall_s();
  }

  void run() {
    tbb::task_arena arena(static_cast<int>(workers_.size()));
    const InstructionCounter::Reading before = InstructionCounter::read();
    const Stopwatch watch;
    arena.execute([&] {
      tbb::parallel_for(
          tbb::blocked_range<std::size_t>(0, points_.tiles.size(), 1),
          [&](const tbb::blocked_range<std::size_t>& range) {
            const DenormalMode mode(settings_.denormals);
            Worker& worker =
                workers_[static_cast<std::size_t>(tbb::this_task_arena::current_thread_index())];
            for (std::size_t i = range.begin(); i != range.end(); ++i) {
              if (!settings_.tiles.has(i)) continue;
              one_tile(points_.tiles[i], worker);
            }
          },
          tbb::simple_partitioner());
    });
    result_.time_wall_s = watch.wall_s();
    result_.time_cpu_s = watch.cpu_s();
    result_.instructions = InstructionCounter::since(before);
    collect();
  }

 private:
  std::size_t threads() const { return static_cast<std::size_t>(std::max(1, settings_.threads)); }

  void size_buffers() {
    std::size_t largest = 0;
    for (const TileRect& tile : points_.tiles) {
      largest = std::max(
          largest, static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(tile.height));
    }
    const std::size_t estimates = largest * static_cast<std::size_t>(settings_.spp);
    if (estimates > kMaxTileEstimates) {
      throw InputError(std::to_string(settings_.spp) + " estimates for each of " +
                       std::to_string(largest) + " pixels of a tile are too many; allowed: up to " +
                       std::to_string(kMaxTileEstimates) + " together");
    }
    for (Worker& worker : workers_) {
      worker.radiance.resize(estimates);
      worker.maps.resize(estimates * result_.map_infos.size());
      worker.bad.reserve(kMaxListed);
    }
    result_.width = points_.width;
    result_.height = points_.height;
    result_.radiance.assign(
        static_cast<std::size_t>(points_.width) * static_cast<std::size_t>(points_.height),
        Vec3d(0.0));
    for (std::size_t m = 0; m < result_.map_infos.size(); ++m) {
      result_.maps.push_back(make_scalar_image(points_.width, points_.height));
    }
  }

  void one_tile(const TileRect& rect, Worker& worker) {
    const Tile tile = make_tile(points_, rect, settings_.spp);
    TileOutput out;
    out.radiance = std::span(worker.radiance).first(tile.estimate_count());
    out.maps = std::span(worker.maps).first(tile.estimate_count() * result_.map_infos.size());
    out.clock = settings_.clock;
    worker.estimator->estimate(tile, settings_.seed, out);
    worker.counters += out.counters;
    for (int pixel = 0; pixel < tile.pixel_count(); ++pixel) store_pixel(tile, pixel, out, worker);
  }

  void store_pixel(const Tile& tile, int pixel, const TileOutput& out, Worker& worker) {
    const std::span<const Rgb> estimates = estimates_of(tile, pixel, out.radiance);
    for (std::size_t e = 0; e < estimates.size(); ++e) {
      if (is_bad_estimate(*settings_.estimator, estimates[e])) {
        note_bad(tile, pixel, static_cast<int>(e), estimates[e], worker);
      }
    }
    const std::size_t place = tile.pixel_index(pixel);
    result_.radiance[place] = pixel_mean(tile, estimates);

    const std::size_t first = static_cast<std::size_t>(pixel) * estimates.size();
    const std::size_t maps = result_.map_infos.size();
    for (std::size_t m = 0; m < maps; ++m) {
      double total = 0.0;
      int valid = 0;
      for (int e = 0; e < tile.spp; ++e) {
        if (!tile.point(pixel, e).valid()) continue;
        total += static_cast<double>(out.maps[(first + static_cast<std::size_t>(e)) * maps + m]);
        ++valid;
      }
      result_.maps[m].pixels[place] = valid > 0 ? static_cast<float>(total / valid) : 0.0f;
    }
  }

  static void note_bad(const Tile& tile, int pixel, int estimate, const Rgb& value,
                       Worker& worker) {
    ++worker.bad_count;
    if (worker.bad.size() >= kMaxListed) return;
    worker.bad.push_back(
        {tile.x0 + pixel % tile.width, tile.y0 + pixel / tile.width, estimate, value, {}});
  }

  void collect() {
    for (const Worker& worker : workers_) {
      result_.counters += worker.counters;
      result_.bad_count += worker.bad_count;
      result_.bad.insert(result_.bad.end(), worker.bad.begin(), worker.bad.end());
    }
    std::sort(result_.bad.begin(), result_.bad.end(), [](const auto& a, const auto& b) {
      return std::tie(a.y, a.x, a.estimate) < std::tie(b.y, b.x, b.estimate);
    });
    if (result_.bad.size() > kMaxListed) result_.bad.resize(kMaxListed);
  }

  const ShadingPoints& points_;
  const RenderSettings& settings_;
  RenderResult& result_;
  std::vector<Worker> workers_;
};

}  // namespace

std::string describe(const BadEstimate& bad) {
  return fmt::format("pixel {},{} estimate {}: ({}, {}, {}){}{}", bad.x, bad.y, bad.estimate,
                     bad.value.x, bad.value.y, bad.value.z, bad.cause.empty() ? "" : "; ",
                     bad.cause);
}

Image RenderResult::image() const {
  Image result = make_image(width, height);
  for (std::size_t i = 0; i < radiance.size(); ++i) result.pixels[i] = stored_pixel(radiance[i]);
  return result;
}

std::string RenderResult::radiance_hash() const {
  return hash_of_bytes(std::as_bytes(std::span(radiance)));
}

RenderResult render(const Scene& scene, const ShadingPoints& points,
                    const RenderSettings& settings) {
  PN_CHECK(settings.spp >= points.camera_samples, "every camera sample gets an estimate");
  PN_CHECK(settings.clock == nullptr || settings.threads == 1, "a clock is for one thread");
  RenderResult result;
  Job job(scene, points, settings, result);
  job.run();
  return result;
}

std::vector<Vec3d> seen_emission(const Scene& scene, const ShadingPoints& points) {
  std::vector<Vec3d> emission(
      static_cast<std::size_t>(points.width) * static_cast<std::size_t>(points.height), Vec3d(0.0));
  if (points.quantity == Quantity::Irradiance) return emission;
  const auto samples = static_cast<std::size_t>(points.camera_samples);
  for (const TileRect& tile : points.tiles) {
    const std::span<const ShadingPoint> list = points.of(tile);
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].light == kNoLight) continue;
      const auto pixel = static_cast<int>(i / samples);
      const std::size_t place =
          pixel_index(points.width, tile.x0 + pixel % tile.width, tile.y0 + pixel / tile.width);
      const Light& light = scene.lights()[static_cast<std::size_t>(list[i].light)];
      emission[place] += Vec3d(light.radiance_along(-list[i].wo)) / static_cast<double>(samples);
    }
  }
  return emission;
}

Image add_images(int width, int height, const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
  Image result = make_image(width, height);
  for (std::size_t i = 0; i < result.pixels.size(); ++i) {
    result.pixels[i] = stored_pixel(a[i] + b[i]);
  }
  return result;
}

int resolve_threads(int threads) {
  if (threads < 0 || threads > kMaxThreads) {
    throw InputError("threads: expected 0, for all cores, to " + std::to_string(kMaxThreads) +
                     ", found " + std::to_string(threads));
  }
  if (threads > 0) return threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace penumbra
