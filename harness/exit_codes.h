#pragma once

namespace penumbra {

/// Exit codes of the program (README.md has the table).
enum ExitCode : int {
  kSuccess = 0,
  kRegression = 1,
  kInputFault = 2,
  kInconclusive = 3,
  kRunFailure = 4,
  kReferenceFault = 5,
  kCorrectness = 6,
  kInterrupted = 130,
};

}  // namespace penumbra
