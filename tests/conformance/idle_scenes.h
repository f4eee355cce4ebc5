#pragma once

#include <vector>

#include "tests/conformance/test_scenes.h"

/// Scenes in which components of mixtures can not contribute, so that something is left out.
namespace penumbra::conformance {

/// `idle`: a sky that ends at the horizon over surfaces of which some face down, a light seen from
/// behind, one wholly and one partly below the floor, a mirror, a mesh and a sphere. `deltas`: only
/// lights without extent. `open`: a floor with nothing between it and its two lights.
std::vector<NamedDescription> idle_descriptions();

}  // namespace penumbra::conformance
