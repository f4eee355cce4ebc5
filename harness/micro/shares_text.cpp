#include <fmt/format.h>

#include <limits>

#include "harness/build_info.h"
#include "harness/csv.h"
#include "harness/micro/shares.h"
#include "harness/number_text.h"
#include "harness/text_grid.h"

namespace penumbra::micro {
namespace {

std::string percent(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

// Rows behind the kernels: what is due, what is not accounted for, what was measured.
struct SumRow {
  const char* name;
  double ns;
};

std::vector<SumRow> sum_rows(const EstimateShares& e) {
  return {{"all kernels", e.predicted_ns()},
          {"unexplained", e.measured_ns - e.predicted_ns()},
          {"estimate", e.measured_ns}};
}

void add_lines(TextGrid& grid, const EstimateShares& e) {
  const auto add = [&](const std::string& kernel, const std::string& calls,
                       const std::string& per_call, double ns, const std::string& rays,
                       const std::string& gain) {
    grid.lines.push_back({e.estimator + " " + e.srl, kernel, calls, per_call, number_text(ns),
                          percent(ns / e.measured_ns), rays, gain});
  };
  for (const KernelShare& k : e.kernels) {
    add(k.kernel, fmt::format("{} {}", number_text(k.calls), k.unit), number_text(k.ns_per_call),
        k.ns(), number_text(k.ns() / e.samples / e.shadow_ray_ns),
        ratio_text(gain_without(k.share)));
  }
  const double adaptation = e.adaptation_share();
  if (adaptation > 0.0) {
    add("adaptation in all", "", "", adaptation * e.measured_ns,
        number_text(adaptation * e.measured_ns / e.samples / e.shadow_ray_ns),
        ratio_text(gain_without(adaptation)));
  }
  for (const SumRow& row : sum_rows(e)) add(row.name, "", "", row.ns, "", "");
}

}  // namespace

double EstimateShares::predicted_ns() const {
  double sum = 0.0;
  for (const KernelShare& k : kernels) sum += k.ns();
  return sum;
}

double EstimateShares::adaptation_share() const {
  double sum = 0.0;
  for (const KernelShare& k : kernels) {
    if (k.kernel.rfind("adapt:", 0) == 0) sum += k.share;
  }
  return sum;
}

double gain_without(double share) noexcept {
  return share < 1.0 ? 1.0 / (1.0 - share) : std::numeric_limits<double>::infinity();
}

void set_shares(EstimateShares& shares, double measured_ns) {
  shares.measured_ns = measured_ns;
  for (KernelShare& k : shares.kernels) k.share = k.ns() / measured_ns;
}

std::string shares_text(const std::vector<EstimateShares>& all) {
  std::string text;
  for (std::size_t i = 0; i < all.size();) {
    const std::string& scene = all[i].scene;
    text +=
        fmt::format("\n{}: a shadow ray takes {} ns\n", scene, number_text(all[i].shadow_ray_ns));
    TextGrid grid;
    grid.columns = {{"estimate", true}, {"kernel", true}, {"calls"},       {"ns/call"},
                    {"ns/estimate"},    {"of T"},         {"rays/sample"}, {"gain if free"}};
    for (; i < all.size() && all[i].scene == scene; ++i) add_lines(grid, all[i]);
    text += terminal_grid(grid, 2);
  }
  return text +
         "\nCPU time, medians of interleaved rounds. rays/sample: time per sample in shadow rays. "
         "gain if free:\nefficiency over what it is, if the kernel took no time: 1/(1 - share of "
         "T).\n";
}

std::string shares_csv(const std::vector<EstimateShares>& all, const MicroConfig& config) {
  const std::vector<std::string> header{"scene",         "estimator",
                                        "srl",           "kernel",
                                        "unit",          "calls",
                                        "ns_per_call",   "ns_per_estimate",
                                        "share_of_time", "shadow_rays_per_sample",
                                        "gain_if_free",  "shadow_ray_ns",
                                        "samples",       "rays",
                                        "commit",        "cpu",
                                        "config_hash"};
  std::string text = csv_line(header);
  for (const EstimateShares& e : all) {
    const auto add = [&](const std::string& kernel, const std::string& unit,
                         const std::optional<double>& calls, const std::optional<double>& per_call,
                         double ns) {
      const double share = ns / e.measured_ns;
      const std::vector<std::string> fields{e.scene,
                                            e.estimator,
                                            e.srl,
                                            kernel,
                                            unit,
                                            csv_text(calls),
                                            csv_text(per_call),
                                            csv_text(ns),
                                            csv_text(share),
                                            csv_text(ns / e.samples / e.shadow_ray_ns),
                                            csv_text(gain_without(share)),
                                            csv_text(e.shadow_ray_ns),
                                            csv_text(e.samples),
                                            csv_text(e.rays),
                                            std::string(build_info().commit),
                                            machine_text(),
                                            config.hash};
      text += csv_line(fields);
    };
    for (const KernelShare& k : e.kernels) add(k.kernel, k.unit, k.calls, k.ns_per_call, k.ns());
    for (const SumRow& row : sum_rows(e)) add(row.name, "", {}, {}, row.ns);
  }
  return text;
}

}  // namespace penumbra::micro
