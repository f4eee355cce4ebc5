#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "harness/image.h"

/// OpenEXR files with several layers: references (mean, halves, variance), error images, mixture
/// weights.
namespace penumbra {

/// One layer of an EXR file and the channels that it becomes:
///   Image "":              R, G, B
///   Image "half_a":        half_a.R, half_a.G, half_a.B
///   ScalarImage "alpha":   alpha
struct ExrLayer {
  std::string name;  ///< at most 253 bytes; only an Image may have the empty name
  std::variant<Image, ScalarImage> content;
};

/// What `read_exr` found.
struct ExrFile {
  std::filesystem::path path;  ///< of the file, for messages
  int width = 0;
  int height = 0;
  std::vector<ExrLayer> layers;  ///< all of width x height; sorted by name
  std::map<std::string, std::string> metadata;

  /// The layer `name`.
  /// Errors: RunError when there is none of this kind; lists the layers of the file.
  const Image& image(const std::string& name = "") const;
  const ScalarImage& scalar(const std::string& name) const;

  /// Whether there is a layer `name` of either kind.
  bool has(const std::string& name) const;
};

/// Writes all layers into one scanline file, 32-bit float, ZIP compression. Every float keeps its
/// bits, NaN payloads included; the same arguments give the same bytes. The file appears whole or
/// not at all.
/// @param layers    at least one; all of one size; names unique
/// @param metadata  string attributes; a key that OpenEXR itself uses (channels, compression, ...)
/// is an error Errors: RunError with path and reason.
void write_exr(const std::filesystem::path& path, const std::vector<ExrLayer>& layers,
               const std::map<std::string, std::string>& metadata = {});

/// Reads a single-part file, also tiled or half-float ones of other programs (widened to float). R,
/// G and B of one prefix become an Image, every other channel a ScalarImage with the channel's full
/// name. The pixels are those of the data window; metadata are the attributes of string type.
/// Errors: RunError with path and reason: missing, not EXR, truncated, corrupt, deep, multi-part,
/// subsampled.
ExrFile read_exr(const std::filesystem::path& path);

}  // namespace penumbra
