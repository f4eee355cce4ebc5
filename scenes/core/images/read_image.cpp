#include "scenes/core/images/read_image.h"

#include <OpenImageIO/imageio.h>

#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::uint64_t kMaxNumbers = std::uint64_t{1} << 28;  // 1 GiB of floats

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& what) {
  throw InputError(file.string() + ": " + what);
}

// OpenImageIO's messages end in a newline, and several are joined.
std::string one_line(std::string message) {
  while (!message.empty() && message.back() == '\n') message.pop_back();
  for (char& c : message) {
    if (c == '\n') c = ';';
  }
  return message.empty() ? "no reason given" : message;
}

std::unique_ptr<OIIO::ImageInput> open(const std::filesystem::path& file) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(file, ignored);
  if (!std::filesystem::exists(status)) fail(file, "the image does not exist");
  if (!std::filesystem::is_regular_file(status))
    fail(file, "is not a file but a directory or such");
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(file.string(), &config);
  if (input == nullptr) fail(file, "can not be opened as an image: " + one_line(OIIO::geterror()));
  return input;
}

void check_layout(const std::filesystem::path& file, OIIO::ImageInput& input) {
  const OIIO::ImageSpec spec = input.spec();
  if (spec.width < 1 || spec.height < 1) fail(file, "has no texels");
  if (spec.depth > 1 || spec.deep) fail(file, "is a volume or a deep image; allowed: flat images");
  if (spec.nchannels < 1 || spec.nchannels > 4) {
    fail(file, "has " + std::to_string(spec.nchannels) + " channels; allowed: 1 to 4");
  }
  if (spec.image_pixels() * static_cast<std::uint64_t>(spec.nchannels) > kMaxNumbers) {
    fail(file, "has " + std::to_string(spec.width) + " x " + std::to_string(spec.height) +
                   " texels of " + std::to_string(spec.nchannels) + " channels; allowed: up to " +
                   std::to_string(kMaxNumbers) + " numbers");
  }
  if (spec.x != spec.full_x || spec.y != spec.full_y || spec.width != spec.full_width ||
      spec.height != spec.full_height) {
    fail(file, "is cropped: its data window is not its display window");
  }
  const int orientation = spec.get_int_attribute("Orientation", 1);
  if (orientation != 1) {
    fail(file, "is stored rotated or mirrored (Exif orientation " + std::to_string(orientation) +
                   "); allowed: upright images");
  }
  if (input.seek_subimage(1, 0)) fail(file, "holds several images; allowed: one");
  input.seek_subimage(0, 0);
}

// Looks for the mark at a file's end: libjpeg fills what is missing of a truncated file with grey
// and does not call it an error, libpng writes to the standard error output.
void check_end(const std::filesystem::path& file, std::string_view format) {
  const std::string_view mark = format == "jpeg"  ? "\xff\xd9"
                                : format == "png" ? "IEND\xae\x42\x60\x82"
                                                  : "";
  if (mark.empty()) return;
  std::ifstream stream(file, std::ios::binary);
  std::array<char, 4096> end{};
  stream.seekg(0, std::ios::end);
  const std::streamoff size = stream.tellg();
  const std::streamoff tail = std::min<std::streamoff>(size, end.size());
  stream.seekg(size - tail);
  stream.read(end.data(), tail);
  // Some writers pad the file behind the mark.
  const std::string_view bytes(end.data(), static_cast<std::size_t>(tail));
  if (!stream || bytes.rfind(mark) == std::string_view::npos) {
    fail(file, "is truncated: the end mark of " + std::string(format) + " files is missing");
  }
}

bool is_integer(const OIIO::ImageSpec& spec) { return !spec.format.is_floating_point(); }

// Whether colours have to be decoded.
bool is_srgb(const std::filesystem::path& file, const OIIO::ImageSpec& spec, Encoding encoding) {
  if (encoding == Encoding::Linear) return false;
  if (encoding == Encoding::Srgb) {
    if (is_integer(spec)) return true;
    fail(file, "holds floating-point numbers, which are linear; allowed for sRGB: integers");
  }
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  if (!is_integer(spec)) return false;
  if (space.empty()) return spec.format == OIIO::TypeDesc::UINT8;
  const bool linear = space == "Linear" || space == "linear" || space == "scene_linear" ||
                      space == "lin_rec709" || space == "lin_rec709_scene";
  const bool srgb = space == "sRGB" || space == "srgb_rec709_display" ||
                    space == "srgb_rec709_scene" || space == "srgb_texture";
  if (!linear && !srgb) {
    fail(file, "is encoded in the colour space \"" + space + "\"; allowed: sRGB, linear");
  }
  return srgb;
}

float srgb_to_linear(float encoded) {
  const double x = static_cast<double>(encoded);
  return static_cast<float>(x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));
}

// Source: IEC 61966-2-1:1999.
void decode_srgb(const OIIO::ImageSpec& spec, ImageData& image) {
  std::array<float, 256> table{};
  const bool bytes = spec.format == OIIO::TypeDesc::UINT8;
  for (std::size_t i = 0; i < table.size(); ++i) {
    table[i] = srgb_to_linear(static_cast<float>(i) / 255.0f);
  }
  const auto channels = static_cast<std::size_t>(image.channels);
  // The fourth channel, and the second of grey and alpha.
  const std::size_t colours = channels % 2 == 0 ? channels - 1 : channels;
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    if (i % channels >= colours) continue;
    float& value = image.values[i];
    value = bytes ? table[static_cast<std::size_t>(std::lround(value * 255.0f))]
                  : srgb_to_linear(value);
  }
}

void check_values(const std::filesystem::path& file, const ImageData& image) {
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    const float value = image.values[i];
    if (value >= 0.0f && std::isfinite(value)) continue;
    std::ostringstream text;
    text << texel_place(image, i) << " is " << value << "; allowed: finite numbers from 0 on";
    fail(file, text.str());
  }
}

}  // namespace

std::string texel_place(const ImageData& image, std::size_t index) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto width = static_cast<std::size_t>(image.width);
  const std::size_t texel = index / channels;
  return "texel (column " + std::to_string(texel % width) + ", row " +
         std::to_string(texel / width) + " from the upper left), channel " +
         std::to_string(index % channels);
}

ImageData read_image(const std::filesystem::path& file, Encoding encoding) {
  const std::unique_ptr<OIIO::ImageInput> input = open(file);
  check_layout(file, *input);
  const OIIO::ImageSpec spec = input->spec();
  check_end(file, input->format_name());
  ImageData image;
  image.width = spec.width;
  image.height = spec.height;
  image.channels = spec.nchannels;
  image.values.resize(spec.image_pixels() * static_cast<std::size_t>(spec.nchannels));
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.values.data())) {
    fail(file, "can not be read: " + one_line(input->geterror()));
  }
  check_values(file, image);
  if (is_srgb(file, spec, encoding)) decode_srgb(spec, image);
  return image;
}

}  // namespace penumbra
