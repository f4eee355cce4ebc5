#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/config.h"
#include "harness/plan.h"
#include "harness/run_row.h"
#include "harness/scene_store.h"

namespace penumbra {

/// A row of a result folder with all that is needed to run it again. Only the row's scene is
/// loaded.
class StoredRow {
 public:
  /// @param folder  holds config.resolved.json, plan.lock.json and measurements.csv
  /// @param id      run_id, or the beginning of one
  /// @throws InputError when a file of the folder cannot be read, or no row or several begin with
  /// the id
  /// @throws ReferenceError when config, scene, core version, estimator or plan are no longer those
  /// of the row; the message names what changed
  StoredRow(std::filesystem::path folder, const std::string& id);
  StoredRow(const StoredRow&) = delete;
  StoredRow& operator=(const StoredRow&) = delete;

  /// The result folder.
  const std::filesystem::path& folder() const { return folder_; }
  /// The row as measurements.csv has it.
  const RunRow& row() const { return row_; }
  /// The row's scene with its shading points.
  const LoadedScene& scene() const { return scenes_.front(); }
  /// The row's cell with the frozen SPP and SRL.
  const Cell& cell() const { return cell_; }

  /// What the row was rendered with.
  RenderSettings settings(int threads) const { return render_settings(cell_, row_.seed, threads); }

  /// The picture of the row's cell.
  std::filesystem::path image() const;

 private:
  void load_scene_of_row();
  void find_cell(const PlanFile& plan);
  std::vector<std::string> changes(const PlanFile& plan, const std::vector<Cell>& cells) const;

  std::filesystem::path folder_;
  RunRow row_;
  ExperimentConfig config_;
  std::vector<LoadedScene> scenes_;  // one
  Cell cell_;
};

}  // namespace penumbra
