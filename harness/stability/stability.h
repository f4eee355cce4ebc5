#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimators/estimator.h"
#include "harness/stability/method.h"
#include "harness/stability/stability_case.h"
#include "harness/stability/verdict.h"

/// `penumbra stability`: every registered estimator at every step of every case, judged by stated
/// rules. The whole matrix is one family of tests, so it is judged at its end.
namespace penumbra::stability {

struct StabilityOptions {
  std::vector<const StabilityCase*> cases;
  std::vector<const EstimatorEntry*> estimators;
  bool quick{false};  ///< a sixteenth of the estimates, and four steps of each sweep
  int threads{1};
};

/// Error and cost at one number of shadow rays per light.
struct ErrorLevel {
  int srl{0};
  std::uint64_t estimates{0};
  double rel_mse{0};
  double rel_mse_se{0};
  double cpu_s{0};  ///< of one estimate
};

/// One estimator at one step of a sweep: a line of stability.csv.
struct StabilityRow {
  std::string case_name, ids, parameter;
  int step{0};  ///< from 0, the harmless end
  double value{0};
  std::string method, estimator, params;
  std::string declared_bias;  ///< the estimator's reason, empty where it claims to be unbiased
  int srl{0}, srl_initial{0}, srl_adaptive{0};
  int lights{0};    ///< with a density
  double exact{0};  ///< mean over the step's points [W/(m^2 sr)]
  std::uint64_t estimates{0}, samples{0}, rays{0}, zeros{0};
  std::uint64_t non_finite{0}, negative{0}, uncovered{0};
  std::optional<double> bias, bias_lo, bias_hi;  ///< relative, 95 %; empty at dark steps
  std::optional<double> p, p_adjusted;           ///< of the bias test, the latter by Holm
  std::optional<double> confirmed_bias, confirmed_p;
  double tolerance{0};
  std::optional<double> rel_variance;
  double largest_over_mean{0};  ///< largest estimate over the mean of all; 0 where all are 0
  std::optional<double> kurtosis;
  std::optional<double> slope, slope_lo, slope_hi;  ///< of log MSE against log samples
  double cpu_s{0};                                  ///< of one estimate
  std::optional<double> cost;                       ///< relative MSE x CPU time of one estimate [s]
  std::vector<ErrorLevel> levels;
  Verdict verdict{Verdict::Ok};
  std::string reason;
  std::string replay;  ///< of the first bad estimate: seed, rays, pixel, estimate, value
};

struct StabilityResult {
  std::vector<StabilityRow> rows;  ///< by case, step, method
  std::vector<std::string> cases, methods;
  std::vector<std::string> left_out;  ///< cells that have no meaning, one clause each
  bool quick{false};
  double wall_s{0};
  double build_s{0};  ///< making scenes and answers, of wall_s
};

/// Cells whose parameters an estimator refuses are left out, with its message.
StabilityResult run_stability(const StabilityOptions& options);

/// Whether nothing is non-finite or negative, and no estimator that claims to be unbiased is worse
/// than noisy.
bool passed(const StabilityResult& result);

/// The matrix for a terminal with rules and notes; with one case, all its steps and statistics.
std::string to_terminal(const StabilityResult& result);
std::string detail_to_terminal(const StabilityResult& result);

/// The whole of stability.csv and stability.json.
std::string to_csv(const StabilityResult& result);
std::string to_json(const StabilityResult& result);

/// The matrix as a picture: a row per case, a column per estimator, a block per step.
void write_matrix_picture(const std::filesystem::path& file, const StabilityResult& result);

}  // namespace penumbra::stability
