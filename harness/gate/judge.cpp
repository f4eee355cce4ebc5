#include "harness/gate/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "harness/gate/effect.h"
#include "harness/statistics.h"

namespace penumbra {
namespace {

// One cell while it is judged.
struct Case {
  const GateCellRuns* runs{nullptr};
  std::vector<RunPair> pairs;
  GateCell cell;
  double p_work{1}, p_time{1};  // adjusted by Holm
};

double mean_count(std::span<const RunPair> pairs, const GateRun* RunPair::*side,
                  std::uint64_t GateRun::*counter) {
  Welford values;
  for (const RunPair& pair : pairs) {
    values.add(static_cast<double>((pair.*side)->*counter));
  }
  return values.mean();
}

std::vector<CounterChange> changed_counters(std::span<const RunPair> pairs) {
  struct Counter {
    const char* name;
    std::uint64_t GateRun::*member;
  };
  static constexpr Counter kCounters[] = {{"estimates", &GateRun::estimates},
                                          {"samples", &GateRun::samples},
                                          {"rays", &GateRun::rays},
                                          {"lit", &GateRun::lit},
                                          {"iterations", &GateRun::iterations}};
  std::vector<CounterChange> changes;
  for (const Counter& counter : kCounters) {
    const bool same = std::all_of(pairs.begin(), pairs.end(), [&](const RunPair& pair) {
      return pair.base->*counter.member == pair.head->*counter.member;
    });
    if (same) continue;
    changes.push_back({counter.name, mean_count(pairs, &RunPair::base, counter.member),
                       mean_count(pairs, &RunPair::head, counter.member)});
  }
  return changes;
}

bool same_in_all(std::span<const RunPair> pairs, std::string GateRun::*hash) {
  return std::all_of(pairs.begin(), pairs.end(), [&](const RunPair& pair) {
    return !(pair.base->*hash).empty() && pair.base->*hash == pair.head->*hash;
  });
}

std::optional<double> error_ratio(std::span<const RunPair> pairs) {
  double base = 0, head = 0;
  for (const RunPair& pair : pairs) {
    if (!pair.base->error || !pair.head->error) return std::nullopt;
    base += *pair.base->error;
    head += *pair.head->error;
  }
  if (!(base > 0 && head > 0)) return std::nullopt;
  return head / base;
}

std::optional<double> time_ratio(std::span<const RunPair> pairs) {
  std::vector<double> logs;
  for (const RunPair& pair : pairs) {
    if (!pair.base->time_cpu_s || !pair.head->time_cpu_s) return std::nullopt;
    logs.push_back(std::log(*pair.head->time_cpu_s / *pair.base->time_cpu_s));
  }
  if (logs.empty()) return std::nullopt;
  return std::exp(hodges_lehmann(logs));
}

std::optional<double> median_pixels(std::span<const RunPair> pairs) {
  std::vector<double> values;
  for (const RunPair& pair : pairs) {
    if (pair.base->p_eff) values.push_back(*pair.base->p_eff);
  }
  if (values.empty()) return std::nullopt;
  return median(std::move(values));
}

// A rise of work or time by a share r is a loss of efficiency of 1 - 1/(1 + r).
double loss_of_rise(double rise) { return rise / (1 + rise); }

Case measure(const GateCellRuns& runs, const JudgeOptions& options) {
  Case result;
  result.runs = &runs;
  result.pairs = paired_runs(runs.base, runs.head);
  GateCell& cell = result.cell;
  cell.name = runs.name;
  cell.blocks = static_cast<int>(result.pairs.size());
  for (const GateRun& run : runs.head) {
    if (run.failure.empty()) continue;
    cell.verdict = GateVerdict::Fail;
    cell.reason = GateReason::Failed;
    cell.sentence = fmt::format("block {}: {}", run.block, run.failure);
    return result;
  }
  if (result.pairs.empty()) {
    const auto failed = std::find_if(runs.base.begin(), runs.base.end(),
                                     [](const GateRun& run) { return !run.failure.empty(); });
    cell.no_efficiency =
        failed == runs.base.end() ? "no common blocks" : "the base failed: " + failed->failure;
    return result;
  }
  cell.same_images = same_in_all(result.pairs, &GateRun::image_hash);
  cell.same_half_images = cell.same_images || same_in_all(result.pairs, &GateRun::half_hash);
  cell.counters = changed_counters(result.pairs);
  cell.currency = currency_of(result.pairs);
  cell.error_ratio = cell.same_images ? 1.0 : error_ratio(result.pairs);
  cell.instructions_ratio = cost_ratio(result.pairs, GateCurrency::Instructions);
  cell.rays_ratio = cost_ratio(result.pairs, GateCurrency::Rays);
  if (options.interleaved) cell.cpu_ratio = time_ratio(result.pairs);
  cell.p_eff = median_pixels(result.pairs);

  const GateThresholds& limits = runs.thresholds;
  const bool same = cell.same_images;
  const EffectOptions work{options.level, same ? loss_of_rise(limits.instructions) : limits.noise};
  cell.efficiency = efficiency_effect(result.pairs, cell.currency, !same, work, cell.no_efficiency);
  if (cell.efficiency) {
    cell.detectable = detectable_effect(cell.efficiency->standard_error, cell.blocks);
  }
  if (options.interleaved) {
    std::string ignored;
    cell.efficiency_cpu =
        same ? time_effect(result.pairs, {options.level, loss_of_rise(limits.cpu_time)})
             : efficiency_effect(result.pairs, GateCurrency::CpuTime, true,
                                 {options.level, limits.noise}, ignored);
  }
  return result;
}

// Holm over cells and currencies.
void adjust(std::vector<Case>& cases) {
  std::vector<double> p;
  for (const Case& c : cases) {
    if (c.cell.efficiency) p.push_back(c.cell.efficiency->p_loss);
    if (c.cell.efficiency_cpu) p.push_back(c.cell.efficiency_cpu->p_loss);
  }
  const std::vector<double> adjusted = holm_adjusted(p);
  std::size_t next = 0;
  for (Case& c : cases) {
    if (c.cell.efficiency) c.p_work = adjusted[next++];
    if (c.cell.efficiency_cpu) c.p_time = adjusted[next++];
  }
}

// p of a loss of time that is looked at again.
constexpr double kSuspicious = 0.05;

constexpr const char* kTimesDiffer = "; the base differs from itself in time as well here";

// Counts of instructions repeat to about a millionth.
constexpr double kSameWork = 1e-4;

// What the loss is made of: the largest of its factors.
GateReason reason_of_loss(const GateCell& cell) {
  const double error = std::log(cell.error_ratio.value_or(1.0));
  const double rays = std::log(cell.rays_ratio.value_or(1.0));
  const double cost = cell.instructions_ratio.value_or(std::exp(rays));
  const double per_ray = std::log(cost) - rays;
  if (per_ray > error && per_ray > rays) return GateReason::Slower;
  return error >= rays ? GateReason::Noisier : GateReason::MoreRays;
}

std::string percent(const GateEffect& effect) {
  if (effect.standard_error == 0) return change_text(std::exp(effect.log_ratio));
  return fmt::format("{} [{}, {}]", change_text(std::exp(effect.log_ratio)),
                     change_text(std::exp(effect.interval.lo)),
                     change_text(std::exp(effect.interval.hi)));
}

std::string sentence_of(const GateCell& cell) {
  std::string text = cell.same_images        ? "same images"
                     : cell.same_half_images ? "images equal to half precision"
                                             : "images changed";
  if (!cell.same_images && cell.error_ratio) {
    text += fmt::format(", error {}", change_text(*cell.error_ratio));
  }
  if (cell.rays_ratio) text += fmt::format(", rays {}", change_text(*cell.rays_ratio));
  if (cell.instructions_ratio) {
    text += fmt::format(", instructions {}", change_text(*cell.instructions_ratio));
  }
  if (cell.cpu_ratio) text += fmt::format(", CPU time {}", change_text(*cell.cpu_ratio));
  if (cell.efficiency) {
    text +=
        fmt::format("; efficiency in {} {}", to_string(cell.currency), percent(*cell.efficiency));
  } else {
    text += "; no efficiency: " + cell.no_efficiency;
  }
  return text;
}

void decide(Case& c, const JudgeOptions& options) {
  GateCell& cell = c.cell;
  if (cell.reason == GateReason::Failed) return;
  cell.sentence = sentence_of(cell);
  if (!cell.efficiency) return;
  const GateThresholds& limits = c.runs->thresholds;
  const GateEffect& work = *cell.efficiency;
  const double least = cell.same_images ? 0.0 : std::log1p(-limits.fail);
  const bool loses_work = c.p_work < options.level && work.log_ratio < least;
  const bool loses_time =
      cell.efficiency_cpu && c.p_time < options.level && cell.efficiency_cpu->log_ratio < least;
  if (loses_work || loses_time) {
    cell.verdict = GateVerdict::Fail;
    cell.reason = loses_work ? reason_of_loss(cell) : GateReason::Slower;
    cell.lost_time_only = !loses_work;
    return;
  }
  if (!(work.lower > std::log1p(-limits.pass))) return;
  cell.verdict = GateVerdict::Pass;
  const bool unchanged =
      cell.same_images && cell.counters.empty() && std::abs(work.log_ratio) < kSameWork;
  cell.reason = unchanged                                         ? GateReason::Unchanged
                : work.lower > std::log1p(limits.noise)           ? GateReason::Improved
                : !c.runs->accepted.empty() && work.log_ratio < 0 ? GateReason::Acknowledged
                                                                  : GateReason::WithinLimits;
  if (cell.reason == GateReason::Acknowledged) {
    cell.sentence += "; accepted: " + c.runs->accepted;
  }
}

// Cells with the blocks that all of them have; accepted losses are left out.
// @param currency  of all of them, in place of each one's own
std::vector<SuiteMember> members_of(const std::vector<Case>& cases, bool same_images_only,
                                    std::optional<GateCurrency> currency = {}) {
  std::map<int, std::size_t> cells_with_block;
  std::vector<const Case*> chosen;
  for (const Case& c : cases) {
    if (!c.cell.efficiency || !c.runs->accepted.empty()) continue;
    if (same_images_only && !(c.cell.same_images && c.cell.instructions_ratio)) continue;
    chosen.push_back(&c);
    for (const RunPair& pair : c.pairs) ++cells_with_block[pair.base->block];
  }
  std::vector<SuiteMember> members;
  for (const Case* c : chosen) {
    SuiteMember& member = members.emplace_back();
    member.currency = currency.value_or(c->cell.currency);
    member.with_error = !c->cell.same_images;
    for (const RunPair& pair : c->pairs) {
      if (cells_with_block[pair.base->block] == chosen.size()) member.pairs.push_back(pair);
    }
  }
  return members;
}

GateSuite judge_suite(const std::vector<Case>& cases, const JudgeOptions& options) {
  GateSuite suite;
  const std::vector<SuiteMember> members = members_of(cases, false);
  suite.cells = static_cast<int>(members.size());
  suite.blocks = members.empty() ? 0 : static_cast<int>(members[0].pairs.size());
  if (!members.empty()) suite.currency = members[0].currency;
  const GateThresholds& limits = options.suite;
  suite.efficiency = suite_effect(members, {options.level, limits.noise});
  if (options.interleaved) {
    const std::vector<SuiteMember> in_time = members_of(cases, false, GateCurrency::CpuTime);
    const bool equal_errors = std::none_of(in_time.begin(), in_time.end(),
                                           [](const SuiteMember& m) { return m.with_error; });
    const EffectOptions of_time{options.level, limits.noise};
    std::vector<std::vector<RunPair>> pairs;
    for (const SuiteMember& member : in_time) pairs.push_back(member.pairs);
    suite.efficiency_cpu =
        equal_errors ? suite_time_effect(pairs, of_time) : suite_effect(in_time, of_time);
  }
  const std::vector<SuiteMember> same = members_of(cases, true);
  const auto instructions =
      suite_effect(same, {options.level, loss_of_rise(options.suite_instructions)});
  if (instructions) suite.instructions_ratio = std::exp(-instructions->log_ratio);
  const bool all_accepted =
      !cases.empty() && std::all_of(cases.begin(), cases.end(),
                                    [](const Case& c) { return !c.runs->accepted.empty(); });
  if (all_accepted) {
    suite.verdict = GateVerdict::Pass;
    suite.reason = GateReason::Acknowledged;
    suite.sentence = "losses of all cells are accepted";
    return suite;
  }
  if (!suite.efficiency) {
    suite.sentence = "the cells have no efficiencies to put together";
    return suite;
  }
  const GateEffect& work = *suite.efficiency;
  suite.sentence = fmt::format("efficiency of {} cells in {} {}", suite.cells,
                               to_string(suite.currency), percent(work));
  if (suite.efficiency_cpu) {
    suite.sentence += fmt::format(", in CPU time {}", percent(*suite.efficiency_cpu));
  }
  if (suite.instructions_ratio) {
    suite.sentence += fmt::format("; instructions of the {} with same images {}", same.size(),
                                  change_text(*suite.instructions_ratio));
  }
  const auto certain = [&](const GateEffect& effect) { return effect.p_loss < options.level; };
  const double least = std::log1p(-limits.fail);
  const bool loses = certain(work) && work.log_ratio < least;
  const bool slower = instructions && certain(*instructions);
  // A loss of time in all cells that more blocks can make certain; noise alone is no sign of one.
  const bool seems_slow = suite.efficiency_cpu && suite.efficiency_cpu->log_ratio < least &&
                          suite.efficiency_cpu->p_loss < kSuspicious;
  const bool takes_longer = seems_slow && certain(*suite.efficiency_cpu);
  // Rays say nothing of the work between them: where instructions are not counted, only time can.
  const bool may_be_slow = suite.efficiency_cpu && suite.currency != GateCurrency::Instructions &&
                           !(suite.efficiency_cpu->lower > std::log1p(-limits.pass));
  if (loses || slower || takes_longer) {
    suite.verdict = GateVerdict::Fail;
    GateCell together;  // of the geometric means
    Welford error, rays, cost;
    for (const Case& c : cases) {
      if (!c.cell.efficiency || !c.runs->accepted.empty()) continue;
      error.add(std::log(c.cell.error_ratio.value_or(1.0)));
      rays.add(std::log(c.cell.rays_ratio.value_or(1.0)));
      cost.add(std::log(c.cell.instructions_ratio.value_or(c.cell.rays_ratio.value_or(1.0))));
    }
    together.error_ratio = std::exp(error.mean());
    together.rays_ratio = std::exp(rays.mean());
    together.instructions_ratio = std::exp(cost.mean());
    suite.reason = loses ? reason_of_loss(together) : GateReason::Slower;
    suite.lost_time_only = !loses && !slower;
  } else if (may_be_slow) {
    suite.sentence += fmt::format(
        "; without counted instructions only CPU time can exclude a loss of {:g} %, and does not",
        100 * limits.pass);
  } else if (!seems_slow && work.lower > std::log1p(-limits.pass)) {
    suite.verdict = GateVerdict::Pass;
    suite.reason =
        work.lower > std::log1p(limits.noise) ? GateReason::Improved : GateReason::WithinLimits;
  }
  return suite;
}

}  // namespace

std::string change_text(double ratio) {
  const double change = 100.0 * (ratio - 1.0);
  if (change == 0.0) return "±0";
  if (std::abs(change) < 0.005) return "±0.00 %";
  if (std::abs(change) < 0.05) return fmt::format("{:+.2f} %", change);
  return fmt::format("{:+.1f} %", change);
}

Judgement judge(std::span<const GateCellRuns> cells, const JudgeOptions& options) {
  std::vector<Case> cases;
  for (const GateCellRuns& runs : cells) cases.push_back(measure(runs, options));
  adjust(cases);
  Judgement result;
  result.suite = judge_suite(cases, options);
  for (Case& c : cases) {
    decide(c, options);
    result.cells.push_back(std::move(c.cell));
  }
  return result;
}

NullControl judge_null(std::span<const GateRun> base, std::span<const GateRun> null, double level) {
  NullControl control;
  std::map<std::string, std::vector<RunPair>> of_cells;
  for (const RunPair& pair : paired_runs(base, null)) {
    of_cells[pair.base->cell].push_back(pair);
    ++control.pairs;
  }
  std::vector<std::vector<RunPair>> cells;
  for (auto& [name, pairs] : of_cells) cells.push_back(std::move(pairs));
  control.cpu_time = suite_time_effect(cells, {level / 2, 0.0});
  if (control.cpu_time) {
    control.rejected = control.cpu_time->lower > 0 || control.cpu_time->upper < 0;
  }
  return control;
}

void set_times_aside(Judgement& judgement) {
  const auto set_aside = [](auto& judged) {
    if (!judged.lost_time_only) return;
    judged.verdict = GateVerdict::Inconclusive;
    judged.reason = GateReason::TooNoisy;
    judged.lost_time_only = false;
    judged.sentence += kTimesDiffer;
  };
  set_aside(judgement.suite);
  for (GateCell& cell : judgement.cells) set_aside(cell);
}

bool undecided(const GateCell& cell) noexcept {
  return cell.verdict == GateVerdict::Inconclusive && cell.reason == GateReason::TooNoisy;
}

bool undecided(const GateSuite& suite) noexcept {
  return suite.verdict == GateVerdict::Inconclusive;
}

}  // namespace penumbra
