#include "harness/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "harness/keys.h"
#include "harness/metrics.h"
#include "harness/progress.h"
#include "harness/render.h"
#include "harness/statistics.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

bool solves_srl(const ExperimentConfig& config) {
  return config.budget && config.budget->solve_for == SolveFor::Srl;
}

/// The number that a budget solves for, set to n.
Cell with_units(const ExperimentConfig& config, Cell cell, int n) {
  if (solves_srl(config)) {
    cell.srl = scaled_srl(cell.srl, n);
  } else {
    cell.spp = n;
  }
  return cell;
}

/// CPU times of pilots with n units.
struct Level {
  int n{0};
  std::vector<double> times_s;
};

/// Cells that differ in nothing but their budget, and their common line.
struct Family {
  std::vector<std::size_t> members;  // indices of cells
  Level low, high;
  TimeFit fit;
  bool settled{false};
  Image pilot;  // the first of the larger size, where something is to be foreseen
  std::optional<double> p_eff;
};

class Pilots {
 public:
  Pilots(const ExperimentConfig& config, const std::vector<LoadedScene>& scenes,
         const std::vector<Cell>& cells, std::map<std::size_t, double> matched_s, bool foresee)
      : config_(config),
        scenes_(scenes),
        cells_(cells),
        matched_s_(std::move(matched_s)),
        foresee_(foresee),
        threads_(resolve_threads(config.threads)) {
    group();
  }

  std::vector<PlannedCell> run() {
    std::vector<PlannedCell> plan(cells_.size());
    if (cells_.empty()) return plan;
    // One discarded run warms caches and thread pool.
    measure(families_[0], families_[0].low.n, "warm");
    if (config_.budget && config_.budget->match) measure_matched();
    first_levels();
    for (int round = 0; round < kCheckRounds && config_.budget; ++round) {
      if (!check_largest(round)) break;
    }
    for (const Family& family : families_) {
      for (const std::size_t c : family.members) plan[c] = planned(family, c);
    }
    return plan;
  }

 private:
  const Cell& representative(const Family& family) const { return cells_[family.members.back()]; }

  /// Members are sorted by budget, so the last one is the largest.
  void group() {
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      const auto found = std::find_if(families_.begin(), families_.end(), [&](const Family& f) {
        const Cell& other = cells_[f.members.front()];
        const Cell& cell = cells_[c];
        return config_.budget && other.scene == cell.scene && other.label == cell.label &&
               other.sampler == cell.sampler && other.srl == cell.srl && other.spp == cell.spp &&
               other.params_text == cell.params_text;
      });
      Family& family = found == families_.end() ? families_.emplace_back() : *found;
      family.members.push_back(c);
    }
    for (Family& family : families_) {
      std::sort(family.members.begin(), family.members.end(), [&](std::size_t a, std::size_t b) {
        return cells_[a].budget_time < cells_[b].budget_time;
      });
      choose_levels(representative(family), family);
    }
  }

  void choose_levels(const Cell& cell, Family& family) const {
    if (!config_.budget) {
      family.low.n = cell.spp;
    } else if (solves_srl(config_)) {
      // On both sides of the given number, which is meant to be near the answer.
      const int given = cell.srl.total();
      family.low.n = nearest_accepted(cell, std::max(least_units(cell), given / 2));
      family.high.n = std::max(family.low.n + 1, given + given / 2);
    } else {
      family.low.n = least_units(cell);
      family.high.n = 3 * family.low.n;
    }
  }

  int least_units(const Cell& cell) const {
    if (solves_srl(config_)) return cell.estimator->min_srl;
    return scenes_[cell.scene].points.camera_samples;
  }

  int given_units(const Cell& cell) const {
    return solves_srl(config_) ? cell.srl.total() : cell.spp;
  }

  /// The one cell of a scene that gives it its budget, with the numbers of the config.
  bool gives_budget(const Cell& cell) const {
    return config_.budget->match == cell.label && cell.budget_time == 1.0;
  }

  double budget_s(const Cell& cell) const {
    return config_.budget->match ? *cell.budget_time * matched_s_.at(cell.scene)
                                 : *cell.budget_time;
  }

  void measure_matched() {
    std::map<std::size_t, std::vector<double>> times_s;
    for (int round = 0; round < config_.budget->pilots; ++round) {
      in_order(round, [&](Family& family) {
        const Cell& cell = representative(family);
        if (cell.label != *config_.budget->match || matched_s_.count(cell.scene) != 0) return;
        times_s[cell.scene].push_back(
            measure(family, given_units(cell), "match " + std::to_string(round)));
      });
    }
    for (const auto& [scene, times] : times_s) matched_s_[scene] = hodges_lehmann(times);
  }

  RenderResult render_pilot(const Family& family, int n, const std::string& round) const {
    const Cell cell =
        config_.budget ? with_units(config_, representative(family), n) : representative(family);
    const std::uint64_t seed = hash_texts({"pilot", cell.id, std::to_string(n), round});
    return render(*scenes_[cell.scene].scene, scenes_[cell.scene].points,
                  render_settings(cell, seed, threads_));
  }

  double measure(const Family& family, int n, const std::string& round) const {
    return render_pilot(family, n, round).time_cpu_s;
  }

  /// Two pilots of one size: half their squared difference estimates the variance of each pixel,
  /// with one degree of freedom.
  void foresee(const Image& pilot, Family& family) const {
    if (family.pilot.pixels.empty()) {
      family.pilot = pilot;
    } else if (!family.p_eff) {
      std::vector<double> variances;
      for (std::size_t i = 0; i < pilot.pixels.size(); ++i) {
        const Vec3d difference = Vec3d(pilot.pixels[i]) - Vec3d(family.pilot.pixels[i]);
        variances.push_back(difference.length2() / 6.0);
      }
      family.p_eff = effective_pixels(variances, 1.0);
      family.pilot = {};
    }
  }

  /// Calls visit(family) forwards, or backwards in odd rounds, so that drift hits all alike.
  template <typename Visit>
  void in_order(int round, Visit visit) {
    for (std::size_t i = 0; i < families_.size(); ++i) {
      visit(families_[round % 2 == 0 ? i : families_.size() - 1 - i]);
    }
  }

  void first_levels() {
    const int pilots = config_.budget ? config_.budget->pilots : 1;
    Progress progress("pilots", pilots * static_cast<double>(families_.size()));
    double done = 0;
    for (int round = 0; round < pilots; ++round) {
      in_order(round, [&](Family& family) {
        const std::string key = std::to_string(round);
        family.low.times_s.push_back(measure(family, family.low.n, key));
        if (config_.budget) {
          const RenderResult pilot = render_pilot(family, family.high.n, key);
          family.high.times_s.push_back(pilot.time_cpu_s);
          if (foresee_) foresee(pilot.image(), family);
        }
        progress.update(++done, representative(family).label);
      });
    }
    progress.finish();
    if (!config_.budget) return;
    for (Family& family : families_) fit(family);
  }

  void fit(Family& family) const {
    const std::optional<TimeFit> fit =
        fit_time({static_cast<double>(family.low.n), family.low.times_s},
                 {static_cast<double>(family.high.n), family.high.times_s});
    if (!fit) {
      throw RunError("pilot of \"" + representative(family).label + "\" on scene \"" +
                     scenes_[representative(family).scene].config->name +
                     "\": times do not grow with the work; the machine is too noisy");
    }
    family.fit = *fit;
  }

  /// The line through a checked run and the pilots that are farther from it, on either side; from
  /// the origin where that line has no meaning, because a run near the pilots says little of a
  /// slope.
  static void fit_through(int n, double time_s, Family& family) {
    const auto distance = [&](const Level& level) { return std::abs(std::log(1.0 * level.n / n)); };
    const Level& far = distance(family.low) > distance(family.high) ? family.low : family.high;
    const double slope = (hodges_lehmann(far.times_s) - time_s) / (far.n - n);
    const double fixed = time_s - slope * n;
    const bool has_meaning = slope > 0 && std::isfinite(slope) && fixed >= 0;
    family.fit = has_meaning ? TimeFit{fixed, slope, false} : TimeFit{0, time_s / n, true};
  }

  int units(const Family& family, const Cell& cell) const {
    if (gives_budget(cell)) return given_units(cell);
    const std::int64_t n = samples_for_time(family.fit, budget_s(cell)).value_or(0);
    const int least = least_units(cell);
    if (n < least) {
      throw InputError(fmt::format(
          "budget of {} s is too small for \"{}\" on scene \"{}\": it pays for {} {}, {} are the "
          "least (about {:.2g} s)",
          budget_s(cell), cell.label, scenes_[cell.scene].config->name, n,
          solves_srl(config_) ? "shadow rays per light" : "estimates per pixel", least,
          family.fit.fixed_s + family.fit.per_sample_s * least));
    }
    return nearest_accepted(cell, static_cast<int>(std::min<std::int64_t>(n, 1'000'000)));
  }

  bool is_accepted(const Cell& cell, int n) const {
    const Cell solved = with_units(config_, cell, n);
    try {
      cell.estimator->create(*scenes_[cell.scene].scene, cell.params, solved.budget());
      return true;
    } catch (const InputError&) {
      return false;
    }
  }

  /// An estimator can refuse a split, such as one too small for its components. The next smaller
  /// total is taken instead or, where there is none, the next larger, whose time then tells.
  int nearest_accepted(const Cell& cell, int n) const {
    if (!solves_srl(config_)) return n;
    for (int smaller = n; smaller >= least_units(cell); --smaller) {
      if (is_accepted(cell, smaller)) return smaller;
    }
    for (int larger = n + 1; larger <= std::max(n, cell.srl.total()); ++larger) {
      if (is_accepted(cell, larger)) return larger;
    }
    return n;
  }

  /// One run of each family at the n of its largest budget.
  /// @return whether another round is needed
  bool check_largest(int round) {
    bool again = false;
    Progress progress("check of the plan", static_cast<double>(families_.size()));
    double done = 0;
    in_order(round, [&](Family& family) {
      progress.update(++done, representative(family).label);
      if (family.settled) return;
      const Cell& largest = representative(family);
      const int n = units(family, largest);
      if (n <= family.low.n || gives_budget(largest)) {
        family.settled = true;
        return;
      }
      const double time_s = measure(family, n, "check " + std::to_string(round));
      // A whole number of units meets a budget to one unit only.
      const double allowed_s =
          std::max(config_.budget->tolerance * budget_s(largest), family.fit.per_sample_s);
      family.settled = std::abs(time_s - budget_s(largest)) <= allowed_s;
      if (family.settled) return;
      fit_through(n, time_s, family);
      again = true;
    });
    progress.finish();
    return again;
  }

  PlannedCell planned(const Family& family, std::size_t index) const {
    const Cell& cell = cells_[index];
    if (!config_.budget) {
      const double time_s = family.low.times_s.front();
      return {cell.id,           cell.spp, cell.srl,     0.0,
              time_s / cell.spp, time_s,   std::nullopt, std::nullopt};
    }
    const int n = units(family, cell);
    const Cell solved = with_units(config_, cell, n);
    return {cell.id,
            solved.spp,
            solved.srl,
            family.fit.fixed_s,
            family.fit.per_sample_s,
            family.fit.fixed_s + family.fit.per_sample_s * n,
            budget_s(cell),
            family.p_eff};
  }

  const ExperimentConfig& config_;
  const std::vector<LoadedScene>& scenes_;
  const std::vector<Cell>& cells_;
  std::map<std::size_t, double> matched_s_;  // CPU time by scene
  bool foresee_;
  int threads_;
  std::vector<Family> families_;
};

}  // namespace

std::vector<PlannedCell> run_pilots(const ExperimentConfig& config,
                                    const std::vector<LoadedScene>& scenes,
                                    const std::vector<Cell>& cells,
                                    const std::map<std::size_t, double>& matched_s, bool foresee) {
  return Pilots(config, scenes, cells, matched_s, foresee).run();
}

}  // namespace penumbra
