#pragma once

#include <filesystem>
#include <string>

#include "scenes/core/models/model_file.h"
#include "scenes/core/scene_description.h"

/// Model files as scenes, or as parts of one.
namespace penumbra {

/// A model file as a whole scene, named after the file. Where it has no camera, one looks at the
/// middle of its bounding box from the upper right and sees all of it; where it has no light, an
/// environment of radiance 1 lights it. Warnings say so.
/// @throws InputError as `load_model`
SceneDescription scene_of_model(const std::filesystem::path& file);

/// Adds a model's materials, shapes and lights to a scene; the file's camera is left out. Names
/// that the scene has get the prefix "<stem>.", and a number where it has that as well.
/// @param stem  the file's name without folder and extension
void add_model(const std::string& stem, Model model, SceneDescription& scene);

}  // namespace penumbra
