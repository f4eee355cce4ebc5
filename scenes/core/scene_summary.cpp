#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "scenes/core/json_schema.h"
#include "scenes/core/scene_file.h"
#include "scenes/core/scene_schema.h"

/// What a list shows of a scene file, without the cost of the schema.
namespace penumbra {

using nlohmann::json;

namespace {

/// Numbers are looked at, because the schema is not asked.
std::array<int, 2> read_resolution(const json& camera) {
  std::array<int, 2> resolution = CameraDescription{}.resolution;
  const json sides = camera.value("resolution", json(resolution));
  for (std::size_t i = 0; i < resolution.size(); ++i) {
    const auto side = sides.at(i).get<double>();
    // A conversion of what does not fit is undefined; the number is no resolution in any case.
    const bool fits = side >= 0.0 && side <= std::numeric_limits<int>::max();
    resolution[i] = fits ? static_cast<int>(side) : 0;
  }
  return resolution;
}

}  // namespace

SceneSummary read_scene_summary(const std::filesystem::path& file) {
  const LocatedJson document = LocatedJson::parse_file(file);
  const json& root = document.root();
  try {
    SceneSummary result;
    result.name = root.at("name").get<std::string>();
    result.summary = root.value("summary", std::string());
    result.resolution = read_resolution(root.at("camera"));
    result.shapes = root.contains("shapes") ? root["shapes"].size() : 0;
    return result;
  } catch (const json::exception&) {
    // The schema says what is wrong, and where; it takes too long to be asked about sound files.
    DiagnosticList faults;
    JsonSchema(kSceneSchemaJson).validate(document, faults);
    faults.throw_if_any();
    throw;
  }
}

}  // namespace penumbra
