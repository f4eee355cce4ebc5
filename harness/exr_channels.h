#pragma once

#include <ImfForward.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "harness/exr.h"

/// How layers become channels of an EXR file; shared by its reader and writer.
namespace penumbra {

/// Attribute keys with a meaning of their own inside OpenEXR that a fresh header does not hold.
bool is_reserved_key(std::string_view key);

/// The part of a channel's or layer's name after its last dot.
std::string last_part(const std::string& name);

/// Whether a last part is R, G or B, which only RGB layers may use.
bool is_rgb_name(const std::string& part);

/// The name of one channel of an RGB layer.
/// @param channel  "R", "G" or "B"
std::string channel_name(const std::string& layer, const char* channel);

/// The names of the channels of a layer.
std::vector<std::string> channel_names(const ExrLayer& layer);

/// Points a frame buffer at the pixels of a layer, for reading or writing in place.
/// @param origin_x, origin_y  upper left corner of the data window, which the first pixel stands
/// for
void add_slices(Imf::FrameBuffer& frame, const ExrLayer& layer, int origin_x, int origin_y);

}  // namespace penumbra
