#include "harness/mpi_ranks.h"

#include <cstdlib>

#include "scenes/core/error.h"

#ifdef PENUMBRA_HAS_MPI
#include <mpi.h>

#include <chrono>
#include <numeric>
#include <thread>
#endif

namespace penumbra {
namespace {

// What the launchers of Open MPI, MPICH and Slurm tell their processes. A job's own variables
// (SLURM_PROCID) do not count: a batch script has them without any launcher.
bool has_launcher() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMI_RANK", "PMIX_RANK"}) {
    if (std::getenv(name) != nullptr) return true;
  }
  return false;
}

#ifdef PENUMBRA_HAS_MPI

// MPI's own waiting takes a whole core.
void wait_asleep(MPI_Request request) {
  constexpr int kTriesAwake = 100;
  for (int tries = 0;; ++tries) {
    int done = 0;
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done != 0) return;
    if (tries > kTriesAwake) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

#else

int launched_processes() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
    if (const char* text = std::getenv(name)) return std::atoi(text);
  }
  return 1;
}

#endif

}  // namespace

const Ranks& single_rank() {
  static const Ranks kSingle;
  return kSingle;
}

#ifdef PENUMBRA_HAS_MPI

Ranks::Ranks(Launched) : launched_(has_launcher()) {
  if (!launched_) return;
  // Only the main thread calls MPI.
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &count_);
}

Ranks::~Ranks() {
  if (launched_) MPI_Finalize();
}

void Ranks::barrier() const {
  if (count_ == 1) return;
  MPI_Request request;
  MPI_Ibarrier(MPI_COMM_WORLD, &request);
  wait_asleep(request);
}

std::string Ranks::from_root(const std::string& text) const {
  if (count_ == 1) return text;
  MPI_Request request;
  auto size = static_cast<int>(text.size());
  MPI_Ibcast(&size, 1, MPI_INT, 0, MPI_COMM_WORLD, &request);
  wait_asleep(request);
  std::string result = is_root() ? text : std::string(static_cast<std::size_t>(size), '\0');
  MPI_Ibcast(result.data(), size, MPI_CHAR, 0, MPI_COMM_WORLD, &request);
  wait_asleep(request);
  return result;
}

std::vector<std::string> Ranks::gather(const std::string& text) const {
  if (count_ == 1) return {text};
  MPI_Request request;
  const auto size = static_cast<int>(text.size());
  std::vector<int> sizes(static_cast<std::size_t>(count_));
  MPI_Iallgather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, MPI_COMM_WORLD, &request);
  wait_asleep(request);
  std::vector<int> starts(sizes.size());
  std::exclusive_scan(sizes.begin(), sizes.end(), starts.begin(), 0);
  std::string all(static_cast<std::size_t>(starts.back() + sizes.back()), '\0');
  MPI_Iallgatherv(text.data(), size, MPI_CHAR, all.data(), sizes.data(), starts.data(), MPI_CHAR,
                  MPI_COMM_WORLD, &request);
  wait_asleep(request);
  std::vector<std::string> texts;
  for (std::size_t r = 0; r < sizes.size(); ++r) {
    texts.push_back(
        all.substr(static_cast<std::size_t>(starts[r]), static_cast<std::size_t>(sizes[r])));
  }
  return texts;
}

void Ranks::sum_to_root(std::span<double> values) const {
  if (count_ == 1) return;
  MPI_Request request;
  const auto count = static_cast<int>(values.size());
  if (is_root()) {
    MPI_Ireduce(MPI_IN_PLACE, values.data(), count, MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD,
                &request);
  } else {
    MPI_Ireduce(values.data(), nullptr, count, MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD, &request);
  }
  wait_asleep(request);
}

void Ranks::abort(int exit_code) const {
  if (launched_) MPI_Abort(MPI_COMM_WORLD, exit_code);
}

#else

Ranks::Ranks(Launched) : launched_(has_launcher()) {
  if (!launched_ || launched_processes() <= 1) return;
  throw InputError(
      "started as one of " + std::to_string(launched_processes()) +
      " processes, but this program was built without MPI: `scripts/setup --mpi`, then configure "
      "with -DPENUMBRA_MPI=ON; or split the work with --shard");
}

Ranks::~Ranks() = default;
void Ranks::barrier() const {}
std::string Ranks::from_root(const std::string& text) const { return text; }
std::vector<std::string> Ranks::gather(const std::string& text) const { return {text}; }
void Ranks::sum_to_root(std::span<double>) const {}
void Ranks::abort(int) const {}

#endif

}  // namespace penumbra
