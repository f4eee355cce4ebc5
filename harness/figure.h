#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/report.h"

/// Static pictures for papers: the methods of a scene side by side, with their errors.
namespace penumbra {

struct FigureOptions {
  std::string scene;
  std::vector<std::string> crops;   ///< names of the config's crops or "X,Y,WIDTH,HEIGHT"; empty:
                                    ///< all crops of the scene in the config, or the whole picture
  std::vector<std::string> labels;  ///< methods from left to right; empty: all that have a picture
  float exposure{0.0f};             ///< stops
  std::filesystem::path out;        ///< .png, .svg or .pdf
};

/// Writes the figure: at the left the reference with the crops marked, then for every crop a row
/// of pictures and one of signed errors (one scale for all), below the methods' names with their
/// error and ratio of efficiency.
/// @throws InputError for a scene, method or crop that there is none of, listing those that are
/// @throws RunError when a picture cannot be read or the file cannot be written
void write_figure(const std::filesystem::path& folder, const Report& report,
                  const FigureOptions& options);

}  // namespace penumbra
