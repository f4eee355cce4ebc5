#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "estimators/estimator.h"
#include "harness/config.h"
#include "scenes/core/located_json.h"

namespace penumbra {

/// Makes an ExperimentConfig of a document and checks what a schema cannot: names, parameters,
/// files, combinations. A part of load_config. It also reads documents with faults of the schema,
/// so that both kinds are reported at once; a value that is already at fault keeps its default and
/// is not reported again.
class ConfigReader {
 public:
  /// @param faults  those of the schema; this class adds its own
  ConfigReader(const LocatedJson& document, std::filesystem::path file, DiagnosticList& faults);

  /// The result is to be used only when there are no faults; `resolved_json` is left empty.
  ExperimentConfig read();

 private:
  void fault(const std::string& pointer, std::string message);
  void read_top_level();

  SceneConfig read_scene(const nlohmann::json& value, const std::string& pointer);
  void find_scene_file(const nlohmann::json& value, const std::string& pointer, SceneConfig& scene);
  void read_reference(const nlohmann::json& value, const std::string& pointer,
                      const SceneConfig& scene, ReferenceConfig& reference);

  MethodConfig read_method(const nlohmann::json& value, const std::string& pointer);

  /// One value of an axis and where it is written.
  struct Item {
    nlohmann::json value;
    std::string pointer;
  };
  /// The values of a single value, a list or a range.
  /// @param whole  the axis has whole numbers
  std::vector<Item> axis_items(const nlohmann::json& value, const std::string& pointer, bool whole);
  std::vector<Item> srl_items(const nlohmann::json& value, const std::string& pointer);
  void read_axes(const nlohmann::json& value, const std::string& pointer,
                 const EstimatorEntry* entry, MethodConfig& method);
  void read_srl_by_scene(const nlohmann::json& by_scene, const std::string& pointer,
                         const EstimatorEntry* entry, MethodConfig& method);
  bool check_scene_key(const std::string& scene, const std::string& pointer);
  void read_params(const nlohmann::json& params, const std::string& pointer,
                   const EstimatorEntry& entry, MethodConfig& method);
  void read_preset(const nlohmann::json& object, const std::string& pointer,
                   const EstimatorEntry& entry, MethodConfig& method);
  void read_zip(const nlohmann::json& zip, const std::string& pointer, MethodConfig& method);
  void read_exclude(const nlohmann::json& exclude, const std::string& pointer,
                    const EstimatorEntry* entry, MethodConfig& method);
  void read_published(const nlohmann::json& published, const std::string& pointer,
                      MethodConfig& method);
  const EstimatorEntry* find_entry(const std::string& name, const std::string& pointer);
  std::optional<Srl> read_srl(const nlohmann::json& value, const std::string& pointer,
                              const EstimatorEntry* entry);

  void read_budget();
  void read_budget_times(const nlohmann::json& value, BudgetConfig& budget);
  void read_images();
  void read_gate();
  void read_crop(const nlohmann::json& value, const std::string& pointer);
  std::optional<std::array<int, 2>> resolution_of(const SceneConfig& scene) const;

  void check_names();
  void check_baselines();
  void check_samples();
  void check_spp(int spp, const SceneConfig& scene, const std::string& pointer);

  const LocatedJson& document_;
  const nlohmann::json& root_;
  std::filesystem::path project_root_;
  DiagnosticList& faults_;
  ExperimentConfig config_;
};

}  // namespace penumbra
