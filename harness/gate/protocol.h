#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "harness/gate/gate_run.h"

/// How a gate talks to a program that it measures: `penumbra measure CONFIG` greets with a line of
/// JSON, then answers every line that it is sent by one line. Both versions of a program that are
/// compared speak it, so it changes only with its version.
namespace penumbra {

inline constexpr int kProtocolVersion = 1;

/// The first line of a worker.
struct WorkerGreeting {
  std::vector<std::string> cells;                 ///< gate_cell_names
  std::map<std::string, std::string> references;  ///< id of the truth by scene
  std::string build;                              ///< JSON of the build
  std::string machine;
};

/// One run to make.
struct WorkerRequest {
  std::string cell;  ///< of the greeting's
  std::uint64_t seed{0};
  int threads{1};
  int spp{0};         ///< estimates per pixel; 0: the cell's
  std::string image;  ///< EXR file to write; empty: none
};

/// What it was: GateRun without what the gate itself knows.
using WorkerReply = GateRun;

std::string to_line(const WorkerGreeting& greeting);
std::string to_line(const WorkerRequest& request);
std::string to_line(const WorkerReply& reply);

/// Read a line.
/// @throws RunError saying what is wrong with it
/// @throws ReferenceError when a greeting is of another version
WorkerGreeting read_greeting(std::string_view line);
WorkerRequest read_request(std::string_view line);
WorkerReply read_reply(std::string_view line);

}  // namespace penumbra
