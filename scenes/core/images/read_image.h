#pragma once

#include <filesystem>

#include "scenes/core/images/image_module.h"

/// Image files by OpenImageIO; inside the module only.
namespace penumbra {

/// What a file's numbers stand for.
enum class Encoding : std::uint8_t {
  OfFile,  ///< as the file says: integers marked or taken as sRGB are decoded, floats are linear
  Linear,  ///< taken as they are; integers divided by their largest value
  Srgb,    ///< colours decoded from the sRGB transfer function, alpha as it is
};

/// Reads the one image of a file. Integers of 8 bits without a statement of their colour space are
/// sRGB, those of 16 bits are linear; alpha is never decoded and colours are not multiplied by it.
/// @throws InputError naming the file and what is wrong: not readable, truncated, rotated, cropped,
///         several images, more than four channels, too many texels, a number that is negative or
///         not finite (with its texel)
ImageData read_image(const std::filesystem::path& file, Encoding encoding);

/// "texel (3, 5), channel 0 (from the upper left)": the place of a number in messages.
/// @param index  into ImageData::values
std::string texel_place(const ImageData& image, std::size_t index);

}  // namespace penumbra
