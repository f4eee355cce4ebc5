#include "harness/exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfTiledOutputFile.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

/// A folder of its own for the running test, removed afterwards.
class ExrFiles : public testing::Test {
 protected:
  ExrFiles() { fs::create_directories(folder_); }
  ~ExrFiles() override { fs::remove_all(folder_); }

  const fs::path folder_ =
      fs::path(testing::TempDir()) / ("penumbra_exr_" + std::to_string(::getpid()));
};

/// Values whose bits a sloppy conversion would change: NaN payloads, infinities, -0, subnormals,
/// extremes.
ScalarImage odd_floats(int width, int height) {
  constexpr std::uint32_t kBits[] = {0x00000000u, 0x80000000u, 0x7f800000u, 0xff800000u,
                                     0x7fc00000u, 0xffc12345u, 0x7f800001u, 0x00000001u,
                                     0x807fffffu, 0x7f7fffffu, 0x00800000u, 0x3eaaaaabu};
  ScalarImage image = make_scalar_image(width, height);
  std::uint32_t noise = 1;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    noise = noise * 1664525u + 1013904223u;
    image.pixels[i] = std::bit_cast<float>(i < std::size(kBits) ? kBits[i] : noise);
  }
  return image;
}

Image odd_colors(int width, int height) {
  const ScalarImage values = odd_floats(3 * width, height);
  Image image = make_image(width, height);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = Rgb(values.pixels[3 * i], values.pixels[3 * i + 1], values.pixels[3 * i + 2]);
  }
  return image;
}

bool same_bits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}
bool same_bits(const Rgb& a, const Rgb& b) {
  return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}
template <class Picture>
bool same_bits(const Picture& a, const Picture& b) {
  return a.width == b.width && a.height == b.height &&
         std::equal(a.pixels.begin(), a.pixels.end(), b.pixels.begin(), b.pixels.end(),
                    [](const auto& p, const auto& q) { return same_bits(p, q); });
}

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void write_bytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::size_t n_files(const fs::path& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// The message of the RunError that `action` throws; empty when it throws none.
template <class Action>
std::string run_error(Action&& action) {
  try {
    action();
    return "";
  } catch (const RunError& error) {
    return error.what();
  }
}

TEST_F(ExrFiles, KeepEveryBitOfEveryLayer) {
  const fs::path path = folder_ / "layers.exr";
  const Image mean = odd_colors(37, 21);
  const Image half_a = odd_colors(37, 21);
  const std::string long_name(253, 'n');
  const ScalarImage weight = odd_floats(37, 21);
  write_exr(path, {{"", mean}, {"half_a", half_a}, {"alpha_L1", weight}, {long_name, weight}});
  const ExrFile file = read_exr(path);
  EXPECT_TRUE(same_bits(file.image(), mean));
  EXPECT_TRUE(same_bits(file.image("half_a"), half_a));
  EXPECT_TRUE(same_bits(file.scalar("alpha_L1"), weight));
  EXPECT_TRUE(same_bits(file.scalar(long_name), weight));
}

TEST_F(ExrFiles, KeepAllMetadata) {
  const std::map<std::string, std::string> metadata{{"penumbra.version", "1.0"},
                                                    {"settings", "{\n  \"name\": \"α \\u00e9\"\n}"},
                                                    {"empty", ""},
                                                    {"owner", std::string(100000, 'x')},
                                                    {"binary", std::string("a\0b", 3)}};
  write_exr(folder_ / "m.exr", {{"v", make_scalar_image(1, 1, 2.0f)}}, metadata);
  EXPECT_EQ(read_exr(folder_ / "m.exr").metadata, metadata);
}

TEST_F(ExrFiles, AreTheSameBytesForTheSameArguments) {
  write_exr(folder_ / "a.exr", {{"", odd_colors(20, 20)}}, {{"k", "v"}});
  write_exr(folder_ / "b.exr", {{"", odd_colors(20, 20)}}, {{"k", "v"}});
  EXPECT_EQ(bytes_of(folder_ / "a.exr"), bytes_of(folder_ / "b.exr"));
}

TEST_F(ExrFiles, LeaveNoTemporaryFileBeside) {
  write_exr(folder_ / "a.exr", {{"", odd_colors(4, 4)}});
  write_exr(folder_ / "a.exr", {{"", odd_colors(5, 5)}});
  EXPECT_EQ(n_files(folder_), 1u);
  EXPECT_EQ(read_exr(folder_ / "a.exr").width, 5);
}

TEST_F(ExrFiles, MissingOnesAreARunErrorWithPathAndReason) {
  const std::string message = run_error([&] { read_exr(folder_ / "none.exr"); });
  EXPECT_NE(message.find("none.exr"), std::string::npos) << message;
  EXPECT_NE(message.find("No such file"), std::string::npos) << message;
}

TEST_F(ExrFiles, ThatAreTextOrAFolderAreARunError) {
  write_bytes(folder_ / "text.exr", "This is not an image.");
  EXPECT_THROW(read_exr(folder_ / "text.exr"), RunError);
  EXPECT_THROW(read_exr(folder_), RunError);
}

TEST_F(ExrFiles, TruncatedAnywhereAreARunError) {
  const fs::path path = folder_ / "t.exr";
  write_exr(path, {{"", odd_colors(40, 50)}}, {{"k", "v"}});
  const std::string whole = bytes_of(path);
  for (std::size_t n = 0; n < whole.size(); n += n < 700 ? 7 : 397) {
    write_bytes(path, whole.substr(0, n));
    const std::string message = run_error([&] { read_exr(path); });
    EXPECT_NE(message.find("t.exr"), std::string::npos) << n << " of " << whole.size() << " bytes";
  }
}

TEST_F(ExrFiles, CorruptOnesNeverCrash) {
  const fs::path path = folder_ / "c.exr";
  write_exr(path, {{"", odd_colors(9, 17)}, {"w", odd_floats(9, 17)}}, {{"k", "v"}});
  const std::string whole = bytes_of(path);
  for (std::size_t i = 0; i < whole.size(); i += i < 600 ? 1 : 89) {
    for (const char value : {'\x7f', '\xff'}) {
      std::string broken = whole;
      broken[i] = value;
      write_bytes(path, broken);
      run_error([&] { read_exr(path); });  // any other exception or a signal fails the test
    }
  }
}

TEST_F(ExrFiles, UnwritableFoldersAreARunErrorWithPathAndReason) {
  write_bytes(folder_ / "file", "x");
  const std::vector<ExrLayer> layers{{"", odd_colors(4, 4)}};
  const std::string missing = run_error([&] { write_exr(folder_ / "none/a.exr", layers); });
  EXPECT_NE(missing.find("none/a.exr"), std::string::npos) << missing;
  EXPECT_NE(missing.find("No such file"), std::string::npos) << missing;
  const std::string no_folder = run_error([&] { write_exr(folder_ / "file/a.exr", layers); });
  EXPECT_NE(no_folder.find("Not a directory"), std::string::npos) << no_folder;
}

TEST_F(ExrFiles, StayAsTheyWereWhenTheDiskIsFull) {
  const fs::path path = folder_ / "full.exr";
  write_exr(path, {{"", odd_colors(4, 4)}});
  const std::string before = bytes_of(path);
  // A limit on the file size makes write() fail half-way, as a full disk does.
  rlimit old_limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{4096, old_limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string message = run_error([&] { write_exr(path, {{"", odd_colors(100, 100)}}); });
  setrlimit(RLIMIT_FSIZE, &old_limit);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_NE(message.find("full.exr"), std::string::npos) << message;
  EXPECT_EQ(bytes_of(path), before);
  EXPECT_EQ(n_files(folder_), 1u);
}

TEST_F(ExrFiles, RefuseWhatCannotBeReadBack) {
  const fs::path path = folder_ / "r.exr";
  const Image rgb = odd_colors(4, 4);
  const ScalarImage one = odd_floats(4, 4);
  EXPECT_THROW(write_exr(path, {}), RunError);
  EXPECT_THROW(write_exr(path, {{"", one}}), RunError) << "scalar without a name";
  EXPECT_THROW(write_exr(path, {{"a.R", one}}), RunError) << "scalar named like a channel";
  EXPECT_THROW(write_exr(path, {{"a", rgb}, {"a", one}}), RunError) << "same name twice";
  EXPECT_THROW(write_exr(path, {{"a", rgb}, {"b", odd_floats(4, 5)}}), RunError) << "two sizes";
  EXPECT_THROW(write_exr(path, {{"a", Image{2, 2, {}}}}), RunError) << "pixels missing";
  for (const char* key : {"", "channels", "type", "name", "view", "chunkCount", "dataWindow"}) {
    EXPECT_THROW(write_exr(path, {{"", rgb}}, {{key, "x"}}), RunError) << key;
  }
  EXPECT_EQ(n_files(folder_), 0u);
}

/// A header of another program: half-float channel "Y", a data window that does not start at (0,
/// 0).
Imf::Header foreign_header(Imf::PixelType type) {
  const Imath::Box2i display(Imath::V2i(0, 0), Imath::V2i(99, 99));
  const Imath::Box2i data(Imath::V2i(-3, 7), Imath::V2i(4, 12));  // 8 x 6
  Imf::Header header(display, data);
  header.channels().insert("Y", Imf::Channel(type));
  return header;
}

/// A frame buffer whose pixels of the data window of `foreign_header` are `values`, row-major.
template <class T>
Imf::FrameBuffer foreign_frame(Imf::PixelType type, std::vector<T>& values) {
  Imf::FrameBuffer frame;
  frame.insert("Y", Imf::Slice::Make(type, values.data(), Imath::V2i(-3, 7), 8, 6));
  return frame;
}

TEST_F(ExrFiles, OfHalfFloatsWithAnOffsetWindowAreRead) {
  std::vector<half> values;
  for (int i = 0; i < 48; ++i) values.push_back(half(0.25f * static_cast<float>(i)));
  {
    Imf::OutputFile file((folder_ / "h.exr").c_str(), foreign_header(Imf::HALF));
    file.setFrameBuffer(foreign_frame(Imf::HALF, values));
    file.writePixels(6);
  }
  const ScalarImage y = read_exr(folder_ / "h.exr").scalar("Y");
  EXPECT_EQ(y.width, 8);
  for (int i = 0; i < 48; ++i) EXPECT_EQ(y.at(i % 8, i / 8), 0.25f * static_cast<float>(i));
}

TEST_F(ExrFiles, WithTilesAreRead) {
  const ScalarImage image = odd_floats(8, 6);
  std::vector<float> values = image.pixels;
  Imf::Header header = foreign_header(Imf::FLOAT);
  header.setTileDescription(Imf::TileDescription(4, 4));
  {
    Imf::TiledOutputFile file((folder_ / "t.exr").c_str(), header);
    file.setFrameBuffer(foreign_frame(Imf::FLOAT, values));
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  }
  EXPECT_TRUE(same_bits(read_exr(folder_ / "t.exr").scalar("Y"), image));
}

TEST_F(ExrFiles, WithSeveralPartsOrSubsampledChannelsAreARunError) {
  std::vector<Imf::Header> headers(2, foreign_header(Imf::FLOAT));
  headers[0].setName("left");
  headers[1].setName("right");
  for (Imf::Header& header : headers) header.setType(Imf::SCANLINEIMAGE);
  { Imf::MultiPartOutputFile file((folder_ / "p.exr").c_str(), headers.data(), 2); }
  const std::string parts = run_error([&] { read_exr(folder_ / "p.exr"); });
  EXPECT_NE(parts.find("multi-part"), std::string::npos) << parts;

  Imf::Header header(8, 8);
  header.channels().insert("RY", Imf::Channel(Imf::FLOAT, 2, 2));
  std::vector<float> values(16, 1.0f);
  {
    Imf::OutputFile file((folder_ / "s.exr").c_str(), header);
    Imf::FrameBuffer frame;
    frame.insert("RY", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), 4, 16, 2, 2));
    file.setFrameBuffer(frame);
    file.writePixels(8);
  }
  const std::string subsampled = run_error([&] { read_exr(folder_ / "s.exr"); });
  EXPECT_NE(subsampled.find("subsampled"), std::string::npos) << subsampled;
}

TEST_F(ExrFiles, NameTheirLayersWhenOneIsMissing) {
  write_exr(folder_ / "a.exr", {{"half_a", odd_colors(2, 2)}, {"w", odd_floats(2, 2)}});
  const ExrFile file = read_exr(folder_ / "a.exr");
  const std::string message = run_error([&] { file.image("half_b"); });
  EXPECT_NE(message.find("\"half_a\" (RGB), \"w\" (scalar)"), std::string::npos) << message;
  EXPECT_TRUE(file.has("w"));
  EXPECT_FALSE(file.has("half_b"));
}

}  // namespace
}  // namespace penumbra
