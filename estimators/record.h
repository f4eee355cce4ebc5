#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scenes/core/vec.h"

/// What an estimator did at one pixel, sample by sample, for `penumbra replay`. Recording allocates
/// and is never timed; it changes no bit of the result.
namespace penumbra {

/// What became of a direction.
enum class SampleFate : std::uint8_t {
  NoDirection,   ///< the technique had none to give
  BelowHorizon,  ///< of the geometric or the shading normal
  MissesLights,  ///< meets no light's surface, whatever else is in the scene
  BlackBsdf,     ///< f = 0 although above the horizon
  NotChosen,     ///< a candidate that was not traced
  Dark,          ///< traced, and another surface or a light's dark side was met
  Lit,           ///< traced, and light arrives
};

std::string_view to_string(SampleFate fate);

struct SampleRecord {
  int iteration{0};
  int component{0};         ///< that drew it, index into EstimateRecord::components
  Vec3 wi{0.0f};            ///< unit, scene space
  std::vector<float> pdfs;  ///< [component], density of each in this direction [1/sr]; its own as
                            ///< drawn; empty where the estimator evaluates its own only
  float own_pdf{0.0f};      ///< [1/sr]
  Rgb f{0.0f};              ///< integrand: arriving radiance x BSDF x cosine
  double weight{0.0};       ///< the estimate is the sum of weight x f over all samples [sr], and
                            ///< of EstimateRecord::delta and ::control
  SampleFate fate{SampleFate::NoDirection};
};

/// State of the mixture in one iteration (pass, population) of an estimate.
struct IterationRecord {
  std::vector<int> counts;    ///< [component] samples drawn
  std::vector<double> alpha;  ///< [component] mixture weights they were rounded from
  Vec3 cone_axis{0.0f};       ///< unit, scene space; 0 without a cone
  double cone_angle{0.0};     ///< half angle [rad]; 0 without a cone
  int rays{0};
  int hits{0};  ///< samples that brought light
};

struct EstimateRecord {
  int estimate{0};  ///< index in the pixel
  std::vector<std::string> components;
  std::vector<IterationRecord> iterations;
  std::vector<SampleRecord> samples;
  Rgb delta{0.0f};    ///< part of the result that is added without sampling: light of delta lights,
                      ///< and all light in a mirror
  Rgb control{0.0f};  ///< part of the result by control variates: their integrals less their
                      ///< estimates
  std::vector<std::string> notes;  ///< what else the estimator has to say, one line each
};

/// Asks an estimator to record all estimates of one pixel of a tile.
struct EstimateRecorder {
  int pixel_in_tile{0};
  std::vector<EstimateRecord> estimates;

  /// The record to fill for an estimate, or nullptr when its pixel is not asked for. Records begun
  /// before move.
  EstimateRecord* begin(int pixel, int estimate);
  /// The record of an estimate that was begun, or nullptr.
  EstimateRecord* find(int pixel, int estimate);
};

}  // namespace penumbra
