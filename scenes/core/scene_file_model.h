#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "scenes/core/scene_description.h"
#include "scenes/core/scene_file_shapes.h"

/// Shapes of type "model": geometry that is generated or comes from a model file; a part of
/// scene_file.cpp.
namespace penumbra {

/// The folder of real models that stand in for generated geometry, where this is set and not empty.
inline constexpr const char* kModelsVariable = "PENUMBRA_MODELS";

/// Where a model's geometry came from.
enum class ModelSource : std::uint8_t {
  File,       ///< named by the scene file
  Generated,  ///< made by the project
  RealModel,  ///< a file of the models' folder in place of generated geometry
};

struct ModelShape {
  Shape shape;  ///< a TriangleMeshShape or a SubdivisionShape, placed
  ModelSource source{ModelSource::File};
};

/// @param value     obeys the schema
/// @param faults    keys that exclude each other; files that cannot be read
/// @param warnings  those of the model file; normals that have no direction
/// @return nullopt where there is a fault
std::optional<ModelShape> read_model_shape(const nlohmann::json& value, const ShapePlace& place,
                                           DiagnosticList& faults,
                                           std::vector<std::string>& warnings);

}  // namespace penumbra
