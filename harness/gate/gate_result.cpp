#include "harness/gate/gate_result.h"

namespace penumbra {

std::string_view to_string(GateVerdict verdict) noexcept {
  switch (verdict) {
    case GateVerdict::Pass:
      return "PASS";
    case GateVerdict::Fail:
      return "FAIL";
    case GateVerdict::Inconclusive:
      return "INCONCLUSIVE";
  }
  return "";
}

std::string_view to_string(GateReason reason) noexcept {
  switch (reason) {
    case GateReason::Unchanged:
      return "unchanged";
    case GateReason::WithinLimits:
      return "within_limits";
    case GateReason::Improved:
      return "improved";
    case GateReason::Acknowledged:
      return "acknowledged";
    case GateReason::Noisier:
      return "noisier";
    case GateReason::MoreRays:
      return "more_rays";
    case GateReason::Slower:
      return "slower";
    case GateReason::Biased:
      return "biased";
    case GateReason::NonDeterministic:
      return "non_deterministic";
    case GateReason::Failed:
      return "failed";
    case GateReason::TooNoisy:
      return "too_noisy";
    case GateReason::NotRepeated:
      return "not_repeated";
  }
  return "";
}

std::string_view to_string(GateCurrency currency) noexcept {
  switch (currency) {
    case GateCurrency::Instructions:
      return "instructions";
    case GateCurrency::CpuTime:
      return "cpu_time";
    case GateCurrency::Rays:
      return "rays";
  }
  return "";
}

}  // namespace penumbra
