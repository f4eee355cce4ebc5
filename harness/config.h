#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimators/params.h"
#include "harness/gate/gate_config.h"
#include "scenes/core/shading_point.h"

/// An experiment as its config file states it (configs/README.md explains every key; the JSON
/// Schema is configs/experiment.schema.json). Sweeps are still axes here; `expand_cells` (plan.h)
/// makes cells of them.
namespace penumbra {

/// Shadow rays per light of one estimate: an initial and an adaptive part; `adaptive` is 0 for
/// estimators without. Written "16" or "4-12".
struct Srl {
  int initial{16};
  int adaptive{0};
  bool split{false};  ///< written A-B; otherwise an adaptive estimator splits the total 1:3

  int total() const { return initial + adaptive; }
  std::string text() const;  ///< as written
  friend bool operator==(const Srl&, const Srl&) = default;
};

/// How the truth of a scene is found.
enum class ReferenceType {
  Auto,      ///< ExactSum where the scene allows it, otherwise Sampled
  Sampled,   ///< two halves of many estimates
  ExactSum,  ///< a sum over lights without extent, free of noise; only where there are no others
};

/// How the reference of a scene is rendered, when it is not found.
struct ReferenceConfig {
  ReferenceType type{ReferenceType::Auto};
  std::string estimator{"mis"};  ///< any unbiased registered estimator except pmc_hi
  std::string sampler{"sobol"};
  ParamSet::Map params;
  Srl srl{32, 0, false};
  int spp{64};  ///< estimates per pixel, both halves together; even
};

struct SceneConfig {
  std::string name;            ///< a folder of scenes/, or any label when `file` is given
  std::filesystem::path file;  ///< resolved path of the scene file
  std::optional<std::array<int, 2>> resolution;  ///< overrides the scene's camera
  int camera_samples{4};   ///< fixed shading points per pixel; the truth is their mean
  std::optional<int> spp;  ///< estimates per pixel here; methods' own come first
  ReferenceConfig reference;
};

/// A value of every named axis; the names are "sampler", "spp", "srl" and those of parameters.
using SweepValues = std::map<std::string, ParamValue>;

/// One row family of the table: an estimator with values or sweeps of its parameters (sweep.h).
struct MethodConfig {
  std::string label;  ///< unique; names rows, files and curves
  std::string estimator;
  std::vector<std::string> samplers;        ///< empty: every sampler of the experiment
  std::vector<int> spp;                     ///< estimates per pixel; empty: the experiment's
  std::vector<Srl> srl;                     ///< at least one
  std::map<std::string, Srl> srl_by_scene;  ///< in place of `srl`, which is then one value
  std::map<std::string, std::vector<ParamValue>> params;
  std::vector<std::vector<std::string>> zip;  ///< axes that advance together
  std::vector<SweepValues> exclude;           ///< combinations that are left out
  std::vector<std::string> tags;              ///< for --tag
  std::map<std::string, double> published;    ///< a publication's efficiency by scene name, in its
                                              ///< own unit
};

/// Which number of the plan is solved for to meet the time budget.
enum class SolveFor {
  Spp,  ///< estimates per pixel, at each cell's given SRL
  Srl,  ///< shadow rays per light, at the given SPP, as the paper did
};

struct BudgetConfig {
  std::vector<double> times;  ///< CPU seconds of the estimation alone, or multiples of the time of
                              ///< `match`; a curve where several
  std::optional<std::string> match;  ///< label of the method whose time, at the numbers that it is
                                     ///< given, is the budget of all others in its scene
  SolveFor solve_for{SolveFor::Spp};
  int pilots{3};           ///< pilot runs per cell and level
  double tolerance{0.05};  ///< allowed relative miss of the realised time
};

struct CropConfig {
  std::string name;
  std::string scene;
  std::array<int, 4> rectangle;  ///< x, y, width, height [pixels]
};

struct ImagesConfig {
  bool maps{true};       ///< maps of the estimators that have them (PMC-HI's alpha)
  bool runs{true};       ///< the picture of every run (replicate_files.h)
  float exposure{0.0f};  ///< stops, of the PNGs
  std::vector<CropConfig> crops;
};

struct ExperimentConfig {
  std::filesystem::path file;
  std::string name;
  std::string summary;
  std::uint64_t seed{1};
  int threads{0};                         ///< 0: all cores
  int tile{16};                           ///< side of a tile [pixels], a multiple of 8
  Quantity quantity{Quantity::Radiance};  ///< what is estimated at every shading point
  std::vector<SceneConfig> scenes;
  std::vector<MethodConfig> methods;
  std::string baseline;  ///< label; ratios are against it within scene, sampler and budget
  std::optional<std::string> tuned_baseline;  ///< label of a second baseline with a pinned sampler
  std::string published_source;               ///< where the published efficiencies are from
  std::vector<std::string> samplers{"independent"};
  int spp{8};                          ///< estimates per pixel, unless solved for
  std::optional<BudgetConfig> budget;  ///< none: SPP and SRL as given
  int blocks{5};
  int attempts{3};  ///< of a run whose time was disturbed; its image is the same each time
  double relmse_epsilon{0.01};  ///< relMSE denominator: reference^2 + epsilon * mean(reference)^2
  ImagesConfig images;
  std::optional<GateConfig> gate;  ///< none: its defaults
  std::string resolved_json;       ///< the whole config after --set, defaults included, canonical
};

/// Loads and checks a config: syntax, schema, names, parameters, scene files' existence,
/// combinations.
/// @param overrides  "key.path=value" of --set; a value is JSON, or else taken as a string
/// @throws InputError listing every fault as "file:line:col: error: /json/pointer: message"
ExperimentConfig load_config(const std::filesystem::path& file,
                             const std::vector<std::string>& overrides = {});

/// Parses "16" or "4-12".
/// @throws InputError naming the text and the two forms
Srl parse_srl(const std::string& text);

/// The quantity of a name of `to_string`.
/// @return nullopt when there is none of that name
std::optional<Quantity> parse_quantity(std::string_view name);

/// "auto", "sampled" or "exact_sum", as configs and references have it.
std::string_view to_string(ReferenceType type);

/// The type of a name of `to_string`.
/// @return nullopt when there is none of that name
std::optional<ReferenceType> parse_reference_type(std::string_view name);

}  // namespace penumbra
