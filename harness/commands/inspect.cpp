#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "harness/commands/commands.h"
#include "harness/inspection.h"

namespace penumbra {

int inspect_command(const InspectOptions& options) {
  const Inspection inspection = inspect_scene(options.scene, options.keep_all);
  if (options.json) {
    fmt::print("{}\n", inspection_json(inspection).dump(2));
  } else {
    fmt::print("{}", inspection_text(inspection));
  }
  return kSuccess;
}

}  // namespace penumbra
