#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "scenes/core/scene_description.h"
#include "scenes/core/vec.h"

/// Image files for scenes. OpenImageIO lives behind these interfaces in a shared module that is
/// opened only for a scene that has an image: linked into the program it would cost every start
/// 0.35 s and 134 MB.
namespace penumbra {

/// An image as floating-point numbers.
struct ImageData {
  int width{0}, height{0};    ///< [pixels]
  int channels{0};            ///< 1 to 4
  std::vector<float> values;  ///< [row from the top][column][channel], linear
};

/// The textures of one scene. Safe for lookups from many threads; the same bits on any of them.
class TextureSet {
 public:
  virtual ~TextureSet() = default;

  /// Opens an image and checks every texel.
  /// @return the texture's index
  /// @throws InputError naming the file, and the texel that is not finite or negative
  virtual std::uint32_t add(const TextureDescription& texture) = 0;

  /// Bilinear lookup of the full-resolution image.
  /// @param uv  (0, 0) is the upper left corner of the upper left texel
  /// @return linear RGB; of an image with one channel, three times that
  virtual Rgb color(std::uint32_t texture, const Vec2& uv) const noexcept = 0;

  /// The same for one number, from the channel that the texture's description names.
  virtual float scalar(std::uint32_t texture, const Vec2& uv) const noexcept = 0;

  /// Of the texels held in memory.
  virtual std::size_t memory_bytes() const noexcept = 0;
};

/// What the module offers.
class ImageModule {
 public:
  virtual ~ImageModule() = default;

  /// Reads a whole image, in linear light whatever the file's encoding.
  /// @throws InputError naming the file and what is wrong with it
  virtual ImageData read(const std::filesystem::path& file) const = 0;

  virtual std::unique_ptr<TextureSet> make_textures() const = 0;
};

/// Opens the module; later calls cost nothing.
/// @throws RunError when the module's file is missing
const ImageModule& image_module();

}  // namespace penumbra
