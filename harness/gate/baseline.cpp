#include "harness/gate/baseline.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "harness/atomic_file.h"
#include "scenes/core/error.h"

namespace penumbra {

using nlohmann::json;
using nlohmann::ordered_json;
namespace fs = std::filesystem;

namespace {

constexpr int kVersion = 1;
constexpr std::size_t kReasonsKept = 20;

fs::path file_of(const fs::path& folder, const std::string& scene) {
  return folder / (scene + ".json");
}

// One list per column, so that a cell takes few lines of a diff.
template <class T>
void put_column(ordered_json& cell, const char* name, const std::vector<GateRun>& runs,
                T GateRun::*member) {
  ordered_json column = ordered_json::array();
  for (const GateRun& run : runs) {
    if constexpr (std::is_same_v<T, std::optional<double>>) {
      column.push_back(run.*member ? ordered_json(*(run.*member)) : ordered_json(nullptr));
    } else {
      column.push_back(run.*member);
    }
  }
  cell[name] = std::move(column);
}

template <class T>
void take_column(const json& cell, const char* name, std::vector<GateRun>& runs,
                 T GateRun::*member) {
  const json& column = cell.at(name);
  if (column.size() != runs.size()) {
    throw ReferenceError(
        fmt::format("{} values of \"{}\", expected {}", column.size(), name, runs.size()));
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if constexpr (std::is_same_v<T, std::optional<double>>) {
      if (!column[i].is_null()) runs[i].*member = column[i].get<double>();
    } else {
      runs[i].*member = column[i].get<T>();
    }
  }
}

ordered_json cell_json(const std::string& id, const std::vector<GateRun>& runs) {
  ordered_json cell;
  cell["id"] = id;
  put_column(cell, "block", runs, &GateRun::block);
  put_column(cell, "seed", runs, &GateRun::seed);
  put_column(cell, "image_hash", runs, &GateRun::image_hash);
  put_column(cell, "half_hash", runs, &GateRun::half_hash);
  put_column(cell, "estimates", runs, &GateRun::estimates);
  put_column(cell, "samples", runs, &GateRun::samples);
  put_column(cell, "rays", runs, &GateRun::rays);
  put_column(cell, "lit", runs, &GateRun::lit);
  put_column(cell, "iterations", runs, &GateRun::iterations);
  put_column(cell, "error", runs, &GateRun::error);
  put_column(cell, "p_eff", runs, &GateRun::p_eff);
  return cell;
}

std::vector<GateRun> runs_of(const std::string& name, const json& cell) {
  std::vector<GateRun> runs(cell.at("block").size());
  for (GateRun& run : runs) {
    run.side = GateSide::Base;
    run.cell = name;
  }
  take_column(cell, "block", runs, &GateRun::block);
  take_column(cell, "seed", runs, &GateRun::seed);
  take_column(cell, "image_hash", runs, &GateRun::image_hash);
  take_column(cell, "half_hash", runs, &GateRun::half_hash);
  take_column(cell, "estimates", runs, &GateRun::estimates);
  take_column(cell, "samples", runs, &GateRun::samples);
  take_column(cell, "rays", runs, &GateRun::rays);
  take_column(cell, "lit", runs, &GateRun::lit);
  take_column(cell, "iterations", runs, &GateRun::iterations);
  take_column(cell, "error", runs, &GateRun::error);
  take_column(cell, "p_eff", runs, &GateRun::p_eff);
  return runs;
}

// A column on one line, so that a diff shows which one changed.
std::string with_columns_on_a_line(const std::string& text) {
  std::string result;
  bool in_column = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '[') in_column = text.find_first_of("[]{", i + 1) == text.find(']', i + 1);
    if (c == ']') in_column = false;
    if (c != '\n' || !in_column) {
      result += c;
      continue;
    }
    i = text.find_first_not_of(' ', i + 1) - 1;
    if (result.back() == ',') result += ' ';
  }
  return result;
}

json read_document(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  json document = json::parse(stream, nullptr, false);
  return document.is_object() ? document : json::object();
}

void read_scene(const fs::path& folder, const GateSubject& subject, std::size_t scene,
                Baseline& baseline) {
  const Experiment& experiment = *subject.experiment;
  const std::string& name = experiment.scenes()[scene].config->name;
  const fs::path file = file_of(folder, name);
  const std::string make = "; make it by `penumbra baseline update --reason TEXT`";
  if (!fs::exists(file)) {
    throw ReferenceError(
        fmt::format("{}: there is no baseline of scene \"{}\"{}", file.string(), name, make));
  }
  const json document = read_document(file);
  try {
    const auto check = [&](const char* key, const json& allowed) {
      if (document.at(key) == allowed) return;
      throw ReferenceError(fmt::format("{} is {}, expected {}{}", key, document.at(key).dump(),
                                       allowed.dump(), make));
    };
    check("schema", "penumbra-baseline");
    check("version", kVersion);
    check("config", subject.config().name);
    check("metric", subject.gate.metric);
    check("reference", subject.references[scene]->id);
    baseline.build = document.at("build").dump();
    baseline.machine = document.at("machine").get<std::string>();
    const json& cells = document.at("cells");
    for (std::size_t c = 0; c < subject.names.size(); ++c) {
      const Cell& cell = experiment.cells()[c];
      if (cell.scene != scene) continue;
      const auto found = cells.find(subject.names[c]);
      if (found == cells.end()) {
        baseline.missing.push_back(subject.names[c]);
        continue;
      }
      if (found->at("id") != cell.id) {
        throw ReferenceError(fmt::format("cell \"{}\" was measured with other parameters{}",
                                         subject.names[c], make));
      }
      for (GateRun& run : runs_of(subject.names[c], *found)) {
        baseline.runs.push_back(std::move(run));
      }
    }
  } catch (const json::exception& e) {
    throw ReferenceError(fmt::format("{}: is no baseline: {}{}", file.string(), e.what(), make));
  } catch (const ReferenceError& e) {
    throw ReferenceError(fmt::format("{}: {}", file.string(), e.what()));
  }
}

}  // namespace

Baseline read_baseline(const fs::path& folder, const GateSubject& subject) {
  Baseline baseline;
  for (std::size_t scene = 0; scene < subject.references.size(); ++scene) {
    read_scene(folder, subject, scene, baseline);
  }
  return baseline;
}

void write_baseline(const fs::path& folder, const GateSubject& subject,
                    const std::vector<GateRun>& runs, const WorkerGreeting& greeting,
                    const std::string& reason) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw RunError(folder.string() + ": cannot be created: " + error.message());
  const json build = json::parse(greeting.build);
  const std::string date =
      fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::chrono::system_clock::now()));
  const Experiment& experiment = *subject.experiment;
  for (std::size_t scene = 0; scene < subject.references.size(); ++scene) {
    const fs::path file = file_of(folder, experiment.scenes()[scene].config->name);
    ordered_json document;
    document["schema"] = "penumbra-baseline";
    document["version"] = kVersion;
    document["config"] = subject.config().name;
    document["metric"] = subject.gate.metric;
    document["scene"] = experiment.scenes()[scene].config->name;
    document["reference"] = subject.references[scene]->id;
    document["build"] = build;
    document["machine"] = greeting.machine;
    ordered_json reasons = ordered_json::array();
    const json before = read_document(file);
    if (before.contains("reasons") && before["reasons"].is_array()) {
      const json& known = before["reasons"];
      const std::size_t first = known.size() < kReasonsKept ? 0 : known.size() - kReasonsKept + 1;
      for (std::size_t i = first; i < known.size(); ++i) reasons.push_back(ordered_json(known[i]));
    }
    reasons.push_back({{"date", date}, {"commit", build.value("commit", "")}, {"reason", reason}});
    document["reasons"] = std::move(reasons);
    document["cells"] = ordered_json::object();
    for (std::size_t c = 0; c < subject.names.size(); ++c) {
      if (experiment.cells()[c].scene != scene) continue;
      std::vector<GateRun> of_cell;
      for (const GateRun& run : runs) {
        if (run.cell == subject.names[c]) of_cell.push_back(run);
      }
      document["cells"][subject.names[c]] = cell_json(experiment.cells()[c].id, of_cell);
    }
    write_file_atomically(file, with_columns_on_a_line(document.dump(1)) + "\n");
  }
}

}  // namespace penumbra
