#include "harness/gate/gate_session.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/gate/gate_bias.h"
#include "harness/gate/gate_cells.h"
#include "harness/replicates.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

// A rejected bias is tested again on this many times the pictures, at a tenth of the level.
constexpr int kBiasBlocksFactor = 4;
constexpr double kBiasLevelFactor = 0.1;

std::string counts_of(const GateRun& run) {
  return fmt::format("{} {} {} {} {}", run.estimates, run.samples, run.rays, run.lit,
                     run.iterations);
}

}  // namespace

GateSession::GateSession(const GateSubject& subject, const GateOptions& options,
                         GateMeasurer* measurer)
    : subject_(subject), options_(options), measurer_(measurer) {
  for (std::size_t c = 0; c < subject.names.size(); ++c) {
    cells_.push_back(c);
    result_.cells.emplace_back().name = subject.names[c];
  }
  result_.config_name = subject.config().name;
  result_.config_file = subject.config().file.string();
  result_.metric = subject.gate.metric;
  result_.confidence = subject.gate.confidence;
  result_.looks = subject.gate.looks;
}

void GateSession::leave_out(const std::string& name, const std::string& reason) {
  std::erase_if(cells_, [&](std::size_t c) { return subject_.names[c] == name; });
  std::erase_if(result_.cells, [&](const GateCell& cell) { return cell.name == name; });
  result_.notes.push_back(name + ": " + reason);
}

GateCell& GateSession::cell(std::size_t index) {
  const auto found =
      std::find_if(result_.cells.begin(), result_.cells.end(),
                   [&](const GateCell& c) { return c.name == subject_.names[index]; });
  PN_CHECK(found != result_.cells.end(), "the cell takes part");
  return *found;
}

double GateSession::level() const {
  return (1.0 - subject_.gate.confidence) / static_cast<double>(subject_.gate.looks.size());
}

// Of base only what is not stored.
std::vector<GateWork> GateSession::work_of(std::span<const std::size_t> cells) const {
  if (stored()) return head_of(cells);
  std::vector<GateWork> work;
  for (const std::size_t c : cells) work.push_back({c, {GateSide::Base, GateSide::Head}});
  return work;
}

std::vector<GateWork> GateSession::head_of(std::span<const std::size_t> cells) const {
  std::vector<GateWork> work;
  for (const std::size_t c : cells) work.push_back({c, {GateSide::Head}});
  return work;
}

// The base again on the first scene.
std::vector<GateWork> GateSession::with_null_control(std::vector<GateWork> work) const {
  if (stored() || !options_.times) return work;
  const auto& cells = subject_.experiment->cells();
  for (GateWork& item : work) {
    if (cells[item.cell].scene == cells[cells_.front()].scene) {
      item.sides.push_back(GateSide::Null);
    }
  }
  return work;
}

GateCellRuns GateSession::cell_runs(std::size_t index, GatePhase phase) const {
  GateCellRuns runs;
  runs.name = subject_.names[index];
  set_thresholds(subject_.gate, options_.accepted, runs);
  runs.head = measurer_->runs(phase, GateSide::Head, runs.name);
  if (!stored()) {
    runs.base = measurer_->runs(phase, GateSide::Base, runs.name);
    return runs;
  }
  for (GateRun run : stored_) {
    if (run.cell != runs.name) continue;
    // Head's fresh seeds meet the stored runs, which are independent of them.
    if (phase == GatePhase::Confirm) run.block += kConfirmBlocks;
    runs.base.push_back(std::move(run));
  }
  return runs;
}

// A confirmation is one look.
Judgement GateSession::judge_cells(std::span<const std::size_t> cells, GatePhase phase) const {
  std::vector<GateCellRuns> runs;
  for (const std::size_t c : cells) runs.push_back(cell_runs(c, phase));
  JudgeOptions options;
  options.level = phase == GatePhase::Confirm ? 1.0 - subject_.gate.confidence : level();
  options.interleaved = !stored() && options_.times;
  options.suite = subject_.gate.thresholds;
  options.suite_instructions = subject_.gate.suite_instructions;
  return judge(runs, options);
}

// G0 and G1 of head alone.
bool GateSession::check_head() {
  measurer_->check_head(cells_);
  bool sound = true;
  for (const std::size_t c : cells_) {
    GateCell& found = cell(c);
    std::vector<GateRun> runs = measurer_->runs(GatePhase::Smoke, GateSide::Head, found.name);
    const std::vector<GateRun> repeats =
        measurer_->runs(GatePhase::Repeat, GateSide::Head, found.name);
    for (const GateRun& run : measurer_->runs(GatePhase::Measure, GateSide::Head, found.name)) {
      if (run.block == 0) runs.push_back(run);
    }
    runs.insert(runs.end(), repeats.begin(), repeats.end());
    for (const GateRun& run : runs) {
      const bool failed = !run.failure.empty();
      const bool differs =
          run.phase != GatePhase::Smoke &&
          (run.image_hash != repeats[0].image_hash || counts_of(run) != counts_of(repeats[0]));
      if (!failed && !differs) continue;
      found.verdict = GateVerdict::Fail;
      found.reason = failed ? GateReason::Failed : GateReason::NonDeterministic;
      found.sentence = failed ? run.failure
                              : fmt::format("the same seed gave other bits on {} {}", run.threads,
                                            run.threads == 1 ? "thread" : "threads");
      sound = false;
      break;
    }
  }
  return sound;
}

// G2 and G3. Cells that are decided need no more blocks, unless all together are not. A failure
// ends the looks: it is to be confirmed.
void GateSession::look_until_decided() {
  std::vector<std::size_t> open = cells_;
  Judgement judgement;
  int before = 0;
  for (const int blocks : subject_.gate.looks) {
    const std::vector<GateWork> work = work_of(open);
    measurer_->measure(GatePhase::Measure, before == 0 ? with_null_control(work) : work, before,
                       blocks);
    judgement = judge_cells(cells_, GatePhase::Measure);
    result_.blocks = blocks;
    before = blocks;
    const auto lost = [](const auto& found) { return found.verdict == GateVerdict::Fail; };
    if (lost(judgement.suite) ||
        std::any_of(judgement.cells.begin(), judgement.cells.end(), lost)) {
      break;
    }
    if (!undecided(judgement.suite)) {
      std::erase_if(open, [&](std::size_t c) {
        return std::none_of(judgement.cells.begin(), judgement.cells.end(),
                            [&](const GateCell& found) {
                              return found.name == subject_.names[c] && undecided(found);
                            });
      });
    } else {
      open = cells_;
    }
    if (open.empty()) break;
  }
  control_times();
  if (result_.null_control && result_.null_control->rejected) set_times_aside(judgement);
  result_.cells = std::move(judgement.cells);
  result_.suite = std::move(judgement.suite);
}

// NC.
void GateSession::control_times() {
  std::vector<GateRun> base, null;
  for (const std::size_t c : cells_) {
    for (GateRun& run : measurer_->runs(GatePhase::Measure, GateSide::Base, subject_.names[c])) {
      base.push_back(std::move(run));
    }
    for (GateRun& run : measurer_->runs(GatePhase::Measure, GateSide::Null, subject_.names[c])) {
      null.push_back(std::move(run));
    }
  }
  if (null.empty()) return;
  result_.null_control = judge_null(base, null, 1.0 - subject_.gate.confidence);
}

// G4: where the images are those of base, so is the bias.
void GateSession::test_bias() {
  std::vector<std::size_t> changed;
  for (const std::size_t c : cells_) {
    GateCell& found = cell(c);
    if (found.same_images || found.reason == GateReason::Failed) {
      found.bias.skipped = "same images as base";
      continue;
    }
    changed.push_back(c);
  }
  if (changed.empty()) return;
  measurer_->measure(GatePhase::Measure, head_of(changed), 0, kReplicatesForTiles);
  for (const std::size_t c : changed) {
    const Cell& of_config = subject_.experiment->cells()[c];
    cell(c).bias = test_gate_bias(
        measurer_->runs(GatePhase::Measure, GateSide::Head, subject_.names[c]),
        subject_.reference_of(c), of_config.estimator->bias_reason(of_config.params));
  }
  adjust_bias(result_.cells);
  confirm_bias();
}

// The worst cell decides: more pictures, fresh seeds, a stricter level.
void GateSession::confirm_bias() {
  const double level = subject_.gate.bias_level;
  std::optional<std::size_t> worst;
  for (const std::size_t c : cells_) {
    const GateBias& bias = cell(c).bias;
    if (!bias.skipped.empty() || bias.adjusted_p > level) continue;
    if (!worst || bias.p < cell(*worst).bias.p) worst = c;
  }
  if (!worst) return;
  const std::size_t chosen[] = {*worst};
  measurer_->measure(GatePhase::Confirm, head_of(chosen), kConfirmBlocks,
                     kConfirmBlocks + kBiasBlocksFactor * kReplicatesForTiles);
  GateCell& found = cell(*worst);
  const GateBias again =
      test_gate_bias(measurer_->runs(GatePhase::Confirm, GateSide::Head, found.name),
                     subject_.reference_of(*worst), {});
  found.confirmed = again.p <= kBiasLevelFactor * level;
  const std::string of_mean = again.relative
                                  ? fmt::format("mean of the image {} of the reference's",
                                                change_text(1.0 + *again.relative))
                                  : "the reference is black";
  if (!found.confirmed) {
    result_.notes.push_back(
        fmt::format("{}: a bias (p {:.2g} in {} pictures) did not show again (p {:.2g} in {})",
                    found.name, found.bias.p, found.bias.blocks, again.p, again.blocks));
    return;
  }
  found.verdict = GateVerdict::Fail;
  found.reason = GateReason::Biased;
  found.bias = again;
  found.bias.adjusted_p = again.p;
  found.sentence = fmt::format("{}, p {:.2g} in {} pictures with fresh seeds; {}", of_mean, again.p,
                               again.blocks, found.sentence);
}

// What failed has to fail again.
void GateSession::confirm_losses() {
  const auto lost = [](GateVerdict verdict, GateReason reason) {
    return verdict == GateVerdict::Fail && reason != GateReason::Biased &&
           reason != GateReason::Failed && reason != GateReason::NonDeterministic;
  };
  // Other work for the same images is exact; fresh seeds have no stored images to compare with.
  const auto is_exact = [&](std::size_t c) { return stored() && cell(c).same_images; };
  bool suite_lost = lost(result_.suite.verdict, result_.suite.reason);
  if (suite_lost && std::all_of(cells_.begin(), cells_.end(), is_exact)) {
    result_.suite.confirmed = true;
    suite_lost = false;
  }
  std::vector<std::size_t> again;
  for (const std::size_t c : cells_) {
    const bool cell_lost = lost(cell(c).verdict, cell(c).reason);
    if (cell_lost && is_exact(c)) {
      cell(c).confirmed = true;
    } else if (suite_lost || cell_lost) {
      again.push_back(c);
    }
  }
  if (again.empty()) return;
  int blocks = 2;
  for (const std::size_t c : again) blocks = std::max(blocks, cell(c).blocks);
  if (stored()) {
    // No more than the stored runs can be met.
    for (const std::size_t c : again) {
      const auto runs = cell_runs(c, GatePhase::Confirm);
      blocks = std::min(blocks, static_cast<int>(runs.base.size()));
    }
  }
  measurer_->measure(GatePhase::Confirm, work_of(again), kConfirmBlocks, kConfirmBlocks + blocks);
  Judgement judgement = judge_cells(again, GatePhase::Confirm);
  if (result_.null_control && result_.null_control->rejected) set_times_aside(judgement);
  const auto settle = [&](auto& found, const auto& repeated) {
    if (!lost(found.verdict, found.reason)) return;
    found.confirmed = lost(repeated.verdict, repeated.reason);
    if (found.confirmed) return;
    found.verdict = GateVerdict::Inconclusive;
    found.reason = GateReason::NotRepeated;
    found.sentence += "; with fresh seeds: " + repeated.sentence;
  };
  for (std::size_t i = 0; i < again.size(); ++i) settle(cell(again[i]), judgement.cells[i]);
  if (suite_lost) settle(result_.suite, judgement.suite);
}

void GateSession::finish() {
  result_.runs = measurer_->count();
  result_.wall_s = watch_.wall_s();
  conclude(result_);
}

void GateSession::compare(const std::vector<GateRun>& stored) {
  stored_ = stored;
  if (cells_.empty()) throw ReferenceError("base and head have no cell in common");
  if (check_head()) {
    look_until_decided();
    // The measured run of block 0 takes part in the comparison of repeats.
    if (check_head()) {
      test_bias();
      confirm_losses();
    }
  } else {
    result_.notes.emplace_back("head is not sound, so nothing was compared");
  }
  finish();
}

std::vector<GateRun> GateSession::measure_baseline() {
  std::vector<GateRun> runs;
  const int blocks = std::max(kReplicatesForTiles, subject_.gate.looks.front());
  if (check_head()) {
    measurer_->measure(GatePhase::Measure, head_of(cells_), 0, blocks);
    if (check_head()) {
      for (const std::size_t c : cells_) {
        for (GateRun& run :
             measurer_->runs(GatePhase::Measure, GateSide::Head, subject_.names[c])) {
          runs.push_back(std::move(run));
        }
        cell(c).verdict = GateVerdict::Pass;
        cell(c).reason = GateReason::WithinLimits;
        cell(c).blocks = blocks;
        cell(c).sentence = "sound";
      }
      result_.suite.verdict = GateVerdict::Pass;
      result_.suite.reason = GateReason::WithinLimits;
      test_bias();
    }
  }
  result_.blocks = blocks;
  finish();
  return runs;
}

}  // namespace penumbra
