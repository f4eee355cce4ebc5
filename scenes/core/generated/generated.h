#pragma once

#include <array>
#include <string_view>

#include "scenes/core/scene_description.h"

/// Objects that the project generates itself, so that the paper's scenes need no download. Each is
/// one closed surface with vertex normals, y upwards, its base at y = 0 around the origin, facing
/// +z. The same bits at every call.
namespace penumbra {

/// Range of `detail`: triangles per area go with its square. At 1 an object is what its scene is
/// meant to show.
inline constexpr double kMinDetail = 0.1;
inline constexpr double kMaxDetail = 4.0;

/// A standing figure in a folded robe on a plinth, about 1.95 high; of genus 0 or nearly so.
TriangleMeshShape generate_statue(double detail = 1.0);

/// A pumpkin, about 1.9 high and 2 wide: a hollow shell with ribs, and through its wall two eyes, a
/// nose, a toothed mouth and the cut of a lid that three bridges hold. Seven openings: genus 6.
TriangleMeshShape generate_lantern(double detail = 1.0);

/// A sheet along a gyroid, cut out by an ellipsoid, about 1.6 high and 2.4 wide: a genus above 50
/// and shadows of itself wherever one looks.
TriangleMeshShape generate_high_genus(double detail = 1.0);

/// A generator as scene files name it.
struct Generator {
  std::string_view name;
  TriangleMeshShape (*generate)(double detail);
};

inline constexpr std::array<Generator, 3> kGenerators{{{"statue", generate_statue},
                                                       {"lantern", generate_lantern},
                                                       {"high_genus", generate_high_genus}}};

}  // namespace penumbra
