#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "harness/gate/protocol.h"

namespace penumbra {

/// How a program under test ended or misbehaved: a crash, a time out, an answer that is none. A
/// finding of the gate, not a fault of it.
class WorkerFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct WorkerOptions {
  std::filesystem::path executable;
  std::filesystem::path config;
  std::vector<std::string> overrides;  ///< "key.path=value"
  double timeout_s{120};               ///< of the greeting and of every answer
  /// Bytes added to the environment, which moves the stack: layouts that happen to be fast or slow
  /// average out over blocks. Source: Mytkowicz et al. 2009.
  int padding{0};
};

/// A running `penumbra measure`. Killed when the object goes.
class WorkerProcess {
 public:
  /// Starts it and waits for its greeting.
  /// @throws InputError when the program refuses the config, ReferenceError when it is of a version
  ///         that a gate cannot talk to, WorkerFailure for anything else
  explicit WorkerProcess(const WorkerOptions& options);
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  const WorkerGreeting& greeting() const { return greeting_; }

  /// @throws WorkerFailure
  WorkerReply measure(const WorkerRequest& request);

 private:
  class Pipes;

  std::unique_ptr<Pipes> pipes_;
  WorkerGreeting greeting_;
};

}  // namespace penumbra
