#pragma once

#include <string>
#include <string_view>

namespace penumbra {

/// What this program was built from; constants of the build.
struct BuildInfo {
  std::string_view version;
  std::string_view
      commit;  ///< git commit, "+dirty" appended when the tree was changed; "unknown" outside git
  std::string_view compiler;
  std::string_view flags;
  std::string_view build_type;
  bool asserts;  ///< debug assertions are on, timings are not representative
};

const BuildInfo& build_info();

/// Machine, build and libraries as JSON text: environment.json of a result.
std::string environment_json(int threads, const std::string& command_line);

/// Name and core count that timings belong to.
std::string machine_text();

}  // namespace penumbra
