#include "harness/gate/worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <istream>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>

#include "harness/build_info.h"
#include "harness/experiment.h"
#include "harness/exr.h"
#include "harness/gate/gate_cells.h"
#include "harness/gate/protocol.h"
#include "harness/reference.h"
#include "harness/render.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

class Worker {
 public:
  explicit Worker(ExperimentConfig config)
      : experiment_(std::move(config), {}),
        names_(gate_cell_names(experiment_.config(), experiment_.cells())) {}

  WorkerGreeting greeting() const {
    WorkerGreeting greeting;
    greeting.machine = machine_text();
    greeting.build = build_json().dump();
    greeting.cells = names_;
    for (const LoadedScene& scene : experiment_.scenes()) {
      greeting.references.emplace(scene.config->name, reference_id(scene));
    }
    return greeting;
  }

  WorkerReply answer(const WorkerRequest& request) {
    const auto found = std::find(names_.begin(), names_.end(), request.cell);
    if (found == names_.end()) {
      throw RunError(fmt::format("the config has no cell \"{}\"", request.cell));
    }
    Cell cell = experiment_.cells()[static_cast<std::size_t>(found - names_.begin())];
    if (request.spp > 0) cell.spp = request.spp;
    warm_up(cell, request);
    const LoadedScene& scene = scene_of(cell);
    const RenderResult result =
        render(*scene.scene, scene.points, render_settings(cell, request.seed, request.threads));
    if (!request.image.empty()) write_exr(request.image, {{"", result.image()}});
    return reply_of(request, result);
  }

 private:
  const LoadedScene& scene_of(const Cell& cell) const { return experiment_.scenes()[cell.scene]; }

  // The first run of a process pays for caches, thread pool and clock frequency.
  void warm_up(const Cell& cell, const WorkerRequest& request) {
    if (!warm_.insert(cell.scene).second) return;
    const LoadedScene& scene = scene_of(cell);
    render(*scene.scene, scene.points, render_settings(cell, request.seed + 1, request.threads));
  }

  static WorkerReply reply_of(const WorkerRequest& request, const RenderResult& result) {
    WorkerReply reply;
    reply.cell = request.cell;
    reply.image_hash = result.radiance_hash();
    reply.estimates = result.counters.estimates;
    reply.samples = result.counters.samples;
    reply.rays = result.counters.rays;
    reply.lit = result.counters.lit;
    reply.iterations = result.counters.iterations;
    if (result.instructions > 0) reply.instructions = result.instructions;
    reply.time_cpu_s = result.time_cpu_s;
    reply.time_wall_s = result.time_wall_s;
    if (result.bad_count > 0) {
      reply.failure = fmt::format("{} estimates not finite or negative, the first: {}",
                                  result.bad_count, describe(result.bad.front()));
    } else if (result.counters.uncovered > 0) {
      reply.failure = fmt::format("{} samples without density", result.counters.uncovered);
    } else if (result.counters.untraced > 0) {
      reply.failure =
          fmt::format("{} rays not finite or without a direction", result.counters.untraced);
    }
    return reply;
  }

  Experiment experiment_;
  std::vector<std::string> names_;  // of its cells
  std::set<std::size_t> warm_;      // scenes
};

}  // namespace

void refuse_budget(const ExperimentConfig& config) {
  if (!config.budget) return;
  throw InputError(config.file.string() +
                   ": /budget: a gate compares equal numbers of samples: found a time budget, "
                   "expected spp and srl only");
}

void serve_gate(ExperimentConfig config, std::istream& requests, std::ostream& replies) {
  refuse_budget(config);
  Worker worker(std::move(config));
  replies << to_line(worker.greeting()) << std::flush;
  std::string line;
  while (std::getline(requests, line)) {
    replies << to_line(worker.answer(read_request(line))) << std::flush;
    if (!replies) throw RunError("the gate does not listen any more");
  }
}

}  // namespace penumbra
