#pragma once

#include <memory>

#include "scenes/core/images/image_module.h"

namespace penumbra {

/// A set with a texture system of its own: nothing of another scene's options or tiles reaches it.
std::unique_ptr<TextureSet> make_texture_set();

}  // namespace penumbra
