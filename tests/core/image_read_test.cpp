// Reading image files through the module.

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "scenes/core/error.h"
#include "scenes/core/images/image_module.h"
#include "scenes/core/module.h"
#include "tests/support/image_files.h"

namespace penumbra {
namespace {

using test::ImageFolder;

/// The message with which a file is refused; empty where it is read.
std::string fault_of(const std::filesystem::path& file) {
  try {
    image_module().read(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

/// Whether the file is refused with a message that begins with its name and holds `expected`.
testing::AssertionResult is_refused(const std::filesystem::path& file,
                                    const std::string& expected) {
  const std::string fault = fault_of(file);
  if (fault.starts_with(file.string() + ": ") && fault.find(expected) != std::string::npos &&
      fault.find('\n') == std::string::npos) {
    return testing::AssertionSuccess();
  }
  return testing::AssertionFailure() << '"' << fault << '"';
}

/// IEC 61966-2-1, computed apart from the module.
double decoded(double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); }

/// Grey square of 8 x 8 with sRGB value 188, quality 40: 188 - 128 is a multiple of the quantum of
/// its mean, 20/8, so nothing is lost.
std::string jpeg_bytes() {
  const std::string hex =
      "ffd8ffe000104a46494600010100000100010000ffe1001645786966000049492a0008000000000000000000"
      "ffdb004300140e0f120f0d14121012171514181e32211e1c1c1e3d2c2e243249404c4b47404645505a736250"
      "556d5645466488656d777b8182814e608d978c7d96737e817cffc0000b080008000801011100ffc4001f0000"
      "010501010101010100000000000000000102030405060708090a0bffc400b510000201030302040305050404"
      "0000017d01020300041105122131410613516107227114328191a1082342b1c11552d1f02433627282090a16"
      "1718191a25262728292a3435363738393a434445464748494a535455565758595a636465666768696a737475"
      "767778797a838485868788898a92939495969798999aa2a3a4a5a6a7a8a9aab2b3b4b5b6b7b8b9bac2c3c4c5"
      "c6c7c8c9cad2d3d4d5d6d7d8d9dae1e2e3e4e5e6e7e8e9eaf1f2f3f4f5f6f7f8f9faffda0008010100003f00"
      "d8afffd9";
  std::string bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  }
  return bytes;
}

TEST(ImageRead, ExrKeepsItsNumbersAndRows) {
  const ImageFolder folder;
  test::write_rgb_exr(folder / "a.exr", 2, 2,
                      {Rgb(1, 2, 3), Rgb(4, 5, 6), Rgb(7, 8, 1e30f), Rgb(0.0f)});
  const ImageData image = image_module().read(folder / "a.exr");
  EXPECT_EQ(image.width, 2);
  EXPECT_EQ(image.height, 2);
  EXPECT_EQ(image.channels, 3);
  EXPECT_EQ(image.values, (std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8, 1e30f, 0, 0, 0}));
  EXPECT_TRUE(module_is_open("images"));
}

TEST(ImageRead, HdrIsLinear) {
  const ImageFolder folder;
  // Mantissas over 256 times 2^(exponent - 128); the second texel is 2^3 times the first.
  test::write_hdr(folder / "a.hdr", 2, 1, std::string("\x80\x40\x20\x81\x80\x40\x20\x84", 8));
  const ImageData image = image_module().read(folder / "a.hdr");
  ASSERT_EQ(image.values.size(), 6u);
  EXPECT_NEAR(image.values[0], 1.0f, 1.0f / 128.0f);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(image.values[3 + c], 8.0f * image.values[c]);
  EXPECT_NEAR(image.values[1] / image.values[0], 0.5f, 0.01f);
}

TEST(ImageRead, BytesAreDecodedFromSrgbAndAlphaIsNot) {
  const ImageFolder folder;
  test::write_png(folder / "a.png", 2, 1, 4, {0, 10, 188, 128, 255, 64, 7, 0});
  const ImageData image = image_module().read(folder / "a.png");
  ASSERT_EQ(image.channels, 4);
  const std::vector<double> expected = {0,   decoded(10 / 255.0), decoded(188 / 255.0), 128 / 255.0,
                                        1.0, decoded(64 / 255.0), decoded(7 / 255.0),   0.0};
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(static_cast<double>(image.values[i]), expected[i], 1e-6) << i;
  }
}

TEST(ImageRead, ColoursBehindTransparentTexelsSurvive) {
  const ImageFolder folder;
  test::write_png(folder / "a.png", 1, 1, 4, {255, 255, 255, 0});
  const ImageData image = image_module().read(folder / "a.png");
  EXPECT_EQ(image.values, (std::vector<float>{1, 1, 1, 0}));
}

TEST(ImageRead, ReadsGreyGreyAlphaAndSixteenBits) {
  const ImageFolder folder;
  test::write_png(folder / "g.png", 1, 1, 1, {255});
  EXPECT_EQ(image_module().read(folder / "g.png").channels, 1);
  test::write_png(folder / "ga.png", 1, 1, 2, {255, 51});
  const ImageData grey_alpha = image_module().read(folder / "ga.png");
  EXPECT_EQ(grey_alpha.channels, 2);
  EXPECT_NEAR(grey_alpha.values[1], 0.2f, 1e-6f);
  test::write_png(folder / "s.png", 1, 1, 1, {65535}, 16);
  EXPECT_EQ(image_module().read(folder / "s.png").values, std::vector<float>{1.0f});
}

TEST(ImageRead, ReadsJpeg) {
  const ImageFolder folder;
  test::write_bytes(folder / "a.jpg", jpeg_bytes());
  const ImageData image = image_module().read(folder / "a.jpg");
  ASSERT_EQ(image.values.size(), 64u);
  for (const float value : image.values) {
    EXPECT_NEAR(static_cast<double>(value), decoded(188 / 255.0), 1e-6);
  }
}

TEST(ImageRead, NamesTheTexelOfABadNumber) {
  const ImageFolder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  std::vector<Rgb> texels(12, Rgb(1.0f));
  texels[6] = Rgb(1, nan, 1);  // row 1, column 2 of 4
  test::write_rgb_exr(folder / "nan.exr", 4, 3, texels);
  EXPECT_TRUE(is_refused(folder / "nan.exr",
                         "texel (column 2, row 1 from the upper left), channel 1 is nan"));
  texels[6] = Rgb(infinity, 1, 1);
  test::write_rgb_exr(folder / "inf.exr", 4, 3, texels);
  EXPECT_TRUE(is_refused(folder / "inf.exr", "channel 0 is inf"));
  texels[6] = Rgb(1, 1, -0.5f);
  test::write_rgb_exr(folder / "negative.exr", 4, 3, texels);
  EXPECT_TRUE(is_refused(folder / "negative.exr", "channel 2 is -0.5"));
}

TEST(ImageRead, NamesTheTexelOfAHalfThatOverflowed) {
  const ImageFolder folder;
  std::vector<half> values(12, half(65504.0f));  // the largest
  const auto write = [&] {
    Imf::Header header(2, 2);
    Imf::FrameBuffer frame;
    std::size_t first = 0;
    for (const char* channel : {"R", "G", "B"}) {
      header.channels().insert(channel, Imf::Channel(Imf::HALF));
      frame.insert(channel, Imf::Slice::Make(Imf::HALF, &values[4 * first++], Imath::V2i(0), 2, 2));
    }
    Imf::OutputFile file((folder / "half.exr").c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(2);
  };
  write();
  EXPECT_EQ(fault_of(folder / "half.exr"), "");
  values[4 + 3] = half(65520.0f);
  write();
  EXPECT_TRUE(is_refused(folder / "half.exr",
                         "texel (column 1, row 1 from the upper left), channel 1 is inf"));
}

TEST(ImageRead, RefusesWhatIsNoImageFile) {
  const ImageFolder folder;
  EXPECT_TRUE(is_refused(folder / "missing.exr", "does not exist"));
  std::filesystem::create_directory(folder / "folder.png");
  EXPECT_TRUE(is_refused(folder / "folder.png", "not a file"));
  for (const char* name : {"empty.exr", "empty.png", "empty.hdr", "empty.jpg"}) {
    test::write_bytes(folder / name, "");
    EXPECT_TRUE(is_refused(folder / name, "can not be opened as an image: ")) << name;
  }
  test::write_bytes(folder / "text.png", "this is no image, whatever it is called\n");
  EXPECT_TRUE(is_refused(folder / "text.png", "can not be opened as an image: "));
}

TEST(ImageRead, RefusesTruncatedFiles) {
  const ImageFolder folder;
  test::write_rgb_exr(folder / "a.exr", 64, 64, std::vector<Rgb>(64 * 64, Rgb(0.3f, 2.0f, 7.0f)));
  test::write_png(folder / "a.png", 64, 64, 3, std::vector<std::uint16_t>(64 * 64 * 3, 77));
  test::write_hdr(folder / "a.hdr", 64, 64, std::string(64 * 64 * 4, '\x80'));
  test::write_bytes(folder / "a.jpg", jpeg_bytes());
  for (const char* name : {"a.exr", "a.png", "a.hdr", "a.jpg"}) {
    ASSERT_EQ(fault_of(folder / name), "") << name;
    const std::string whole = test::read_bytes(folder / name);
    for (const double share : {0.02, 0.3, 0.6, 0.9, 0.99}) {
      test::write_bytes(folder / name, whole);
      test::truncate(folder / name, share);
      EXPECT_TRUE(is_refused(folder / name, "")) << name << ", share " << share;
    }
  }
}

TEST(ImageRead, RefusesDamagedBytesOrReadsFiniteNumbers) {
  const ImageFolder folder;
  test::write_rgb_exr(folder / "a.exr", 16, 16, std::vector<Rgb>(256, Rgb(0.3f, 2.0f, 7.0f)));
  test::write_png(folder / "a.png", 16, 16, 3, std::vector<std::uint16_t>(768, 77));
  test::write_hdr(folder / "a.hdr", 16, 16, std::string(1024, '\x80'));
  for (const char* name : {"a.exr", "a.png", "a.hdr"}) {
    const std::string whole = test::read_bytes(folder / name);
    for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 97) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(~bytes[at]);
      test::write_bytes(folder / name, bytes);
      try {
        for (const float value : image_module().read(folder / name).values) {
          ASSERT_TRUE(std::isfinite(value) && value >= 0.0f) << name << " at " << at;
        }
      } catch (const InputError&) {
      }
    }
  }
}

TEST(ImageRead, RefusesAnAbsurdSizeWithoutAllocatingIt) {
  const ImageFolder folder;
  // A header that promises 60000 x 60000 texels.
  test::write_bytes(folder / "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n");
  EXPECT_TRUE(is_refused(folder / "a.hdr", "60000 x 60000 texels"));
}

}  // namespace
}  // namespace penumbra
