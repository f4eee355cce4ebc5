#include "scenes/core/models/model_file.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "scenes/core/models/importers.h"
#include "scenes/core/module.h"

namespace penumbra {

bool is_model_file(const std::filesystem::path& file) {
  static constexpr std::array<const char*, 4> kExtensions{".obj", ".ply", ".gltf", ".glb"};
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

namespace {

LoadModelEntry* importers() {
  return reinterpret_cast<LoadModelEntry*>(open_module("models", "penumbra_load_model"));
}

}  // namespace

void open_model_importers() { importers(); }

Model load_model(const std::filesystem::path& file, ModelFaces faces) {
  LoadModelEntry* const entry = importers();
  Model model;
  entry(file, faces, model);
  return model;
}

}  // namespace penumbra
