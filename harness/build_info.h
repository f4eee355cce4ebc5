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

/// What one call of `penumbra run` was.
struct Session {
  int threads{1};
  std::string command_line;
  std::string config;  ///< resolved, as text
};

/// Machine, build, libraries and the calls that measured, as JSON text: environment.json of a
/// result.
/// @param before  the same of earlier calls, whose list of sessions goes on; or empty
std::string environment_json(const Session& session, const std::string& before);

/// Name and core count that timings belong to.
std::string machine_text();

}  // namespace penumbra
