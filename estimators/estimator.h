#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "estimators/params.h"
#include "estimators/record.h"
#include "estimators/stage_clock.h"
#include "scenes/core/frame.h"
#include "scenes/core/sampler.h"
#include "scenes/core/scene.h"
#include "scenes/core/shading_point.h"

/// The contract between the harness and an estimator of direct light.
namespace penumbra {

/// A block of pixels with all their camera samples; its sides are multiples of 8 pixels except at
/// the image border.
struct Tile {
  int x0{0}, y0{0};                      ///< first pixel
  int width{0}, height{0};               ///< [pixels]
  int image_width{0};                    ///< row length, for pixel indices [pixels]
  int camera_samples{1};                 ///< fixed shading points per pixel
  int spp{1};                            ///< estimates per pixel, >= camera_samples
  std::span<const ShadingPoint> points;  ///< [pixel][camera sample], pixels row-major in the tile
  std::span<const SurfaceValues> surfaces{};  ///< same length; empty: the scene has no textures

  int pixel_count() const { return width * height; }
  std::size_t estimate_count() const {
    return static_cast<std::size_t>(pixel_count()) * static_cast<std::size_t>(spp);
  }
  /// Estimate s of a pixel is made at shading point s modulo the number of camera samples.
  const ShadingPoint& point(int pixel_in_tile, int sample) const {
    return points[point_index(pixel_in_tile, sample)];
  }
  /// Values of the textures at the same point; nullptr where the scene has none.
  const SurfaceValues* surface(int pixel_in_tile, int sample) const {
    return surfaces.empty() ? nullptr : &surfaces[point_index(pixel_in_tile, sample)];
  }
  std::size_t point_index(int pixel_in_tile, int sample) const {
    return static_cast<std::size_t>(pixel_in_tile) * static_cast<std::size_t>(camera_samples) +
           static_cast<std::size_t>(sample % camera_samples);
  }
  /// Index of a pixel in the image, which keys its random numbers.
  std::uint32_t pixel_index(int pixel_in_tile) const {
    const int x = x0 + pixel_in_tile % width;
    const int y = y0 + pixel_in_tile / width;
    return static_cast<std::uint32_t>(y * image_width + x);
  }
};

/// What every estimate of a run may spend; fixed when the estimator is made, so that it can size
/// its scratch memory.
struct Budget {
  SamplerKind sampler{SamplerKind::Independent};
  int srl_initial{
      16};  ///< shadow rays per light in the initial stage (all of them where nothing adapts)
  int srl_adaptive{0};  ///< shadow rays per light in the adaptive stage

  int srl() const { return srl_initial + srl_adaptive; }
};

/// Work done, summed over estimates. Samples that cannot contribute are not traced, so rays <=
/// samples.
struct EstimateCounters {
  std::uint64_t estimates{0};
  std::uint64_t samples{0};
  std::uint64_t candidates{0};  ///< directions drawn to choose samples from, without a ray
  std::uint64_t rays{0};
  std::uint64_t lit{0};  ///< rays that brought light
  std::uint64_t iterations{0};
  std::uint64_t uncovered{0};  ///< samples with f > 0 where the mixture density was 0: must stay 0
  std::uint64_t untraced{0};   ///< rays that were not finite or had no direction: must stay 0

  EstimateCounters& operator+=(const EstimateCounters& other);
};

/// One quantity that an estimator can report per estimate, beside the radiance.
struct MapInfo {
  std::string name;   ///< layer of an EXR file, e.g. "alpha_left"
  std::string group;  ///< maps of a group share a picture and its scale; also the scale's label
  float max{1.0f};    ///< upper end of the scale, which starts at 0
};

/// Where a tile's results go. Arrays are owned by the caller and have the sizes stated.
struct TileOutput {
  std::span<Rgb> radiance;  ///< [pixel][estimate]: outgoing radiance by direct light [W/(m^2 sr)],
                            ///< own emission excluded
  std::span<float> maps;    ///< [pixel][estimate][maps()], or empty when maps are not asked for
  EstimateCounters counters;
  EstimateRecorder* recorder{nullptr};  ///< nullptr unless a pixel is replayed
  StageClock* clock{nullptr};           ///< nullptr unless stages are timed
};

/// One estimator with its scratch memory; one object per thread.
///
/// Contract of `estimate`, checked for every registered estimator by tests/:
///  - writes every element of `out.radiance` (and of `out.maps` when not empty); 0 where the point
///  is not valid;
///  - same (scene, parameters, budget, tile, seed): same bits, whatever was estimated before and on
///  any thread;
///  - random numbers come from point sets keyed by (seed, pixel, estimate, iteration, component)
///  only;
///  - information is shared only inside the tile;
///  - at most (initial + adaptive) x lights samples per estimate on average;
///  - no allocation (but for a recorder), lock, clock (but the one given), print or exception
///  inside;
///  - results are never clamped, skipped or replaced.
class Estimator {
 public:
  virtual ~Estimator() = default;

  /// @param seed  of the run; repetitions differ in nothing else
  virtual void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept = 0;

  /// The per-estimate maps, in the order of TileOutput::maps; empty when there are none.
  virtual std::vector<MapInfo> maps() const { return {}; }
};

/// Parameters and a point set that belong together, under a name that configs can give
/// (methods[].preset).
struct Preset {
  std::string_view name;
  std::string_view doc;
  std::string_view sampler;  ///< as configs name it
  ParamSet::Map params;      ///< where they differ from the defaults
};

/// Facts about an estimator that the harness needs, and its factory. Each estimator's folder
/// defines one.
struct EstimatorEntry {
  std::string_view name;
  std::string_view summary;
  std::string_view citation;
  bool adaptive{false};        ///< uses a split budget "A-B"; a plain total is then split 1:3
  bool shares_in_tile{false};  ///< an estimate depends on other points of its tile
  /// The errors of a tile's pixels are correlated: samples, not only what is learned from them, are
  /// shared. Averages over pixels then have more variance than the pixels alone say.
  bool correlates_pixels{false};
  /// Estimates below 0 are part of the distribution, as with control variates; clamping them would
  /// bias the mean. Everybody else's are errors.
  bool may_be_negative{false};
  int min_srl{1};  ///< smallest total of shadow rays per light
  std::span<const ParamSpec> (*params)(){nullptr};
  /// nullptr: there are none.
  std::span<const Preset> (*presets)(){nullptr};
  /// Whether E[estimate] is the exact radiance with these parameters, and why not.
  /// @return empty when unbiased, otherwise the reason in one clause
  std::string (*bias_reason)(const ParamSet&){nullptr};
  /// The conformance fixture ('A' to 'F', tests/support/fixtures.h) whose test of unbiasedness the
  /// default parameters must fail; 0 where they are unbiased.
  char bias_fixture{0};
  /// Prepares for one scene and budget; the time it takes is reported apart (time_prepare_s). The
  /// scene must outlive the estimator.
  /// @throws InputError when a combination of parameters, budget and scene has no meaning
  std::unique_ptr<Estimator> (*create)(const Scene&, const ParamSet&, const Budget&){nullptr};
};

/// Presets of an estimator; none where the entry has none.
inline std::span<const Preset> presets_of(const EstimatorEntry& entry) {
  return entry.presets != nullptr ? entry.presets() : std::span<const Preset>{};
}

/// All registered estimators in the order of estimators/CMakeLists.txt; generated, so that a
/// missing one is a link error.
std::span<const EstimatorEntry* const> all_estimators();

/// @return nullptr when there is none of that name
const EstimatorEntry* find_estimator(std::string_view name);

}  // namespace penumbra
