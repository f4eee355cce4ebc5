#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "harness/config.h"
#include "harness/exr.h"
#include "harness/metrics.h"
#include "harness/render.h"
#include "harness/scene_store.h"

/// References: the truth of a scene's shading points as two independent halves, found by a hash of
/// everything that decides it, and extendable.
namespace penumbra {

/// A reference as read from its file.
struct Reference {
  std::string id;  ///< hash of what decides the truth
  std::filesystem::path file;
  int spp{0};            ///< estimates per pixel, both halves together
  Image half_a, half_b;  ///< [y][x], radiance without the emission of lights seen directly

  ReferenceHalves halves() const { return {half_a.pixels, half_b.pixels}; }
};

/// Hash of all that decides the truth: scene content and resolution, camera samples, quantity, core
/// version. How the reference was sampled does not take part.
std::string reference_id(const LoadedScene& scene);

/// How a reference is rendered: one pass with one estimate per camera sample.
RenderSettings reference_settings(const LoadedScene& scene, int threads);

/// Where references are looked for: references/small/ (in git), then references/ (a cache).
std::optional<std::filesystem::path> find_reference_file(const std::string& scene_name,
                                                         const std::string& id);

/// Reads a reference and checks that it is what its name says.
/// @throws ReferenceError when it belongs to something else or lacks a half, RunError when it can
/// not be read
Reference read_reference(const std::filesystem::path& file, const std::string& id);

/// Finds the reference of a scene, renders it when there is none and adds samples when it has fewer
/// than asked for. The file is rewritten at least once a minute, so that a killed render goes on
/// from there.
/// @param add_spp  estimates per pixel to add to what is there, on top of what the config asks for
/// @throws ReferenceError when an existing file is not usable
Reference provide_reference(const LoadedScene& scene, int threads, int add_spp = 0);

}  // namespace penumbra
