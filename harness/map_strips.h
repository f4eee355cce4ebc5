#pragma once

#include <filesystem>
#include <string>

#include "harness/render.h"

namespace penumbra {

/// Writes an estimator's maps as pictures, one strip with a shared scale per group of maps: the
/// first group to `file`, further ones to "<stem>-2.png" and so on. Writes nothing where there are
/// no maps.
/// @param title  of the strips, above the groups' own labels
void write_map_strips(const std::filesystem::path& file, const RenderResult& result,
                      const std::string& title);

}  // namespace penumbra
