#pragma once

#include <filesystem>
#include <string>

#include "harness/plan.h"

namespace penumbra {

/// A name that is safe as part of a file's name: other characters become single dashes.
std::string slug(const std::string& text);

/// File of a cell in the folder images/ of a result folder, named by scene, label and sampler.
/// @param folder  the result folder
/// @param scene   the cell's, as the config names it
/// @param suffix  such as ".exr"
std::filesystem::path image_file(const std::filesystem::path& folder, const std::string& scene,
                                 const Cell& cell, const std::string& suffix);

}  // namespace penumbra
