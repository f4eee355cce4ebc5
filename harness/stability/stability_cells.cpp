#include "harness/stability/stability_cells.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "scenes/core/error.h"

namespace penumbra::stability {
namespace {

constexpr std::uint64_t kEstimates = 16384;
constexpr std::uint64_t kQuickShare = 16;
constexpr int kQuickSteps = 4;
/// Estimates of many samples are fewer.
constexpr std::uint64_t kMostSamples = std::uint64_t{1} << 18;
constexpr std::uint64_t kLeastEstimates = 256;
/// Shadow rays per light for the slope, as multiples of the case's own.
constexpr std::array<int, 2> kMoreRays{4, 16};
constexpr std::uint64_t kMostSamplesOfOne = std::uint64_t{1} << 14;
constexpr std::uint64_t kMostQuickSamplesOfOne = std::uint64_t{1} << 10;

std::string key_of(const Cell& cell, std::string_view purpose) {
  return fmt::format("{}/{}/{}/{}", cell.built->source->name, cell.built->index, cell.method->label,
                     purpose);
}

std::uint64_t lights_of(const StabilityStep& step) {
  return std::max<std::uint64_t>(1, step.scene->sampled_lights().size());
}

std::uint64_t estimates_of(const Cell& cell, int srl, bool quick) {
  const std::uint64_t most =
      kMostSamples / (lights_of(cell.built->step) * static_cast<std::uint64_t>(srl));
  const std::uint64_t estimates = std::min(kEstimates, most) / (quick ? kQuickShare : 1);
  return std::max(estimates, kLeastEstimates);
}

/// The steps of a sweep that are run, both ends among them.
std::vector<int> steps_of(const StabilityCase& c, bool quick) {
  const auto count = static_cast<int>(c.values.size());
  std::vector<int> steps;
  const int wanted = quick ? std::min(kQuickSteps, count) : count;
  for (int i = 0; i < wanted; ++i) steps.push_back(i * (count - 1) / std::max(1, wanted - 1));
  return steps;
}

ErrorLevel level_of(const Measurement& m, int srl) {
  const auto n = static_cast<double>(m.statistics.count());
  return {srl, m.statistics.count(), m.statistics.mean_square_error(),
          m.statistics.mean_square_error_se(), m.cpu_s / n};
}

void note_bad(Cell& cell, const Measurement& m, int srl) {
  if (!m.first_bad || !cell.replay.empty()) return;
  const BadSample& bad = *m.first_bad;
  cell.replay =
      fmt::format("seed {}, {} rays per light, pixel {}, estimate {}: ({}, {}, {})", bad.seed, srl,
                  bad.pixel, bad.estimate, bad.value.x, bad.value.y, bad.value.z);
}

void measure_levels(Cell& cell, bool quick) {
  const StabilityStep& step = cell.built->step;
  const EstimatorEntry& entry = *cell.method->entry;
  const int srl = srl_of(cell);
  cell.levels.push_back(level_of(cell.main, srl));
  for (const int factor : kMoreRays) {
    const int more = factor * srl;
    const std::uint64_t most = quick ? kMostQuickSamplesOfOne : kMostSamplesOfOne;
    if (lights_of(step) * static_cast<std::uint64_t>(more) > most) break;
    const std::uint64_t estimates = std::max<std::uint64_t>(
        estimates_of(cell, srl, quick) / static_cast<std::uint64_t>(factor), kTilePoints);
    const Measurement m = measure(step, *cell.method, split_budget(entry, more), estimates,
                                  key_of(cell, "srl " + std::to_string(more)));
    cell.other_non_finite += m.non_finite;
    cell.other_negative += m.negative;
    note_bad(cell, m, more);
    if (m.statistics.count() == 0) break;
    cell.levels.push_back(level_of(m, more));
  }
}

}  // namespace

std::vector<BuiltStep> build_steps(const std::vector<const StabilityCase*>& cases, bool quick) {
  std::vector<BuiltStep> steps;
  for (const StabilityCase* c : cases) {
    for (const int i : steps_of(*c, quick)) steps.push_back({c, i, {}});
  }
  tbb::parallel_for(std::size_t{0}, steps.size(), [&](std::size_t i) {
    BuiltStep& built = steps[i];
    const double value = built.source->values[static_cast<std::size_t>(built.index)];
    built.step = built.source->build(value);
    built.step.value = value;
    PN_CHECK(built.step.points.size() == kTilePoints && built.step.exact.size() == kTilePoints,
             "a step fills its tile");
  });
  return steps;
}

std::vector<Cell> cells_of(const std::vector<BuiltStep>& steps,
                           const std::vector<Method>& methods) {
  std::vector<Cell> cells;
  for (const BuiltStep& built : steps) {
    const std::string_view swept = built.source->swept_param;
    for (const Method& method : methods) {
      if (!swept.empty() && !method.has_param(swept)) continue;
      Cell& cell = cells.emplace_back();
      cell.built = &built;
      cell.method = &method;
    }
  }
  return cells;
}

int srl_of(const Cell& cell) {
  return std::max(cell.built->source->srl, cell.method->entry->min_srl);
}

void measure_cell(Cell& cell, bool quick) {
  const StabilityStep& step = cell.built->step;
  const int srl = srl_of(cell);
  try {
    cell.main = measure(step, *cell.method, split_budget(*cell.method->entry, srl),
                        estimates_of(cell, srl, quick), key_of(cell, "main"));
  } catch (const InputError& error) {
    cell.refusal = error.what();
    return;
  }
  note_bad(cell, cell.main, srl);
  if (step.is_dark() || cell.main.statistics.count() == 0) return;
  try {
    measure_levels(cell, quick);
  } catch (const InputError&) {
    // More rays than the estimator takes: the slope is fitted to fewer levels.
  }
}

void repeat_cell(Cell& cell, bool quick) {
  const int srl = srl_of(cell);
  cell.repeated =
      measure(cell.built->step, *cell.method, split_budget(*cell.method->entry, srl),
              estimates_of(cell, srl, quick) * kConfirmFactor, key_of(cell, "repeated"));
}

Evidence evidence_of(const Cell& cell, const Measurement& m) {
  Evidence evidence;
  evidence.statistics = m.statistics;
  evidence.non_finite = m.non_finite + cell.other_non_finite;
  evidence.negative = m.negative + cell.other_negative;
  evidence.uncovered = m.counters.uncovered;
  evidence.is_dark = cell.built->step.is_dark();
  evidence.claims_unbiased = cell.method->bias_reason.empty();
  evidence.tolerance = tolerance_of(cell.built->step.condition);
  return evidence;
}

}  // namespace penumbra::stability
