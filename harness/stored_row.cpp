#include "harness/stored_row.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "harness/image_file.h"
#include "harness/reference.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::size_t kListed = 5;

std::string described(const RunRow& row) {
  return fmt::format("{} ({}, {}, {}, block {})", row.run_id, row.scene, row.label, row.sampler,
                     row.block);
}

std::string listed(const std::vector<RunRow>& rows) {
  std::string text;
  for (std::size_t i = 0; i < std::min(rows.size(), kListed); ++i) {
    text += (i > 0 ? ", " : "") + described(rows[i]);
  }
  return rows.size() > kListed ? fmt::format("{} and {} more", text, rows.size() - kListed) : text;
}

RunRow find_row(const std::filesystem::path& file, const std::string& id) {
  const std::vector<RunRow> rows = read_run_rows(file).rows;
  if (rows.empty()) throw InputError(file.string() + ": holds no rows");
  std::vector<RunRow> found;
  for (const RunRow& row : rows) {
    if (!id.empty() && row.run_id.starts_with(id)) found.push_back(row);
  }
  if (found.size() == 1) return found.front();
  if (found.empty()) {
    throw InputError(fmt::format("--row: no run_id of {} begins with \"{}\"; there are {}",
                                 file.string(), id, listed(rows)));
  }
  throw InputError(fmt::format("--row: \"{}\" is the beginning of {} run_ids: {}", id, found.size(),
                               listed(found)));
}

ExperimentConfig load_resolved(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) throw InputError(file.string() + ": there is no such file");
  try {
    return load_config(file);
  } catch (const InputError& error) {
    throw ReferenceError("the folder's config is no longer valid for this program:\n" +
                         std::string(error.what()));
  }
}

}  // namespace

StoredRow::StoredRow(std::filesystem::path folder, const std::string& id)
    : folder_(std::move(folder)), row_(find_row(folder_ / "measurements.csv", id)) {
  if (find_estimator(row_.estimator) == nullptr) {
    throw ReferenceError(
        fmt::format("row {}: this program has no estimator \"{}\"", row_.run_id, row_.estimator));
  }
  config_ = load_resolved(folder_ / "config.resolved.json");
  load_scene_of_row();
  find_cell(read_plan_file(folder_ / "plan.lock.json"));
}

void StoredRow::load_scene_of_row() {
  std::erase_if(config_.scenes, [&](const SceneConfig& s) { return s.name != row_.scene; });
  if (config_.scenes.empty()) {
    throw ReferenceError(
        fmt::format("row {}: the folder's config has no scene \"{}\"", row_.run_id, row_.scene));
  }
  scenes_.push_back(load_scene(config_.scenes.front(), config_.tile, config_.quantity));
}

void StoredRow::find_cell(const PlanFile& plan) {
  std::vector<Cell> cells = expand_cells(config_, scenes_);
  const auto found = std::find_if(cells.begin(), cells.end(),
                                  [&](const Cell& cell) { return cell.id == row_.cell; });
  if (found == cells.end()) {
    throw ReferenceError(fmt::format("row {} cannot be run again; changed since: {}", row_.run_id,
                                     fmt::join(changes(plan, cells), "; ")));
  }
  std::vector<Cell> one{*found};
  apply_plan(plan.cells, one);
  cell_ = one.front();
  if (cell_.spp != row_.spp || cell_.srl.initial != row_.srl_initial ||
      cell_.srl.adaptive != row_.srl_adaptive) {
    throw ReferenceError(fmt::format(
        "row {}: measured with SPP {} and SRL {}+{}, but plan.lock.json gives SPP {} and SRL {}+{}",
        row_.run_id, row_.spp, row_.srl_initial, row_.srl_adaptive, cell_.spp, cell_.srl.initial,
        cell_.srl.adaptive));
  }
}

// What can be told of the parts that a cell's id is a hash of.
std::vector<std::string> StoredRow::changes(const PlanFile& plan,
                                            const std::vector<Cell>& cells) const {
  std::vector<std::string> result;
  if (plan.core_version && *plan.core_version != kCoreVersion) {
    result.push_back(fmt::format("core version {} is {}", *plan.core_version, kCoreVersion));
  }
  const std::string& hash = scene().scene->content_hash();
  const auto planned = plan.scene_hashes.find(row_.scene);
  if (planned != plan.scene_hashes.end() && planned->second != hash) {
    result.push_back(
        fmt::format("content of scene \"{}\" (hash {} is {})", row_.scene, planned->second, hash));
  }
  const ShadingPoints& points = scene().points;
  if (row_.width != points.width || row_.height != points.height) {
    result.push_back(fmt::format("resolution {} x {} is {} x {}", row_.width, row_.height,
                                 points.width, points.height));
  }
  if (row_.camera_samples != points.camera_samples) {
    result.push_back(
        fmt::format("camera samples {} are {}", row_.camera_samples, points.camera_samples));
  }
  const std::string reference = reference_id(scene());
  if (result.empty() && row_.reference_id != reference) {
    result.push_back(fmt::format("scene, quantity or core version (reference {} is {})",
                                 row_.reference_id, reference));
  }
  std::vector<std::string> params;
  for (const Cell& cell : cells) {
    if (cell.label != row_.label || to_string(cell.sampler) != row_.sampler) continue;
    if (cell.estimator->name != row_.estimator) {
      result.push_back(
          fmt::format("estimator \"{}\" is \"{}\"", row_.estimator, cell.estimator->name));
      return result;
    }
    params.push_back("\"" + cell.params_text + "\"");
  }
  if (params.empty()) {
    result.push_back(
        fmt::format("method \"{}\" with sampler {} is gone", row_.label, row_.sampler));
  } else if (std::find(params.begin(), params.end(), "\"" + row_.params + "\"") == params.end()) {
    result.push_back(
        fmt::format("parameters \"{}\" are {}", row_.params, fmt::join(params, " or ")));
  }
  if (result.empty()) result.emplace_back("budget, SPP or SRL of the config");
  return result;
}

std::filesystem::path StoredRow::image() const {
  return image_file(folder_, row_.scene, cell_, ".exr");
}

}  // namespace penumbra
