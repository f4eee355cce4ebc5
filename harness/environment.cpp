#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "harness/build_info.h"
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

}  // namespace

std::string machine_text() {
  return fmt::format("{}, {} cores", proc_value("/proc/cpuinfo", "model name"),
                     std::thread::hardware_concurrency());
}

std::string environment_json(int threads, const std::string& command_line) {
  utsname system{};
  uname(&system);
  const BuildInfo& build = build_info();
  nlohmann::json json;
  json["penumbra"] = {{"version", build.version},       {"commit", build.commit},
                      {"compiler", build.compiler},     {"flags", build.flags},
                      {"build_type", build.build_type}, {"asserts", build.asserts}};
  json["libraries"] = {{"ray_tracing", RayScene::version()}};
  json["machine"] = {
      {"cpu", proc_value("/proc/cpuinfo", "model name")},
      {"microcode", proc_value("/proc/cpuinfo", "microcode")},
      {"cores", std::thread::hardware_concurrency()},
      {"memory", proc_value("/proc/meminfo", "MemTotal")},
      {"kernel", std::string(system.sysname) + " " + system.release},
      {"governor", first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")},
      {"load_average", first_line("/proc/loadavg")}};
  json["threads"] = threads;
  json["command_line"] = command_line;
  return json.dump(2) + "\n";
}

}  // namespace penumbra
