#include "harness/page/vega.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string_view>

#include "scenes/core/file_bytes.h"

namespace penumbra {
namespace {

constexpr std::string_view kScripts = "/usr/share/javascript";
constexpr std::string_view kModules = "/usr/share/nodejs";

/// In the order in which they need each other. All of them add to one object, `d3`.
constexpr std::array<std::string_view, 18> kD3{
    "internmap",      "d3-array",     "d3-collection",  "d3-color", "d3-dispatch",
    "d3-dsv",         "d3-timer",     "d3-quadtree",    "d3-force", "d3-format",
    "d3-geo",         "d3-hierarchy", "d3-interpolate", "d3-path",  "d3-time",
    "d3-time-format", "d3-scale",     "d3-shape"};

/// A module of Vega and those that it imports. Their exports share names, so each module sees only
/// its own imports.
struct VegaModule {
  std::string_view name;
  std::string_view imports;  ///< separated by blanks
  bool has_transforms{false};
};

constexpr std::array kVega{
    VegaModule{"util", ""},
    VegaModule{"expression", "util"},
    VegaModule{"event-selector", ""},
    VegaModule{"canvas", ""},
    VegaModule{"statistics", ""},
    VegaModule{"time", "util"},
    VegaModule{"format", "time util"},
    VegaModule{"loader", "format util"},
    VegaModule{"dataflow", "format loader util"},
    VegaModule{"scale", "time util"},
    VegaModule{"scenegraph", "canvas loader scale util"},
    VegaModule{"encode", "dataflow scale util", true},
    VegaModule{"selection", "expression util"},
    VegaModule{"functions", "dataflow expression scale scenegraph selection statistics time util"},
    VegaModule{"transforms", "dataflow statistics time util", true},
    VegaModule{"view-transforms", "dataflow scenegraph util", true},
    VegaModule{"runtime", "dataflow util"},
    VegaModule{"view", "dataflow event-selector format functions runtime scenegraph util"},
    VegaModule{"parser", "dataflow event-selector functions scale util"},
};

std::optional<std::string> text_of(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return std::nullopt;
  return read_bytes(file);
}

std::optional<std::string> d3_module(std::string_view name) {
  for (const char* folder : {"dist", "build"}) {
    if (auto text = text_of(fmt::format("{}/{}/{}/{}.min.js", kModules, name, folder, name))) {
      return text;
    }
  }
  return std::nullopt;
}

/// A module in a scope of its own. Its file takes imports from `vega` of the global object and
/// replaces that by its exports, which go to `exports` here; some put them at vega.transforms.
std::optional<std::string> vega_module(const VegaModule& module) {
  const auto text = text_of(fmt::format("{}/vega/vega-{}.min.js", kScripts, module.name));
  if (!text) return std::nullopt;
  constexpr std::string_view kReplaced = "self).vega={}";
  std::string isolated = *text;
  if (const std::size_t at = isolated.find(kReplaced); at != std::string::npos) {
    isolated.replace(at, kReplaced.size(), "self).exports={}");
  } else if (isolated.find(".vega.transforms={}") == std::string::npos) {
    return std::nullopt;  // built in another way
  }
  std::string imports;
  std::istringstream names{std::string(module.imports)};
  for (std::string name; names >> name;) imports += fmt::format(",vegaModules[\"{}\"]", name);
  return fmt::format(
      "(function(globalThis){{{}\n;vegaModules[\"{}\"]=globalThis.exports??globalThis.vega."
      "transforms;"
      "}}).call(undefined,"
      "{{vega:Object.assign({{}}{}),d3:d3,topojson:topojson}});\n",
      isolated, module.name, imports);
}

}  // namespace

std::string vega_script() {
  std::string script;
  for (const std::string_view name : kD3) {
    const auto text = d3_module(name);
    if (!text) return {};
    script += *text + "\n;";
  }
  const auto topojson = text_of(fmt::format("{}/topojson-client/topojson-client.min.js", kScripts));
  if (!topojson) return {};
  script += *topojson + "\n;const vegaModules={};\n";
  std::string transforms;
  for (const VegaModule& module : kVega) {
    const auto text = vega_module(module);
    if (!text) return {};
    script += *text;
    if (module.has_transforms) {
      transforms += fmt::format(
          "Object.assign(vegaModules.dataflow.transforms,vegaModules[\"{}\"]);\n", module.name);
    }
  }
  script +=
      "const vega=Object.assign({},vegaModules.runtime,vegaModules.view,vegaModules.parser);\n";
  return script + transforms;
}

}  // namespace penumbra
