#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "estimators/estimator.h"
#include "harness/image.h"
#include "harness/work_share.h"
#include "scenes/core/float_mode.h"

/// One run of one estimator over the shading points of an image, and what it cost.
namespace penumbra {

struct RenderSettings {
  const EstimatorEntry* estimator{nullptr};
  ParamSet params;
  Budget budget;
  int spp{1};  ///< estimates per pixel, >= camera samples
  std::uint64_t seed{0};
  int threads{1};
  WorkShare tiles;   ///< those that are estimated; the pixels of others are black
  bool maps{false};  ///< also the estimator's maps, which costs time
  /// In all threads that estimate. The choice shows in no digit of a picture.
  Denormals denormals{Denormals::Flushed};
  StageClock* clock{nullptr};  ///< is told of stages; only with one thread
};

/// A non-finite estimate, or a negative one of an estimator that may not be; never hidden.
struct BadEstimate {
  int x{0}, y{0};
  int estimate{0};
  Rgb value{0.0f};
  std::string cause;  ///< component and sample that made it so; find_causes (pixel_record.h)
};

/// "pixel 3,4 estimate 5: (nan, 0, 0); component bsdf, sample 2: ..."
std::string describe(const BadEstimate& bad);

struct RenderResult {
  int width{0}, height{0};
  std::vector<Vec3d> radiance;  ///< [y][x], mean reflected radiance, own emission excluded; or
                                ///< irradiance, as the shading points are made for
  std::vector<MapInfo> map_infos;
  std::vector<ScalarImage> maps;  ///< means over the estimates of valid points
  EstimateCounters counters;
  double time_wall_s{0};          ///< of the estimation alone
  double time_cpu_s{0};           ///< likewise, all threads
  double time_prepare_s{0};       ///< making the estimators, one per thread
  std::uint64_t instructions{0};  ///< in user space, 0 where the machine does not count them
  std::uint64_t bad_count{0};     ///< estimates that are not finite, or negative without leave
  std::vector<BadEstimate> bad;   ///< the first of them in image order, at most 100

  Image image() const;  ///< radiance as float
  /// Hash of all bits of `radiance`, 32 hexadecimal digits.
  std::string radiance_hash() const;
};

/// Runs the estimator on `settings.threads` threads. A pixel is the mean over its camera samples of
/// the mean of the estimates made at each, so the truth does not depend on the number of estimates.
/// The image has the same bits on any number of threads.
/// @throws InputError when the parameters have no meaning for the scene and budget, or a tile has
///         more estimates than memory should hold
RenderResult render(const Scene& scene, const ShadingPoints& points,
                    const RenderSettings& settings);

/// Emission of the lights that the camera sees directly, as a mean over camera samples; added to
/// pictures only. Black where the points are of irradiance.
std::vector<Vec3d> seen_emission(const Scene& scene, const ShadingPoints& points);

/// Sum of two arrays as a float image.
Image add_images(int width, int height, const std::vector<Vec3d>& a, const std::vector<Vec3d>& b);

/// Threads that "0 = all" stands for.
/// @throws InputError when there are less than 0 or more than 4096
int resolve_threads(int threads);

}  // namespace penumbra
