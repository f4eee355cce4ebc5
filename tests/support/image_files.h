#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scenes/core/images/image_module.h"

/// Image files made byte by byte for tests, without the library that reads them.
namespace penumbra::test {

/// A folder of its own for each test, gone with it.
class ImageFolder {
 public:
  ImageFolder();
  ~ImageFolder();
  ImageFolder(const ImageFolder&) = delete;
  ImageFolder& operator=(const ImageFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void write_bytes(const std::filesystem::path& file, const std::string& bytes);
std::string read_bytes(const std::filesystem::path& file);

/// Cuts a file after a share of its bytes.
void truncate(const std::filesystem::path& file, double share);

/// PNG of 8 or 16 bits. @param values  [row][column][channel], 1 to 4 channels
void write_png(const std::filesystem::path& file, int width, int height, int channels,
               const std::vector<std::uint16_t>& values, int bits = 8);

/// Radiance HDR without compression. @param rgbe  [row][column] of four bytes
void write_hdr(const std::filesystem::path& file, int width, int height, const std::string& rgbe);

/// EXR of RGB floats; NaNs and negative numbers keep their bits.
void write_rgb_exr(const std::filesystem::path& file, int width, int height,
                   const std::vector<Rgb>& texels);

/// EXR with one channel. @param channel  its name
void write_scalar_exr(const std::filesystem::path& file, int width, int height,
                      const std::vector<float>& texels, const std::string& channel = "Y");

/// A texture description with the file's hash.
TextureDescription texture(const std::filesystem::path& file, bool srgb = false, int channel = 0);

}  // namespace penumbra::test
