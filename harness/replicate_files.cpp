#include "harness/replicate_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "harness/exr.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

// OpenEXR's header with our attributes, and the offsets of the lines.
constexpr double kHeaderBytes = 1000;
constexpr double kLineBytes = 16;

Image read_run_picture(const fs::path& file, const RunRow& row) {
  const ExrFile exr = read_exr(file);
  const auto id = exr.metadata.find("run_id");
  const std::string found = id == exr.metadata.end() ? "none" : id->second;
  if (found != row.run_id || exr.width != row.width || exr.height != row.height) {
    throw RunError(fmt::format(
        "{}: is the picture of run {}, {} x {} pixels; expected run {}, {} x "
        "{}; remove it and the row, and measure again",
        file.string(), found, exr.width, exr.height, row.run_id, row.width, row.height));
  }
  return exr.image();
}

auto identity(const RunRow& r) {
  return std::tie(r.scene, r.label, r.estimator, r.sampler, r.params, r.spp, r.srl, r.srl_initial,
                  r.srl_adaptive, r.population, r.budget_s);
}

auto identity(const EfficiencyRow& r) {
  return std::tie(r.scene, r.label, r.estimator, r.sampler, r.params, r.spp, r.srl, r.srl_initial,
                  r.srl_adaptive, r.population, r.budget_s);
}

}  // namespace

fs::path run_picture(const fs::path& folder, const std::string& run_id) {
  return folder / "runs" / (run_id + ".exr");
}

void write_run_picture(const fs::path& folder, const RunRow& row, const Image& image) {
  const fs::path file = run_picture(folder, row.run_id);
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (error) throw RunError(file.parent_path().string() + ": " + error.message());
  write_exr(file, {{"", image}},
            {{"run_id", row.run_id},
             {"cell", row.cell},
             {"scene", row.scene},
             {"label", row.label},
             {"seed", std::to_string(row.seed)}});
}

double run_picture_bytes(int width, int height) {
  return kHeaderBytes + height * (kLineBytes + width * 3.0 * sizeof(float));
}

std::optional<ReplicateSummary> summarise_replicates(const fs::path& folder,
                                                     std::span<const RunRow> rows,
                                                     const Reference& reference) {
  ReplicateSums sums(reference.half_a.width, reference.half_a.height);
  std::set<std::uint64_t> seeds;
  for (const RunRow& row : rows) {
    if (row.status != RunStatus::Ok || row.nonfinite > 0) continue;
    if (row.reference_id != reference.id) {
      throw ReferenceError(fmt::format("run {} was measured against reference {}, not {}",
                                       row.run_id, row.reference_id, reference.id));
    }
    const fs::path file = run_picture(folder, row.run_id);
    if (seeds.count(row.seed) != 0 || !fs::exists(file)) continue;
    seeds.insert(row.seed);
    sums.add(read_run_picture(file, row).pixels);
  }
  if (sums.count() < 2) return std::nullopt;
  return sums.summary({reference.halves(), reference.exact(), reference.correlated_side});
}

std::vector<RunRow> rows_of_cell(std::span<const RunRow> rows, const EfficiencyRow& cell) {
  std::vector<RunRow> result;
  for (const RunRow& row : rows) {
    if (identity(row) == identity(cell)) result.push_back(row);
  }
  // The last digits of sums over runs depend on the order, which a run that was stopped changes.
  std::stable_sort(result.begin(), result.end(), [](const RunRow& a, const RunRow& b) {
    return std::tie(a.block, a.attempt) < std::tie(b.block, b.attempt);
  });
  return result;
}

void write_replicate_picture(const fs::path& file, const ReplicateSummary& summary,
                             const Reference& reference) {
  Image bias = summary.mean;
  for (std::size_t p = 0; p < bias.pixels.size(); ++p) {
    bias.pixels[p] -= (reference.half_a.pixels[p] + reference.half_b.pixels[p]) * 0.5f;
  }
  write_exr(file,
            {{"", summary.standard_deviation}, {"mean", summary.mean}, {"bias", std::move(bias)}},
            {{"replicates", std::to_string(summary.count)}, {"reference_id", reference.id}});
}

}  // namespace penumbra
