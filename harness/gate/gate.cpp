#include "harness/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "harness/gate/baseline.h"
#include "harness/gate/gate_session.h"
#include "harness/gate/worker.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

WorkerOptions worker_options(const fs::path& executable, const GateSubject& subject,
                             const GateOptions& options) {
  WorkerOptions worker;
  worker.executable = fs::absolute(executable);
  worker.config = fs::absolute(subject.config().file);
  worker.overrides = options.overrides;
  worker.timeout_s = subject.gate.timeout_s;
  return worker;
}

GateProvenance provenance_of(const fs::path& what, const WorkerGreeting& greeting) {
  return {what.string(), greeting.build, greeting.machine};
}

// Both programs have to measure the same cells against the same truth.
void check_sides(const WorkerGreeting& base, const WorkerGreeting& head, const GateSources& sources,
                 GateSession& session) {
  for (const auto& [scene, id] : head.references) {
    const auto found = base.references.find(scene);
    if (found == base.references.end() || found->second == id) continue;
    throw ReferenceError(fmt::format(
        "scene \"{}\" has another truth in {} ({}) than in {} ({}): scene, resolution or core "
        "changed, so their errors cannot be compared",
        scene, sources.base_exe.string(), found->second, sources.head_exe.string(), id));
  }
  const std::set<std::string> of_base(base.cells.begin(), base.cells.end());
  for (const std::string& name : session.subject().names) {
    if (of_base.count(name) == 0) session.leave_out(name, "the base does not have this cell");
  }
}

}  // namespace

GateResult gate_programs(const Experiment& experiment, const GateSources& sources,
                         const GateOptions& options) {
  refuse_budget(experiment.config());
  const GateSubject subject = gate_subject(experiment);
  std::map<GateSide, WorkerOptions> sides;
  sides[GateSide::Base] = worker_options(sources.base_exe, subject, options);
  sides[GateSide::Null] = sides[GateSide::Base];
  sides[GateSide::Head] = worker_options(sources.head_exe, subject, options);
  GateMeasurer measurer(subject, sides, options.rows);
  GateSession session(subject, options, &measurer);
  const WorkerGreeting base = measurer.greeting(GateSide::Base);
  const WorkerGreeting head = measurer.greeting(GateSide::Head);
  check_sides(base, head, sources, session);
  session.result().base = provenance_of(sources.base_exe, base);
  session.result().head = provenance_of(sources.head_exe, head);
  session.result().interleaved = true;
  session.compare({});
  return std::move(session.result());
}

GateResult gate_against_baseline(const Experiment& experiment, const GateSources& sources,
                                 const GateOptions& options) {
  refuse_budget(experiment.config());
  const GateSubject subject = gate_subject(experiment);
  const Baseline baseline = read_baseline(sources.baseline, subject);
  std::map<GateSide, WorkerOptions> sides;
  sides[GateSide::Head] = worker_options(sources.head_exe, subject, options);
  GateMeasurer measurer(subject, sides, options.rows);
  GateSession session(subject, options, &measurer);
  session.result().base = {sources.baseline.string(), baseline.build, baseline.machine};
  session.result().head = provenance_of(sources.head_exe, measurer.greeting(GateSide::Head));
  for (const std::string& name : baseline.missing) {
    session.leave_out(name, "the baseline does not have this cell");
  }
  session.compare(baseline.runs);
  return std::move(session.result());
}

GateResult update_baseline(const Experiment& experiment, const fs::path& executable,
                           const fs::path& folder, const std::string& reason,
                           const GateOptions& options) {
  refuse_budget(experiment.config());
  const GateSubject subject = gate_subject(experiment);
  std::map<GateSide, WorkerOptions> sides;
  sides[GateSide::Head] = worker_options(executable, subject, options);
  GateMeasurer measurer(subject, sides, options.rows);
  GateSession session(subject, options, &measurer);
  const WorkerGreeting head = measurer.greeting(GateSide::Head);
  session.result().base = {"", "{}", ""};
  session.result().head = provenance_of(executable, head);
  const std::vector<GateRun> runs = session.measure_baseline();
  if (session.result().verdict == GateVerdict::Pass) {
    write_baseline(folder, subject, runs, head, reason);
  }
  return std::move(session.result());
}

GateOverride parse_acknowledgement(const std::string& text, const GateThresholds& usual) {
  const std::size_t minus = text.find(" -");
  const std::size_t percent = text.find('%', minus == std::string::npos ? 0 : minus);
  const std::string form = "--ack \"" + text + "\": expected \"CELLS -4% reason\"";
  if (minus == 0 || minus == std::string::npos || percent == std::string::npos) {
    throw InputError(form);
  }
  double loss = 0;
  if (!parse_csv(std::string_view(text).substr(minus + 2, percent - minus - 2), loss) ||
      !(loss > 0 && loss < 95)) {
    throw InputError(form + ", with a loss above 0 and below 95 %");
  }
  GateOverride result;
  result.cells = text.substr(0, minus);
  const std::size_t begin = text.find_first_not_of(' ', percent + 1);
  if (begin == std::string::npos) throw InputError(form + ", with a reason");
  result.reason = text.substr(begin);
  const double accepted = loss / 100.0;
  const double rise = 1.0 / (1.0 - accepted) - 1.0;
  result.thresholds = {std::max(usual.noise, accepted), std::max(usual.fail, accepted),
                       1.0 - (1.0 - accepted) * (1.0 - usual.pass),
                       std::max(usual.instructions, rise), std::max(usual.cpu_time, rise)};
  return result;
}

}  // namespace penumbra
