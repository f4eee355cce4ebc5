#include "harness/map_strips.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "harness/picture.h"

namespace penumbra {
namespace {

// "alpha_left" as "α_{left}", the way the paper writes it, "p_left" likewise; other names as words.
std::string caption_of(const std::string& map_name) {
  for (const auto& [prefix, symbol] :
       {std::pair<std::string, std::string>{"alpha_", "α"}, {"p_", "P"}}) {
    if (map_name.rfind(prefix, 0) != 0) continue;
    const std::string component = map_name.substr(prefix.size());
    return symbol + "_{" + (component == "bsdf" ? "BRDF" : component) + "}";
  }
  std::string words = map_name;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

}  // namespace

void write_map_strips(const std::filesystem::path& file, const RenderResult& result,
                      const std::string& title) {
  int strips = 0;
  for (std::size_t first = 0; first < result.maps.size();) {
    const MapInfo& info = result.map_infos[first];
    std::vector<Panel> panels;
    std::size_t m = first;
    for (; m < result.maps.size() && result.map_infos[m].group == info.group; ++m) {
      panels.push_back({caption_of(result.map_infos[m].name), result.maps[m]});
    }
    StripStyle style;
    style.scale.min = 0.0f;
    style.scale.max = info.max;
    style.scale.label = info.group;
    std::filesystem::path path = file;
    if (++strips > 1) {
      path.replace_filename(
          fmt::format("{}-{}{}", file.stem().string(), strips, file.extension().string()));
    }
    write_png_strip(path, panels, title, style);
    first = m;
  }
}

}  // namespace penumbra
