#include "harness/config.h"
#include "scenes/core/error.h"
#include "tests/fuzz/refusal.h"
#include "tests/fuzz/target.h"

namespace penumbra {

/// An experiment, and lines "--set key.path=value" behind it. What is accepted must survive being
/// written and read back, as a run's folder does with it.
void fuzz_config(const Sandbox& sandbox, std::string_view input) {
  const std::vector<std::string_view> parts = split_input(input, "--set ");
  const std::vector<std::string> overrides(parts.begin() + 1, parts.end());
  const std::filesystem::path file = sandbox.write("config.json", parts.front());
  std::string resolved;
  const bool accepted =
      accepts<InputError>("", [&] { resolved = load_config(file, overrides).resolved_json; });
  if (!accepted) return;
  const std::filesystem::path again = sandbox.write("resolved.json", resolved);
  PN_CHECK(load_config(again).resolved_json == resolved, "a resolved config reads back to itself");
}

}  // namespace penumbra
