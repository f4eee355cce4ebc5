#pragma once

#include <filesystem>

#include "scenes/core/models/model_file.h"

/// Inside of the module of importers: one function per format, each as `load_model`.
namespace penumbra {

Model load_obj(const std::filesystem::path& file, ModelFaces faces);
Model load_ply(const std::filesystem::path& file, ModelFaces faces);
Model load_gltf(const std::filesystem::path& file, ModelFaces faces);

/// Type of the module's entry point, `extern "C" penumbra_load_model`. Its exceptions pass to the
/// program with their types.
using LoadModelEntry = void(const std::filesystem::path& file, ModelFaces faces, Model& model);

}  // namespace penumbra
