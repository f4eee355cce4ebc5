#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/report.h"

/// The pictures of a result folder in a form that a page can load from disk: browsers neither read
/// EXR nor let a page from disk read files, but they run scripts beside it.
namespace penumbra {

/// One picture of the page.
struct PageImage {
  std::string key;  ///< unique
  std::string scene;
  std::string label;  ///< of the method; empty for the reference
  std::string sampler;
  std::string layer;   ///< "radiance", or the name of an estimator's map
  std::string run_id;  ///< that the picture shows; empty for the reference
  int row{-1};         ///< of the efficiency table; -1 for the reference
  int width{0}, height{0};
  int channels{3};     ///< 3: radiance, seen emission included [W/(m^2 sr)]; 1: a map
  std::string script;  ///< file, relative to the page; empty when embedded
};

struct PageImages {
  std::vector<PageImage> images;     ///< scene by scene, the reference first
  std::vector<std::string> missing;  ///< what has no picture, in words
  std::string scripts;               ///< of embedded pixels
};

/// Reads the pictures of all rows that have one and writes their pixels as scripts.
/// A script is `penumbraPixels("KEY", "BASE64");` of zlib-compressed planar float32, little-endian,
/// its bytes sorted by significance (all lowest bytes first), which halves what noise costs.
/// @param embed  put all into PageImages::scripts and write no file
/// @throws RunError when a script cannot be written
PageImages make_page_images(const std::filesystem::path& folder, const Report& report, bool embed);

}  // namespace penumbra
