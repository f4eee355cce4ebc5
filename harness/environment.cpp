#include <fmt/chrono.h>
#include <fmt/format.h>
#include <oneapi/tbb/version.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <ImathConfig.h>
#include <OpenEXRConfig.h>

#include <boost/version.hpp>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "harness/build_info.h"
#include "harness/keys.h"
#include "harness/render.h"
#include "scenes/core/ray_batch.h"

namespace penumbra {
namespace {

// First "key : value" of a /proc file; empty when there is none.
std::string proc_value(const char* file, const std::string& key) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (line.rfind(key, 0) != 0) continue;
    const std::size_t colon = line.find(':');
    return colon == std::string::npos ? "" : line.substr(line.find_first_not_of(" \t", colon + 1));
  }
  return {};
}

std::string first_line(const char* file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

nlohmann::ordered_json libraries_json() {
  return {{"ray_tracing", RayScene::version()},
          {"tbb", TBB_runtime_version()},
          {"openexr", OPENEXR_VERSION_STRING},
          {"imath", IMATH_VERSION_STRING},
          {"boost", BOOST_LIB_VERSION},
          {"fmt", FMT_VERSION},
          {"nlohmann_json", fmt::format("{}.{}.{}", NLOHMANN_JSON_VERSION_MAJOR,
                                        NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH)}};
}

// Without the id.
nlohmann::ordered_json switches_json() {
  const BuildInfo& build = build_info();
  return {{"version", build.version}, {"commit", build.commit}, {"compiler", build.compiler},
          {"flags", build.flags},     {"preset", build.preset}, {"build_type", build.build_type},
          {"arch", build.arch},       {"march", build.march},   {"sanitize", build.sanitize},
          {"embree", build.embree},   {"ipo", build.ipo},       {"fuzz", build.fuzz},
          {"asserts", build.asserts}};
}

// A member of earlier text, or an empty value where there is none of that kind.
nlohmann::ordered_json kept(const nlohmann::ordered_json& earlier, const char* name,
                            nlohmann::ordered_json empty) {
  if (!earlier.is_object() || !earlier.contains(name)) return empty;
  return earlier[name].type() == empty.type() ? earlier[name] : empty;
}

// A command line may be any bytes.
constexpr auto kAnyBytes = nlohmann::ordered_json::error_handler_t::replace;

nlohmann::ordered_json current_machine_json() {
  utsname system{};
  uname(&system);
  return {{"cpu", proc_value("/proc/cpuinfo", "model name")},
          {"microcode", proc_value("/proc/cpuinfo", "microcode")},
          {"cores", std::thread::hardware_concurrency()},
          {"memory", proc_value("/proc/meminfo", "MemTotal")},
          {"kernel", std::string(system.sysname) + " " + system.release},
          {"governor", first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")}};
}

nlohmann::ordered_json session_json(const Session& session, const std::string& load) {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  nlohmann::ordered_json json = {{"started", fmt::format("{:%FT%TZ}", now)},
                                 {"commit", build_info().commit},
                                 {"build", build_id()},
                                 {"command_line", session.command_line},
                                 {"threads", session.threads},
                                 {"load_average", load},
                                 {"machine", machine_text()},
                                 {"host", host_name()}};
  if (!session.shard.empty()) json["shard"] = session.shard;
  for (const RankPlace& place : session.ranks) {
    json["ranks"].push_back({{"rank", place.rank},
                             {"host", place.host},
                             {"cpus", place.cpus},
                             {"pinned_by", place.pinned_by.empty() ? "none" : place.pinned_by}});
  }
  return json;
}

// This build and machine, the sessions of earlier calls and this one.
nlohmann::ordered_json environment_of(const Session& session,
                                      const std::vector<std::string>& earlier) {
  using nlohmann::ordered_json;
  const std::string load = first_line("/proc/loadavg");
  ordered_json json;
  json["penumbra"] = build_json();
  json["libraries"] = libraries_json();
  json["machine"] = current_machine_json();
  json["machine"]["load_average"] = load;
  {
    const DenormalMode mode(RenderSettings{}.denormals);
    json["denormals"] = DenormalMode::text();
  }
  json["threads"] = session.threads;
  json["command_line"] = session.command_line;
  json["config_hash"] = hash_id({"config", session.config});
  json["builds"] = ordered_json::object();
  json["machines"] = ordered_json::object();
  json["sessions"] = ordered_json::array();
  for (const std::string& text : earlier) {
    const ordered_json part = ordered_json::parse(text, nullptr, false);
    json["builds"].update(kept(part, "builds", ordered_json::object()));
    json["machines"].update(kept(part, "machines", ordered_json::object()));
    for (const ordered_json& entry : kept(part, "sessions", ordered_json::array())) {
      json["sessions"].push_back(entry);
    }
  }
  json["builds"][build_id()] = switches_json();
  json["machines"][machine_text()] = current_machine_json();
  for (const auto& [name, text] : session.machines) {
    json["machines"][name] = ordered_json::parse(text, nullptr, false);
  }
  json["sessions"].push_back(session_json(session, load));
  return json;
}

}  // namespace

std::string build_id() { return hash_id({"build", switches_json().dump()}); }

nlohmann::ordered_json build_json() {
  nlohmann::ordered_json json = {{"build", build_id()}};
  json.update(switches_json());
  return json;
}

std::string machine_text() {
  return fmt::format("{}, {} cores", proc_value("/proc/cpuinfo", "model name"),
                     std::thread::hardware_concurrency());
}

std::string machine_json() { return current_machine_json().dump(); }

std::string environment_json(const Session& session, const std::string& before) {
  return environment_of(session, {before}).dump(2, ' ', false, kAnyBytes) + "\n";
}

std::string joined_environment(const std::vector<std::string>& parts, const Session& session) {
  return environment_of(session, parts).dump(2, ' ', false, kAnyBytes) + "\n";
}

}  // namespace penumbra
