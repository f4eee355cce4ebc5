#include <nlohmann/json.hpp>
#include <utility>

#include "scenes/core/error.h"
#include "scenes/core/located_json.h"
#include "scenes/core/scene.h"
#include "scenes/core/scene_file.h"
#include "scenes/core/shading_point.h"
#include "tests/fuzz/refusal.h"
#include "tests/fuzz/target.h"

namespace penumbra {
namespace {

/// Generated geometry takes seconds, and its only inputs are names and a number that the schema
/// checks.
bool generates(const nlohmann::json& root) {
  if (!root.is_object() || !root.contains("shapes") || !root["shapes"].is_array()) return false;
  for (const nlohmann::json& shape : root["shapes"]) {
    if (shape.is_object() && shape.contains("generate")) return true;
  }
  return false;
}

}  // namespace

/// A scene file, its summary, and the scene that is built of what the file says.
void fuzz_scene(const Sandbox& sandbox, std::string_view input) {
  const std::string file = (sandbox.folder() / "scene.json").string();
  accepts<InputError>(file, [&] { read_scene_summary(sandbox.write("scene.json", input)); });
  accepts<InputError>(file, [&] {
    const LocatedJson document = LocatedJson::parse_text(input, file);
    if (generates(document.root())) return;
    SceneDescription description = parse_scene_description(document);
    description.camera.resolution = {8, 8};
    const Scene scene(std::move(description));
    const ShadingPoints points = make_shading_points(scene, 1, 1, 8);
    PN_CHECK(points.points.size() == 64, "one point per pixel");
  });
}

}  // namespace penumbra
