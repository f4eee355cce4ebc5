#include "harness/gate/measurer.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "harness/exr.h"
#include "harness/gate/gate_cells.h"
#include "harness/keys.h"
#include "harness/metrics.h"
#include "harness/progress.h"
#include "harness/render.h"
#include "harness/replicates.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

std::string half_hash_of(const Image& image) {
  std::vector<Imath::half> halves;
  halves.reserve(image.pixels.size() * 3);
  for (const Rgb& pixel : image.pixels) {
    for (int c = 0; c < 3; ++c) halves.emplace_back(pixel[c]);
  }
  return hash_of_bytes(std::as_bytes(std::span(halves)));
}

// The sides of a cell follow each other, in an order that is random too: what comes first always
// could meet whatever else goes on on the machine at the same period. Every second block goes the
// other way round.
std::vector<std::pair<std::size_t, GateSide>> block_order(const GateSubject& subject, int block,
                                                          std::span<const GateWork> work) {
  std::vector<GateWork> order(work.begin(), work.end());
  std::mt19937_64 generator(
      hash_texts({"gate order", std::to_string(subject.config().seed), std::to_string(block / 2)}));
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[generator() % i]);
  std::vector<std::pair<std::size_t, GateSide>> result;
  for (GateWork& item : order) {
    if (generator() % 2 == 1) std::reverse(item.sides.begin(), item.sides.end());
    for (const GateSide side : item.sides) result.emplace_back(item.cell, side);
  }
  if (block % 2 == 1) std::reverse(result.begin(), result.end());
  return result;
}

}  // namespace

TileMeans tile_means_of(const Image& image) {
  TileReplicates tiles(bias_tiles(image.width, image.height, kBiasTileSides));
  const std::vector<Vec3d> pixels(image.pixels.begin(), image.pixels.end());
  tiles.add(pixels);
  const std::span<const double> values = tiles.replicate(0);
  return {{values.begin(), values.end()}};
}

GateSubject gate_subject(const Experiment& experiment) {
  GateSubject subject;
  subject.experiment = &experiment;
  subject.gate = experiment.config().gate.value_or(GateConfig{});
  subject.names = gate_cell_names(experiment.config(), experiment.cells());
  for (const LoadedScene& scene : experiment.scenes()) {
    subject.references.push_back(provide_reference(scene, resolve_threads(0)));
    note(describe(scene.config->name, *subject.references.back()));
  }
  return subject;
}

/// The programs, started when they are needed, and anew after one of them failed.
class GateMeasurer::Workers {
 public:
  Workers(const std::map<GateSide, WorkerOptions>& sides, int padding)
      : sides_(sides), padding_(padding) {}

  WorkerReply measure(GateSide side, const WorkerRequest& request) {
    std::unique_ptr<WorkerProcess>& worker = workers_[side];
    try {
      if (!worker) {
        WorkerOptions options = sides_.at(side);
        options.padding = padding_;
        worker = std::make_unique<WorkerProcess>(options);
      }
      return worker->measure(request);
    } catch (const WorkerFailure& failure) {
      worker.reset();
      WorkerReply reply;
      reply.cell = request.cell;
      reply.failure = failure.what();
      return reply;
    }
  }

 private:
  const std::map<GateSide, WorkerOptions>& sides_;
  int padding_;
  std::map<GateSide, std::unique_ptr<WorkerProcess>> workers_;
};

GateMeasurer::GateMeasurer(const GateSubject& subject, std::map<GateSide, WorkerOptions> sides,
                           const fs::path& rows)
    : subject_(subject), sides_(std::move(sides)) {
  if (fs::exists(rows)) {
    truncate_torn_tail(rows);
    runs_ = read_gate_runs(rows);
  }
  writer_.emplace(rows, gate_run_columns());
}

WorkerGreeting GateMeasurer::greeting(GateSide side) const {
  return WorkerProcess(sides_.at(side)).greeting();
}

bool GateMeasurer::done(const Wanted& wanted) const {
  return std::any_of(runs_.begin(), runs_.end(), [&](const GateRun& run) {
    return run.phase == wanted.phase && run.side == wanted.side && run.block == wanted.block &&
           run.threads == wanted.threads && run.cell == subject_.names[wanted.cell];
  });
}

void GateMeasurer::measure_picture(const fs::path& picture, std::size_t cell, GateRun& run) const {
  const Image image = read_exr(picture).image();
  fs::remove(picture);
  run.half_hash = half_hash_of(image);
  const Reference& reference = subject_.reference_of(cell);
  const ImageMetrics metrics =
      image_metrics(image.pixels, reference.halves(), subject_.config().relmse_epsilon);
  run.error = find_metric(subject_.gate.metric)->value(metrics);
  run.p_eff = metrics.p_eff;
  run.tiles = tile_means_of(image);
}

void GateMeasurer::make(const Wanted& wanted, Workers& workers) {
  if (interrupted()) throw GateInterrupted("interrupted");
  const std::string& name = subject_.names[wanted.cell];
  const fs::path picture = pictures_.path() / "run.exr";
  const std::uint64_t seed = gate_seed(subject_.config(), name, wanted.block);
  GateRun run =
      workers.measure(wanted.side, {name, seed, wanted.threads, wanted.spp, picture.string()});
  run.phase = wanted.phase;
  run.side = wanted.side;
  run.cell = name;
  run.block = wanted.block;
  run.seed = seed;
  run.threads = wanted.threads;
  // A worker that dies of an interrupt has not failed.
  if (interrupted()) throw GateInterrupted("interrupted");
  if (run.failure.empty()) measure_picture(picture, wanted.cell, run);
  writer_->append(gate_run_record(run));
  runs_.push_back(std::move(run));
}

void GateMeasurer::measure(GatePhase phase, std::span<const GateWork> work, int first, int last) {
  const int threads = resolve_threads(subject_.config().threads);
  Progress progress(fmt::format("gate, {}", to_string(phase)), last - first);
  std::optional<Workers> workers;
  bool made = false;
  for (int block = first; block < last; ++block) {
    if (block % 2 == 0 || !workers) workers.emplace(sides_, 16 * (block % 61));
    for (const auto& [cell, side] : block_order(subject_, block, work)) {
      const Wanted wanted{phase, side, cell, block, threads, 0};
      if (done(wanted)) continue;
      make(wanted, *workers);
      made = true;
    }
    progress.update(block + 1 - first);
  }
  if (made) progress.finish();
}

void GateMeasurer::check_head(std::span<const std::size_t> cells) {
  const int threads = resolve_threads(subject_.config().threads);
  Workers workers(sides_, 0);
  for (const std::size_t cell : cells) {
    const int fewest = subject_.scene_of(cell).points.camera_samples;
    for (const Wanted& wanted :
         {Wanted{GatePhase::Smoke, GateSide::Head, cell, 0, 1, fewest},
          Wanted{GatePhase::Repeat, GateSide::Head, cell, 0, threads, 0},
          Wanted{GatePhase::Repeat, GateSide::Head, cell, 0, threads == 1 ? 2 : 1, 0}}) {
      if (!done(wanted)) make(wanted, workers);
    }
  }
}

std::vector<GateRun> GateMeasurer::runs(GatePhase phase, GateSide side,
                                        const std::string& cell) const {
  std::vector<GateRun> result;
  for (const GateRun& run : runs_) {
    if (run.phase == phase && run.side == side && run.cell == cell) result.push_back(run);
  }
  return result;
}

}  // namespace penumbra
