#include "harness/exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <ImfVersion.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

#include "harness/atomic_file.h"
#include "harness/exr_channels.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr std::size_t kMaxNameBytes = 253;  // OpenEXR allows 255; ".R" takes two

/// Collects the file in memory, so that it reaches the disk in one atomic step.
class MemoryStream final : public Imf::OStream {
 public:
  MemoryStream() : Imf::OStream("memory") {}
  void write(const char bytes[], int count) override {
    const std::size_t n = static_cast<std::size_t>(count);
    if (bytes_.size() < position_ + n) bytes_.resize(position_ + n);
    std::memcpy(bytes_.data() + position_, bytes, n);
    position_ += n;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  std::size_t position_ = 0;
};

void check_name(const ExrLayer& layer) {
  const bool is_scalar = std::holds_alternative<ScalarImage>(layer.content);
  if (is_scalar && layer.name.empty()) throw RunError("a scalar layer needs a name");
  if (layer.name.size() > kMaxNameBytes || layer.name.find('\0') != std::string::npos) {
    throw RunError(fmt::format("layer name of {} bytes: at most {} and no NUL are allowed",
                               layer.name.size(), kMaxNameBytes));
  }
  if (is_scalar && is_rgb_name(last_part(layer.name))) {
    throw RunError(fmt::format("scalar layer \"{}\": R, G and B are for RGB layers", layer.name));
  }
}

/// Throws RunError without the path; the caller adds it.
void check_layers(const std::vector<ExrLayer>& layers) {
  if (layers.empty()) throw RunError("no layers");
  const auto size_of = [](const ExrLayer& layer) {
    return std::visit([](const auto& p) { return std::pair(p.width, p.height); }, layer.content);
  };
  std::set<std::string> names;
  for (const ExrLayer& layer : layers) {
    check_name(layer);
    if (!names.insert(layer.name).second) {
      throw RunError(fmt::format("two layers are named \"{}\"", layer.name));
    }
    if (!std::visit([](const auto& p) { return is_well_formed(p); }, layer.content)) {
      throw RunError(fmt::format("layer \"{}\": empty, or size and pixels disagree", layer.name));
    }
    if (size_of(layer) != size_of(layers.front())) {
      throw RunError(
          fmt::format("layers \"{}\" and \"{}\" differ in size", layers.front().name, layer.name));
    }
  }
}

void add_metadata(Imf::Header& header, const std::map<std::string, std::string>& metadata) {
  for (const auto& [key, value] : metadata) {
    if (key.empty() || key.size() > 255 || key.find('\0') != std::string::npos) {
      throw RunError(fmt::format("metadata key \"{}\": 1 to 255 bytes without NUL", key));
    }
    if (is_reserved_key(key) || header.find(key.c_str()) != header.end()) {
      throw RunError(fmt::format("metadata key \"{}\" is reserved by OpenEXR", key));
    }
    header.insert(key.c_str(), Imf::StringAttribute(value));
  }
}

std::string encode(const std::vector<ExrLayer>& layers,
                   const std::map<std::string, std::string>& metadata) {
  check_layers(layers);
  const auto [width, height] = std::visit(
      [](const auto& p) { return std::pair(p.width, p.height); }, layers.front().content);
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  add_metadata(header, metadata);
  Imf::FrameBuffer frame;
  for (const ExrLayer& layer : layers) {
    for (const std::string& channel : channel_names(layer)) {
      header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
    }
    add_slices(frame, layer, 0, 0);
  }
  MemoryStream stream;
  {
    Imf::OutputFile file(stream, header);  // its destructor completes the line table
    file.setFrameBuffer(frame);
    file.writePixels(height);
  }
  return stream.take();
}

/// A corrupt header can claim any size; without a bound the allocation alone would bring the
/// machine down.
void check_size(const Imf::Header& header, std::size_t n_channels, std::uintmax_t file_bytes) {
  constexpr std::uintmax_t kMaxRatio = 4096;  // deflate reaches 1032 at most
  constexpr std::uintmax_t kAlwaysAllowed = std::uintmax_t{1} << 20;
  const Imath::Box2i& window = header.dataWindow();
  const auto width = std::int64_t{window.max.x} - window.min.x + 1;
  const auto height = std::int64_t{window.max.y} - window.min.y + 1;
  constexpr std::int64_t kMaxSide = 1 << 20;
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) {
    throw RunError(fmt::format("data window of {} x {} pixels", width, height));
  }
  const std::uintmax_t bytes = static_cast<std::uintmax_t>(width) *
                               static_cast<std::uintmax_t>(height) * n_channels * sizeof(float);
  if (bytes > kAlwaysAllowed && bytes / kMaxRatio > file_bytes) {
    throw RunError(fmt::format("the header claims {} x {} pixels, too many for a file of {} bytes",
                               width, height, file_bytes));
  }
}

/// The layers that a list of channels stands for, sorted by name, with pixels to read into.
std::vector<ExrLayer> make_layers(const std::set<std::string>& channels, int width, int height) {
  std::map<std::pair<std::string, bool>, ExrLayer> layers;  // by name and kind
  for (const std::string& channel : channels) {
    const std::size_t dot = channel.rfind('.');
    const std::string prefix = dot == std::string::npos ? "" : channel.substr(0, dot);
    const bool all_three = channels.contains(channel_name(prefix, "R")) &&
                           channels.contains(channel_name(prefix, "G")) &&
                           channels.contains(channel_name(prefix, "B"));
    if (all_three && is_rgb_name(last_part(channel))) {
      layers.try_emplace({prefix, false}, ExrLayer{prefix, make_image(width, height)});
    } else {
      layers.try_emplace({channel, true}, ExrLayer{channel, make_scalar_image(width, height)});
    }
  }
  std::vector<ExrLayer> result;
  for (auto& [key, layer] : layers) result.push_back(std::move(layer));
  return result;
}

std::set<std::string> channel_names(const Imf::Header& header) {
  std::set<std::string> names;
  const Imf::ChannelList& channels = header.channels();
  for (auto c = channels.begin(); c != channels.end(); ++c) {
    if (c.channel().xSampling != 1 || c.channel().ySampling != 1) {
      throw RunError(fmt::format("channel \"{}\" is subsampled", c.name()));
    }
    names.insert(c.name());
  }
  if (names.empty()) throw RunError("no channels");
  return names;
}

void read_metadata(const Imf::Header& header, std::map<std::string, std::string>& metadata) {
  for (auto a = header.begin(); a != header.end(); ++a) {
    const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute());
    if (text != nullptr && !is_reserved_key(a.name())) metadata[a.name()] = text->value();
  }
}

/// Walks over the header's attributes (name, type, size, value) and checks that each ends inside
/// the file: OpenEXR allocates the size that a string attribute claims, up to 2 GB, before it reads
/// it.
void check_attributes(const std::filesystem::path& path, std::uintmax_t file_bytes) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(8);
  std::string word;
  while (std::getline(file, word, '\0') && !word.empty()) {
    std::getline(file, word, '\0');
    std::int32_t size = 0;  // little-endian, as is every platform of this project
    file.read(reinterpret_cast<char*>(&size), sizeof size);
    if (size < 0 || static_cast<std::uintmax_t>(size) > file_bytes)
      file.setstate(std::ios::failbit);
    file.seekg(size, std::ios::cur);
  }
  if (!file) throw RunError("the header is truncated or corrupt");
}

/// Reads the header alone and checks it: OpenEXR's own reader allocates tables for whatever size a
/// header claims.
Imf::Header read_header(const std::filesystem::path& path) {
  std::error_code status;
  const std::uintmax_t file_bytes = std::filesystem::file_size(path, status);
  if (status) throw RunError(status.message());
  Imf::StdIFStream stream(path.c_str());
  std::array<char, 8> start{};
  stream.read(start.data(), static_cast<int>(start.size()));
  if (!Imf::isImfMagic(start.data())) throw RunError("not an OpenEXR file");
  int version = 0;
  std::memcpy(&version, start.data() + 4, sizeof version);
  if (Imf::isMultiPart(version)) throw RunError("multi-part; one part is allowed");
  if (Imf::isNonImage(version)) throw RunError("deep pixels");
  check_attributes(path, file_bytes);
  Imf::Header header;
  header.readFrom(stream, version);
  check_size(header, channel_names(header).size(), file_bytes);
  return header;
}

ExrFile decode(const std::filesystem::path& path) {
  const Imf::Header header = read_header(path);
  Imf::InputFile file(path.c_str());
  if (!file.isComplete()) throw RunError("incomplete, pixels are missing");
  const std::set<std::string> channels = channel_names(header);
  const Imath::Box2i window = header.dataWindow();
  ExrFile result{path, window.max.x - window.min.x + 1, window.max.y - window.min.y + 1, {}, {}};
  result.layers = make_layers(channels, result.width, result.height);
  read_metadata(header, result.metadata);
  Imf::FrameBuffer frame;
  for (const ExrLayer& layer : result.layers) {
    add_slices(frame, layer, window.min.x, window.min.y);
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return result;
}

template <class Picture>
const Picture& find_layer(const ExrFile& file, const std::string& name, const char* kind) {
  std::vector<std::string> present;
  for (const ExrLayer& layer : file.layers) {
    const auto* picture = std::get_if<Picture>(&layer.content);
    if (picture != nullptr && layer.name == name) return *picture;
    present.push_back(fmt::format("\"{}\" ({})", layer.name,
                                  std::holds_alternative<Image>(layer.content) ? "RGB" : "scalar"));
  }
  throw RunError(fmt::format("{}: no {} layer \"{}\"; it has {}", file.path.string(), kind, name,
                             fmt::join(present, ", ")));
}

}  // namespace

const Image& ExrFile::image(const std::string& name) const {
  return find_layer<Image>(*this, name, "RGB");
}

const ScalarImage& ExrFile::scalar(const std::string& name) const {
  return find_layer<ScalarImage>(*this, name, "scalar");
}

bool ExrFile::has(const std::string& name) const {
  return std::any_of(layers.begin(), layers.end(),
                     [&](const ExrLayer& layer) { return layer.name == name; });
}

void write_exr(const std::filesystem::path& path, const std::vector<ExrLayer>& layers,
               const std::map<std::string, std::string>& metadata) {
  std::string bytes;
  try {
    bytes = encode(layers, metadata);
  } catch (const std::exception& error) {
    throw RunError(fmt::format("cannot write {}: {}", path.string(), error.what()));
  }
  write_file_atomically(path, bytes);
}

ExrFile read_exr(const std::filesystem::path& path) {
  try {
    return decode(path);
  } catch (const std::exception& error) {
    throw RunError(fmt::format("cannot read {}: {}", path.string(), error.what()));
  }
}

}  // namespace penumbra
