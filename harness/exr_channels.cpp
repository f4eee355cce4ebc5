#include "harness/exr_channels.h"

#include <ImfFrameBuffer.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <type_traits>
#include <variant>

namespace penumbra {
namespace {

/// The float channels of one layer, in place: name, first float, floats from pixel to pixel.
struct ChannelView {
  std::string name;
  const float* first;
  std::size_t stride;
};

std::vector<ChannelView> channels_of(const ExrLayer& layer) {
  static_assert(sizeof(Rgb) == 3 * sizeof(float) && std::is_standard_layout_v<Rgb>);
  if (const auto* scalar = std::get_if<ScalarImage>(&layer.content)) {
    return {{layer.name, scalar->pixels.data(), 1}};
  }
  const Rgb& pixel = std::get<Image>(layer.content).pixels.front();
  return {{channel_name(layer.name, "R"), &pixel.x, 3},
          {channel_name(layer.name, "G"), &pixel.y, 3},
          {channel_name(layer.name, "B"), &pixel.z, 3}};
}

}  // namespace

bool is_reserved_key(std::string_view key) {
  constexpr std::array<std::string_view, 8> kKeys{
      "name", "type", "view", "version", "chunkCount", "maxSamplesPerPixel", "tiles", "preview"};
  return std::find(kKeys.begin(), kKeys.end(), key) != kKeys.end();
}

std::string last_part(const std::string& name) { return name.substr(name.rfind('.') + 1); }
bool is_rgb_name(const std::string& part) { return part == "R" || part == "G" || part == "B"; }

std::string channel_name(const std::string& layer, const char* channel) {
  return layer.empty() ? channel : layer + "." + channel;
}

std::vector<std::string> channel_names(const ExrLayer& layer) {
  std::vector<std::string> names;
  for (ChannelView& channel : channels_of(layer)) names.push_back(std::move(channel.name));
  return names;
}

void add_slices(Imf::FrameBuffer& frame, const ExrLayer& layer, int origin_x, int origin_y) {
  const int width = std::visit([](const auto& p) { return p.width; }, layer.content);
  for (const ChannelView& channel : channels_of(layer)) {
    const std::size_t x_stride = channel.stride * sizeof(float);
    const std::size_t y_stride = x_stride * static_cast<std::size_t>(width);
    // Modular arithmetic on an integer: the address of pixel (0, 0) may lie outside of the array.
    const auto base = reinterpret_cast<std::uintptr_t>(channel.first) -
                      static_cast<std::uintptr_t>(std::intptr_t{origin_x}) * x_stride -
                      static_cast<std::uintptr_t>(std::intptr_t{origin_y}) * y_stride;
    frame.insert(channel.name,
                 Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(base), x_stride, y_stride));
  }
}

}  // namespace penumbra
