#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/stored_row.h"

/// Running one pixel of a stored row again, with every sample. Estimators share information inside
/// a tile only, so the pixel's tile alone gives the bits of the whole image.
namespace penumbra {

/// One estimate of the pixel.
struct ReplayedEstimate {
  int camera_sample{0};
  ShadingPoint point;         ///< scene space
  Vec3d position_world{0.0};  ///< of the point, in the scene file's units
  std::string material;       ///< name; empty where the point is not valid
  Rgb value{0.0f};            ///< what the estimator returned
  EstimateRecord record;      ///< `estimate` is always set
  Vec3d weighted_sum{0.0};    ///< sum of weight x f over the recorded samples
  bool recorded{false};       ///< false where the estimator left no record

  /// Largest difference of `weighted_sum` + delta + control from `value` over the channels,
  /// relative to the largest channel of `value`; infinite or NaN where the value is not finite.
  double relative_difference() const;
};

/// The pixel as a picture in the result folder holds it.
struct StoredPixel {
  std::filesystem::path file;
  Rgb value{0.0f};
};

struct PixelReplay {
  int x{0}, y{0};
  TileRect tile;
  Vec3d mean{0.0};                          ///< in double precision, as errors are computed from it
  Rgb value{0.0f};                          ///< as image files hold it
  std::vector<ReplayedEstimate> estimates;  ///< [estimate]
  std::optional<StoredPixel> stored;
  std::string why_not_stored;  ///< where there is nothing to compare with

  /// Whether there is a stored pixel and it has other bits.
  bool differs() const;
};

/// Runs the tile that holds the pixel again.
/// @throws InputError when the pixel is outside the image
/// @throws ReferenceError when the picture in the folder is not of the row's cell
/// @throws RunError when it cannot be read
PixelReplay replay_pixel(const StoredRow& stored, int x, int y);

/// A whole row rendered again.
struct RowCheck {
  std::string stored;    ///< image_hash of the row
  std::string rendered;  ///< of the image

  bool same() const { return stored == rendered; }
};

/// Renders the row again. @throws ReferenceError when the row has no image_hash
RowCheck verify_row(const StoredRow& stored, int threads);

/// For people, in 120 columns where there are few lights with short names.
/// @param only  index of the one estimate to print; all where there is none
std::string replay_text(const StoredRow& stored, const PixelReplay& replay,
                        std::optional<int> only);

/// For programs: every number at full precision; what is not finite as "inf", "-inf" or "nan".
/// @param only   as above
/// @param check  of the whole row, where it was asked for
std::string replay_json(const StoredRow& stored, const PixelReplay& replay, std::optional<int> only,
                        const std::optional<RowCheck>& check);

}  // namespace penumbra
