#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/bias_test.h"
#include "harness/csv.h"
#include "harness/experiment.h"
#include "harness/gate/gate_run.h"
#include "harness/gate/worker_process.h"
#include "harness/reference.h"
#include "harness/scratch_folder.h"

namespace penumbra {

/// SIGINT or SIGTERM came between two runs; what was measured is on disk.
class GateInterrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The cells of a gate with all that their runs are measured against. The same for both sides,
/// which render only.
struct GateSubject {
  const Experiment* experiment{nullptr};
  std::vector<std::string> names;                    ///< gate_cell_names of its cells
  std::vector<std::optional<Reference>> references;  ///< [scene]

  GateConfig gate;  ///< of the config, or its defaults

  const ExperimentConfig& config() const { return experiment->config(); }
  const LoadedScene& scene_of(std::size_t cell) const {
    return experiment->scenes()[experiment->cells()[cell].scene];
  }
  const Reference& reference_of(std::size_t cell) const {
    return *references[experiment->cells()[cell].scene];
  }
};

/// Finds or renders the references.
/// @param experiment  outlives the subject
GateSubject gate_subject(const Experiment& experiment);

/// A cell and the sides that are to run it.
struct GateWork {
  std::size_t cell{0};
  std::vector<GateSide> sides;
};

/// Means of the tiles that the test of bias takes.
TileMeans tile_means_of(const Image& image);

/// Lets programs make runs, measures their pictures, and appends each run to a file.
class GateMeasurer {
 public:
  /// @param sides  programs by side
  /// @param rows   gate.rows.csv; the runs that it holds are not made again
  GateMeasurer(const GateSubject& subject, std::map<GateSide, WorkerOptions> sides,
               const std::filesystem::path& rows);

  /// What a program says of itself; starts it for that.
  WorkerGreeting greeting(GateSide side) const;

  /// Makes the runs of the blocks [first, last): in a random order of cells, in which the sides of
  /// a cell follow each other; every second block goes the other way round.
  /// Programs are started anew for every pair of blocks, so that a block is one of processes too.
  /// @throws GateInterrupted
  void measure(GatePhase phase, std::span<const GateWork> work, int first, int last);

  /// One run of head per cell with the fewest samples, and block 0 again: as measured, and on
  /// another number of threads.
  void check_head(std::span<const std::size_t> cells);

  /// In the order in which they were made.
  std::vector<GateRun> runs(GatePhase phase, GateSide side, const std::string& cell) const;
  std::size_t count() const { return runs_.size(); }

 private:
  struct Wanted {
    GatePhase phase;
    GateSide side;
    std::size_t cell;
    int block;
    int threads;
    int spp;  ///< 0: the cell's
  };
  class Workers;

  void make(const Wanted& wanted, Workers& workers);
  bool done(const Wanted& wanted) const;
  void measure_picture(const std::filesystem::path& picture, std::size_t cell, GateRun& run) const;

  const GateSubject& subject_;
  std::map<GateSide, WorkerOptions> sides_;
  ScratchFolder pictures_{"gate"};
  std::vector<GateRun> runs_;
  std::optional<CsvWriter> writer_;
};

/// Block numbers of GatePhase::Confirm begin here, so that seeds are fresh.
inline constexpr int kConfirmBlocks = 100'000;

}  // namespace penumbra
