#include "scenes/core/images/image_module.h"
#include "scenes/core/module.h"

namespace penumbra {

const ImageModule& image_module() {
  using Entry = const ImageModule*();
  static const ImageModule* const module =
      reinterpret_cast<Entry*>(open_module("images", "penumbra_image_module"))();
  return *module;
}

}  // namespace penumbra
