#include <fmt/format.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "harness/atomic_file.h"
#include "harness/build_info.h"
#include "harness/experiment.h"
#include "harness/row_parts.h"
#include "scenes/core/error.h"

/// The part of Experiment that opens the folder of the results, and checks that it and the ranks
/// can take this run.
namespace penumbra {
namespace {

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

// "rank 1 on host b: "...""; of several values that should be one.
std::string listed(const RankPlaces& places, const std::vector<std::string>& values) {
  std::string text;
  for (std::size_t r = 0; r < values.size(); ++r) {
    text += fmt::format("{}rank {} on host {}: \"{}\"", r > 0 ? ", " : "", r, places.ranks[r].host,
                        values[r]);
  }
  return text;
}

bool differ(const std::vector<std::string>& values) {
  return std::set<std::string>(values.begin(), values.end()).size() > 1;
}

// Files of other hosts may show up a little later than they were written.
bool shows_up(const std::filesystem::path& file, const std::string& content) {
  constexpr int kTries = 50;
  for (int i = 0; i < kTries; ++i) {
    if (read_text(file) == content) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

// Every rank has to see what the root writes.
void check_folder_is_shared(const Ranks& ranks, const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / ".ranks";
  const std::string content = ranks.from_root(fmt::format(
      "{} {}", host_name(), std::chrono::system_clock::now().time_since_epoch().count()));
  if (ranks.is_root()) write_file_atomically(file, content);
  ranks.barrier();
  if (!shows_up(file, content)) {
    throw RunError(
        std::filesystem::absolute(folder).string() +
        ": the root's files are not seen here; ranks need a file system that they share");
  }
  ranks.barrier();
  if (ranks.is_root()) std::filesystem::remove(file);
}

}  // namespace

// A folder may go on with a changed config: cells that are still in it keep their rows. Another
// experiment's results stay as they are.
void Experiment::open_folder() {
  check_ranks();
  if (ranks_.is_root()) {
    std::error_code error;
    std::filesystem::create_directories(options_.out / "images", error);
    if (error) throw RunError(options_.out.string() + ": cannot be created: " + error.message());
    const std::filesystem::path resolved = options_.out / "config.resolved.json";
    const std::string before = read_text(resolved);
    if (!before.empty()) {
      const nlohmann::json config = nlohmann::json::parse(before, nullptr, false);
      const auto name_at = config.is_object() ? config.find("name") : config.end();
      if (name_at == config.end() || !name_at->is_string()) {
        throw InputError(resolved.string() +
                         ": is not the config of a run; use another --out or remove the folder");
      }
      const std::string name = name_at->get<std::string>();
      if (name != config_.name) {
        throw InputError(options_.out.string() + ": holds the results of another experiment, \"" +
                         name +
                         "\" (config.resolved.json); use another --out or remove the folder");
      }
    }
    // Rows of ranks that were stopped.
    join_row_parts(options_.out);
    if (before != config_.resolved_json) write_file_atomically(resolved, config_.resolved_json);
    const std::filesystem::path stage_table = options_.out / "stages.csv";
    if (std::filesystem::exists(stage_table)) stage_rows_ = read_stage_rows(stage_table);
  }
  if (ranks_.count() > 1) check_folder_is_shared(ranks_, options_.out);
  write_environment();
}

void Experiment::write_environment() const {
  Session session{threads_, options_.command_line, config_.resolved_json, {}, places_.ranks, {}};
  if (!options_.shard.is_all()) {
    session.shard = fmt::format("{}/{}", options_.shard.index + 1, options_.shard.count);
  }
  const std::vector<std::string> names = ranks_.gather(machine_text());
  const std::vector<std::string> machines = ranks_.gather(machine_json());
  for (std::size_t r = 0; r < names.size(); ++r) session.machines[names[r]] = machines[r];
  if (!ranks_.is_root()) return;
  const std::filesystem::path file = options_.out / "environment.json";
  write_file_atomically(file, environment_json(session, read_text(file)));
}

// Rows of one run come from one build, and times that are compared from one machine.
void Experiment::check_ranks() const {
  const std::vector<std::string> builds = ranks_.gather(build_id());
  if (differ(builds)) {
    throw ReferenceError("ranks have programs of different builds: " + listed(places_, builds));
  }
  const std::vector<std::string> machines = ranks_.gather(machine_text());
  if (config_.budget && differ(machines)) {
    throw ReferenceError(
        "a time budget is calibrated for one machine, but the ranks have several: " +
        listed(places_, machines));
  }
}

}  // namespace penumbra
