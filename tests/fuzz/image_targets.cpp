#include <array>
#include <cmath>

#include "harness/exr.h"
#include "harness/reference.h"
#include "scenes/core/error.h"
#include "scenes/core/images/image_module.h"
#include "tests/fuzz/refusal.h"
#include "tests/fuzz/target.h"

namespace penumbra {
namespace {

/// The extension that makes OpenImageIO try the right reader first.
std::string_view extension_of(std::string_view bytes) {
  struct Kind {
    std::string_view start, extension;
  };
  static constexpr std::array<Kind, 7> kKinds{{{"\x89PNG", ".png"},
                                               {"\xff\xd8", ".jpg"},
                                               {"v/1\x01", ".exr"},
                                               {"#?", ".hdr"},
                                               {"II*", ".tif"},
                                               {"MM", ".tif"},
                                               {"P", ".pnm"}}};
  for (const Kind& kind : kKinds) {
    if (bytes.starts_with(kind.start)) return kind.extension;
  }
  return ".png";
}

}  // namespace

/// An image of a scene, as radiance and as a texture.
void fuzz_image(const Sandbox& sandbox, std::string_view input) {
  const std::filesystem::path file =
      sandbox.write("input" + std::string(extension_of(input)), input);
  const bool accepted = accepts<InputError>(file.string(), [&] {
    const ImageData image = image_module().read(file);
    PN_CHECK(image.values.size() == static_cast<std::size_t>(image.width) *
                                        static_cast<std::size_t>(image.height) *
                                        static_cast<std::size_t>(image.channels),
             "one number per channel and texel");
    for (const float value : image.values) {
      PN_CHECK(std::isfinite(value) && value >= 0.0f, "a value is finite and not negative");
    }
  });
  if (!accepted) return;
  accepts<InputError>(file.string(), [&] {
    const std::unique_ptr<TextureSet> textures = image_module().make_textures();
    TextureDescription description;
    description.file = file.string();
    const Rgb color = textures->color(textures->add(description), Vec2(0.3f, 0.7f));
    PN_CHECK(std::isfinite(color.x + color.y + color.z), "a texture's colour is finite");
  });
}

/// An image of this program's own format: a picture of a run, or a reference.
void fuzz_exr(const Sandbox& sandbox, std::string_view input) {
  const std::filesystem::path file = sandbox.write("input.exr", input);
  std::string id;
  const bool accepted = accepts<RunError>(file.string(), [&] {
    const ExrFile exr = read_exr(file);
    const auto found = exr.metadata.find("reference_id");
    if (found != exr.metadata.end()) id = found->second;
  });
  if (accepted) accepts<ReferenceError>(file.string(), [&] { read_reference(file, id); });
}

}  // namespace penumbra
