// What penumbra_images.so offers, and its entry point.

#include "scenes/core/images/image_module.h"

#include "scenes/core/images/read_image.h"
#include "scenes/core/images/texture_set.h"

namespace penumbra {
namespace {

class OiioModule final : public ImageModule {
 public:
  ImageData read(const std::filesystem::path& file) const override {
    return read_image(file, Encoding::OfFile);
  }
  std::unique_ptr<TextureSet> make_textures() const override { return make_texture_set(); }
};

}  // namespace

/// Named in open_image_module.cpp.
extern "C" const ImageModule* penumbra_image_module() {
  static const OiioModule module;
  return &module;
}

}  // namespace penumbra
