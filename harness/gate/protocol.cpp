#include "harness/gate/protocol.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "scenes/core/error.h"

namespace penumbra {

using nlohmann::json;
using nlohmann::ordered_json;

namespace {

// A value or, of a run that failed, nothing.
template <class T>
ordered_json or_null(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

template <class T>
std::optional<T> optional_of(const json& value) {
  if (value.is_null()) return std::nullopt;
  return value.get<T>();
}

json parse_line(std::string_view line, const char* what) {
  json value = json::parse(line, nullptr, false);
  if (!value.is_object()) {
    throw RunError(fmt::format("{}: expected a JSON object in one line, found \"{}\"", what,
                               line.substr(0, 200)));
  }
  return value;
}

// Names a member that is missing or of another type.
template <class Read>
auto read_members(std::string_view line, const char* what, Read read) {
  const json value = parse_line(line, what);
  try {
    return read(value);
  } catch (const json::exception& e) {
    throw RunError(fmt::format("{}: {}", what, e.what()));
  }
}

}  // namespace

std::string to_line(const WorkerGreeting& greeting) {
  ordered_json line;
  line["penumbra_worker"] = kProtocolVersion;
  line["machine"] = greeting.machine;
  line["build"] = greeting.build;
  line["references"] = greeting.references;
  line["cells"] = greeting.cells;
  return line.dump() + "\n";
}

std::string to_line(const WorkerRequest& request) {
  const ordered_json line = {{"cell", request.cell},
                             {"seed", request.seed},
                             {"threads", request.threads},
                             {"spp", request.spp},
                             {"image", request.image}};
  return line.dump() + "\n";
}

std::string to_line(const WorkerReply& reply) {
  const ordered_json line = {{"cell", reply.cell},
                             {"image_hash", reply.image_hash},
                             {"estimates", reply.estimates},
                             {"samples", reply.samples},
                             {"rays", reply.rays},
                             {"lit", reply.lit},
                             {"iterations", reply.iterations},
                             {"instructions", or_null(reply.instructions)},
                             {"time_cpu_s", or_null(reply.time_cpu_s)},
                             {"time_wall_s", or_null(reply.time_wall_s)},
                             {"failure", reply.failure}};
  return line.dump() + "\n";
}

WorkerGreeting read_greeting(std::string_view line) {
  return read_members(line, "greeting of a worker", [](const json& value) {
    const int version = value.at("penumbra_worker").get<int>();
    if (version != kProtocolVersion) {
      throw ReferenceError(fmt::format("it speaks version {} of the gate's protocol, allowed is {}",
                                       version, kProtocolVersion));
    }
    WorkerGreeting greeting;
    greeting.machine = value.at("machine").get<std::string>();
    greeting.build = value.at("build").get<std::string>();
    greeting.references = value.at("references").get<std::map<std::string, std::string>>();
    greeting.cells = value.at("cells").get<std::vector<std::string>>();
    return greeting;
  });
}

WorkerRequest read_request(std::string_view line) {
  return read_members(line, "request to a worker", [](const json& value) {
    return WorkerRequest{value.at("cell").get<std::string>(), value.at("seed").get<std::uint64_t>(),
                         value.at("threads").get<int>(), value.at("spp").get<int>(),
                         value.at("image").get<std::string>()};
  });
}

WorkerReply read_reply(std::string_view line) {
  return read_members(line, "reply of a worker", [](const json& value) {
    WorkerReply reply;
    reply.cell = value.at("cell").get<std::string>();
    reply.image_hash = value.at("image_hash").get<std::string>();
    reply.estimates = value.at("estimates").get<std::uint64_t>();
    reply.samples = value.at("samples").get<std::uint64_t>();
    reply.rays = value.at("rays").get<std::uint64_t>();
    reply.lit = value.at("lit").get<std::uint64_t>();
    reply.iterations = value.at("iterations").get<std::uint64_t>();
    reply.instructions = optional_of<std::uint64_t>(value.at("instructions"));
    reply.time_cpu_s = optional_of<double>(value.at("time_cpu_s"));
    reply.time_wall_s = optional_of<double>(value.at("time_wall_s"));
    reply.failure = value.at("failure").get<std::string>();
    return reply;
  });
}

}  // namespace penumbra
