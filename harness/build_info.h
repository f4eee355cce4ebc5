#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "harness/rank_places.h"

namespace penumbra {

/// What this program was built from; constants of the build.
struct BuildInfo {
  std::string_view version;
  std::string_view
      commit;  ///< git commit, "+dirty" appended when the tree was changed; "unknown" outside git
  std::string_view compiler;
  std::string_view flags;   ///< all that change the code of the project; warnings are left out
  std::string_view preset;  ///< name of the build folder, which a preset names after itself
  std::string_view build_type;
  std::string_view arch;      ///< PENUMBRA_ARCH as it was set: "auto", "native", ...
  std::string_view march;     ///< what became of it; empty: the compiler's default
  std::string_view sanitize;  ///< PENUMBRA_SANITIZE; empty: none
  std::string_view embree;    ///< version of the headers; the library's is found at run time
  bool ipo;                   ///< the sampling loop is optimised across files
  bool fuzz;                  ///< PENUMBRA_FUZZ
  bool asserts;               ///< debug assertions are on, timings are not representative
};

const BuildInfo& build_info();

/// All of it with its id under "build".
nlohmann::ordered_json build_json();

/// Hash of all of it. Rows of measurements.csv carry it; environment.json has the builds by it.
std::string build_id();

/// What one call of `penumbra run` was.
struct Session {
  int threads{1};
  std::string command_line;
  std::string config;                           ///< resolved, as text
  std::string shard;                            ///< "2/3"; empty: everything
  std::vector<RankPlace> ranks;                 ///< of a run that a launcher of MPI started
  std::map<std::string, std::string> machines;  ///< of all ranks: machine_json by machine_text
};

/// Machine, build, libraries and the calls that measured, as JSON text: environment.json of a
/// result.
/// @param before  the same of earlier calls, whose sessions and builds are kept; or empty
std::string environment_json(const Session& session, const std::string& before);

/// Of several results, put together: the sessions of all, and all builds and machines.
/// @param parts  environment.json of each, not empty; an empty or damaged one adds nothing
std::string joined_environment(const std::vector<std::string>& parts, const Session& session);

/// Name and core count that timings belong to.
std::string machine_text();

/// What is known of this machine, as JSON text.
std::string machine_json();

}  // namespace penumbra
