#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace penumbra {

/// The folder that holds scenes/ and configs/: the environment variable PENUMBRA_ROOT, else the
/// nearest such folder from the current one upwards, else the source folder of the build
/// (PENUMBRA_SOURCE_DIR).
/// @throws InputError when PENUMBRA_ROOT is set but holds no scenes/, or no such folder is found
std::filesystem::path project_root();

/// Names that `scenes/<name>/scene.json` exists for, sorted.
std::vector<std::string> scene_names(const std::filesystem::path& root);

}  // namespace penumbra
