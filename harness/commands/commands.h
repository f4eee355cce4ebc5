#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/exit_codes.h"
#include "harness/figure.h"
#include "harness/gate/gate.h"

/// The subcommands of `penumbra`. Each returns its exit code; user faults are thrown as InputError
/// and the like, and main turns them into a message and a code.
namespace penumbra {

class Experiment;
class Ranks;
struct ExperimentConfig;
struct EfficiencyRow;
struct RenderSettings;

struct ConfigOptions {
  std::filesystem::path config;
  std::vector<std::string> overrides;  ///< "key.path=value"
};

/// As load_config, by the root first: what is wrong with a config is said once.
ExperimentConfig load_config(const ConfigOptions& options, const Ranks& ranks);

struct ListOptions {
  std::string what{"all"};  ///< estimators, scenes, metrics, stability
  bool json{false};
};
int list_command(const ListOptions& options);

int validate_command(const ConfigOptions& options);

struct PlanOptions {
  ConfigOptions config;
  std::filesystem::path lock;  ///< file that the plan goes into, for `run --plan`; empty: none
  std::string shard;           ///< "I/N": every N-th scene; empty: all
  int hosts{1};                ///< that share the work, for the prediction
};
int plan_command(const PlanOptions& options);

struct ReferenceOptions {
  ConfigOptions config;
  std::string scene;  ///< empty: all
  int add_spp{0};
  bool small{false};  ///< also into references/small/ and its manifest
  std::optional<int> threads;
  std::string shard;            ///< "I/N": every N-th scene; empty: all
  const Ranks* ranks{nullptr};  ///< that share the tiles
};
int reference_command(const ReferenceOptions& options);

/// Warns of every cell whose error contains too much of its reference's variance, with the command
/// that lowers it.
void warn_of_reference_shares(const Experiment& experiment, const std::vector<EfficiencyRow>& rows,
                              const ConfigOptions& config);

struct RunCommandOptions {
  ConfigOptions config;
  std::filesystem::path out;  ///< empty: results/<config name>
  std::string only;
  std::string tag;
  std::optional<int> threads;
  std::string command_line;
  bool json{false};                          ///< the efficiency table on stdout, nothing else
  std::string shard;                         ///< "I/N"; empty: everything
  std::vector<std::filesystem::path> plans;  ///< frozen ones, together of all scenes; empty: made
                                             ///< where there is none
  const Ranks* ranks{nullptr};               ///< that share the work
};
int run_command(const RunCommandOptions& options);

struct MergeOptions {
  std::vector<std::filesystem::path> folders;  ///< of `run --shard`
  std::filesystem::path out;                   ///< must not exist
  bool partial{false};                         ///< although blocks are missing
  bool json{false};                            ///< the efficiency table on stdout, nothing else
  std::string command_line;
};
/// Puts the folders of shards together and makes the tables.
int merge_command(const MergeOptions& options);

struct ReportOptions {
  std::filesystem::path folder;  ///< of a run's results
  bool embed{false};             ///< pictures into the page itself
  bool json{false};              ///< the efficiency table on stdout, nothing else
};
/// Makes all tables and the page of a result folder again from its raw rows.
int report_command(const ReportOptions& options);

/// Prints a report's tables or, for machines, efficiency.json; and what was left out.
void show_report(const Report& report, bool json);

struct FigureCommandOptions {
  std::filesystem::path folder;  ///< of a run's results
  FigureOptions figure;
};
/// Draws a strip of a scene's pictures for a paper.
int figure_command(const FigureCommandOptions& options);

struct RenderOptions {
  std::string scene;  ///< name of a shipped scene or a scene file
  std::string estimator{"mis"};
  int spp{8};
  std::string srl{"16"};
  std::string sampler{"independent"};
  std::string quantity{"radiance"};
  std::vector<std::string> params;  ///< "name=value"
  std::vector<int> resolution;      ///< width, height, or empty
  std::uint64_t seed{1};
  float exposure{0.0f};
  int threads{0};
  bool keep_all{false};        ///< builds and samples what the scene does not need, too
  std::filesystem::path out;   ///< .exr or .png
  std::filesystem::path maps;  ///< .png of the estimator's maps, or empty
  bool json{false};            ///< also work, times and build, on stdout
};
int render_command(const RenderOptions& options);

/// @throws InputError naming the option that has no meaning
RenderSettings render_settings(const RenderOptions& options);

struct InspectOptions {
  std::string scene;
  bool keep_all{false};
  bool json{false};
  std::string estimator;  ///< only where the time of this one goes; empty: everything
  std::string srl{"18"};  ///< of `estimator`, as the rest
  std::string sampler{"independent"};
  int spp{8};
  std::vector<std::string> params;  ///< "name=value"
};
int inspect_command(const InspectOptions& options);

struct ReplayOptions {
  std::filesystem::path folder;  ///< of a run's results
  std::string row;               ///< run_id or the beginning of one
  std::string pixel;             ///< "X,Y"
  std::optional<int> estimate;   ///< print this one only
  bool json{false};
  bool verify{false};  ///< render the whole row again as well
  int threads{0};      ///< of that
};
int replay_command(const ReplayOptions& options);

/// A scene's file: scenes/<name>/scene.json, or the path itself when it names a file.
/// @throws InputError listing the scenes that there are
std::filesystem::path scene_path(const std::string& scene);

struct SelfTestCommandOptions {
  bool quick{false};
  bool json{false};
};
/// @return kCorrectness when a check fails
int selftest_command(const SelfTestCommandOptions& options);

struct GateCommandOptions {
  ConfigOptions config;  ///< empty: configs/gate.json, or that of the head folder
  GateSources sources;
  std::filesystem::path out{"gate.json"};
  std::vector<std::string> acknowledged;  ///< "CELLS -4% reason"
  std::vector<std::string> fail_on;  ///< regression, inconclusive, correctness, failure; empty: all
  bool exit_zero{false};
  bool no_times{false};  ///< CPU time decides nothing
  bool json{false};
};
/// Compares head with base. @return the exit code of the verdict
int gate_command(const GateCommandOptions& options);

struct BaselineCommandOptions {
  ConfigOptions config;              ///< empty: configs/gate.json
  std::filesystem::path executable;  ///< empty: this program
  std::filesystem::path folder;      ///< empty: results/baseline/<name of the config>
  std::string reason;
};
/// Measures and writes stored baselines. @return kCorrectness and the like when the program is not
/// fit to be one
int baseline_update_command(const BaselineCommandOptions& options);

/// Runs what a gate asks for on stdin (harness/gate/protocol.h).
int measure_command(const ConfigOptions& options);

struct StabilityCommandOptions {
  std::string estimator;      ///< empty: all
  std::string case_name;      ///< empty: all
  std::filesystem::path out;  ///< folder of the CSV, JSON and picture; empty: none
  bool quick{false};
  bool json{false};
  int threads{0};
};
/// @return kCorrectness when an estimator that claims to be unbiased is biased, or an estimate is
///         not finite or negative
int stability_command(const StabilityCommandOptions& options);

}  // namespace penumbra
