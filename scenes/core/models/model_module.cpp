#include <algorithm>
#include <cctype>
#include <string>

#include "scenes/core/error.h"
#include "scenes/core/models/importers.h"

using penumbra::InputError;
using penumbra::Model;
using penumbra::ModelFaces;

extern "C" __attribute__((visibility("default"))) void penumbra_load_model(
    const std::filesystem::path& file, ModelFaces faces, Model& model) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".obj") {
    model = penumbra::load_obj(file, faces);
  } else {
    throw InputError(file.string() + ": error: unknown format \"" + extension +
                     "\" of a model file, expected .obj");
  }
}
