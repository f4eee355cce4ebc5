// stability: every estimator on stiff and extreme cases with known answers.

#include "harness/stability/stability.h"

#include <fmt/format.h>

#include <filesystem>

#include "estimators/estimator.h"
#include "harness/atomic_file.h"
#include "harness/commands/commands.h"
#include "harness/progress.h"
#include "harness/render.h"
#include "scenes/core/error.h"
#include "scenes/core/suggest.h"

namespace penumbra {
namespace {

std::vector<const EstimatorEntry*> wanted_estimators(const std::string& name) {
  std::vector<const EstimatorEntry*> wanted;
  std::vector<std::string> names;
  for (const EstimatorEntry* entry : all_estimators()) {
    names.emplace_back(entry->name);
    if (name.empty() || entry->name == name) wanted.push_back(entry);
  }
  if (wanted.empty()) throw InputError("--estimator: " + unknown_name("estimator", name, names));
  return wanted;
}

std::vector<const stability::StabilityCase*> wanted_cases(const std::string& name) {
  std::vector<const stability::StabilityCase*> wanted;
  for (const stability::StabilityCase& c : stability::stability_cases()) {
    if (name.empty() || c.name == name) wanted.push_back(&c);
  }
  if (wanted.empty()) {
    throw InputError("--case: " + unknown_name("case", name, stability::stability_case_names()));
  }
  return wanted;
}

void write_files(const std::filesystem::path& folder, const stability::StabilityResult& result) {
  write_file_atomically(folder / "stability.csv", stability::to_csv(result));
  write_file_atomically(folder / "stability.json", stability::to_json(result));
  stability::write_matrix_picture(folder / "stability.png", result);
  note(fmt::format("wrote {}: stability.csv, stability.json, stability.png", folder.string()));
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw RunError(fmt::format("{}: {}", folder.string(), error.message()));
}

}  // namespace

int stability_command(const StabilityCommandOptions& options) {
  stability::StabilityOptions run;
  run.estimators = wanted_estimators(options.estimator);
  run.cases = wanted_cases(options.case_name);
  run.quick = options.quick;
  run.threads = resolve_threads(options.threads);
  // Before minutes of work that a folder that cannot be made would waste.
  if (!options.out.empty()) make_folder(options.out);
  const stability::StabilityResult result = stability::run_stability(run);
  if (!options.out.empty()) write_files(options.out, result);
  if (options.json) {
    fmt::print("{}", stability::to_json(result));
  } else if (!options.case_name.empty()) {
    fmt::print("{}", stability::detail_to_terminal(result));
  } else {
    fmt::print("{}", stability::to_terminal(result));
  }
  return stability::passed(result) ? kSuccess : kCorrectness;
}

}  // namespace penumbra
