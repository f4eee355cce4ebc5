#include "tests/support/image_files.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "harness/exr.h"
#include "scenes/core/file_bytes.h"

namespace penumbra::test {
namespace {

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
  return bytes;
}

// Source: W3C Recommendation "Portable Network Graphics", annex D.
std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = 0xffffffffu;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
  }
  return ~crc;
}

// Source: RFC 1950, section 9.
std::uint32_t adler32(const std::string& bytes) {
  std::uint32_t a = 1;
  std::uint32_t b = 0;
  for (const char c : bytes) {
    a = (a + static_cast<unsigned char>(c)) % 65521;
    b = (b + a) % 65521;
  }
  return b << 16 | a;
}

// A zlib stream of stored blocks. Source: RFC 1951, section 3.2.4.
std::string stored(const std::string& bytes) {
  std::string stream = "\x78\x01";
  for (std::size_t at = 0; at == 0 || at < bytes.size(); at += 65535) {
    const std::size_t length = std::min<std::size_t>(65535, bytes.size() - at);
    stream += at + length >= bytes.size() ? '\x01' : '\x00';
    for (const std::size_t word : {length, ~length}) {
      stream += static_cast<char>(word & 0xff);
      stream += static_cast<char>(word >> 8 & 0xff);
    }
    stream += bytes.substr(at, length);
  }
  return stream + big_endian(adler32(bytes));
}

std::string chunk(const std::string& type, const std::string& data) {
  return big_endian(static_cast<std::uint32_t>(data.size())) + type + data +
         big_endian(crc32(type + data));
}

}  // namespace

ImageFolder::ImageFolder() {
  std::string pattern =
      (std::filesystem::temp_directory_path() / "penumbra-images-XXXXXX").string();
  EXPECT_NE(mkdtemp(pattern.data()), nullptr);
  path_ = pattern;
}

ImageFolder::~ImageFolder() { std::filesystem::remove_all(path_); }

void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream stream(file, std::ios::binary);
  stream << bytes;
  EXPECT_TRUE(stream.good()) << file;
}

std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void truncate(const std::filesystem::path& file, double share) {
  const std::string bytes = read_bytes(file);
  write_bytes(file,
              bytes.substr(0, static_cast<std::size_t>(share * static_cast<double>(bytes.size()))));
}

void write_png(const std::filesystem::path& file, int width, int height, int channels,
               const std::vector<std::uint16_t>& values, int bits) {
  constexpr std::array<char, 4> kColorTypes{0, 4, 2, 6};
  ASSERT_EQ(values.size(), static_cast<std::size_t>(width * height * channels));
  std::string rows;
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    rows += '\0';  // no prediction
    for (int x = 0; x < width * channels; ++x, ++i) {
      if (bits == 16) rows += static_cast<char>(values[i] >> 8);
      rows += static_cast<char>(values[i] & 0xff);
    }
  }
  std::string header = big_endian(static_cast<std::uint32_t>(width)) +
                       big_endian(static_cast<std::uint32_t>(height));
  header += static_cast<char>(bits);
  header += kColorTypes[static_cast<std::size_t>(channels - 1)];
  header += std::string(3, '\0');
  write_bytes(file, "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + chunk("IDAT", stored(rows)) +
                        chunk("IEND", ""));
}

void write_hdr(const std::filesystem::path& file, int width, int height, const std::string& rgbe) {
  ASSERT_EQ(rgbe.size(), static_cast<std::size_t>(width * height * 4));
  write_bytes(file, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " +
                        std::to_string(width) + "\n" + rgbe);
}

void write_rgb_exr(const std::filesystem::path& file, int width, int height,
                   const std::vector<Rgb>& texels) {
  Image image = make_image(width, height);
  ASSERT_EQ(image.pixels.size(), texels.size());
  image.pixels.assign(texels.begin(), texels.end());
  write_exr(file, {{"", image}});
}

void write_scalar_exr(const std::filesystem::path& file, int width, int height,
                      const std::vector<float>& texels, const std::string& channel) {
  ScalarImage image = make_scalar_image(width, height);
  ASSERT_EQ(image.pixels.size(), texels.size());
  image.pixels = texels;
  write_exr(file, {{channel, image}});
}

TextureDescription texture(const std::filesystem::path& file, bool srgb, int channel) {
  TextureDescription description;
  description.file = file.string();
  description.content_hash = hash_file(file);
  description.srgb = srgb;
  description.channel = channel;
  return description;
}

}  // namespace penumbra::test
