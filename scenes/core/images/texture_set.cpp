// Textures by OpenImageIO's texture system. It is given texels that were read, checked and decoded
// beforehand: left to itself it would filter encoded colours, and meet damage in the middle of a
// render. Each image is one float tile, so that a lookup never searches for tiles.

#include "scenes/core/images/texture_set.h"

#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/texture.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <sstream>
#include <thread>

#include "scenes/core/error.h"
#include "scenes/core/images/read_image.h"

namespace penumbra {
namespace {

constexpr const char* kImageAttribute = "penumbra:image";

// The texels of one image as a file of one tile, for the image cache.
class MemoryImage final : public OIIO::ImageInput {
 public:
  const char* format_name() const override { return "penumbra"; }

  bool open(const std::string&, OIIO::ImageSpec&) override { return false; }

  bool open(const std::string&, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) override {
    if (!config.getattribute(kImageAttribute, OIIO::TypeDesc::PTR, &image_)) return false;
    spec = m_spec = spec_of(*image_);
    return true;
  }

  bool close() override { return true; }

  bool read_native_scanline(int, int, int, int, void*) override { return false; }

  bool read_native_tile(int, int, int, int, int, void* data) override {
    std::copy(image_->values.begin(), image_->values.end(), static_cast<float*>(data));
    return true;
  }

  static OIIO::ImageSpec spec_of(const ImageData& image) {
    OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
    spec.tile_width = image.width;
    spec.tile_height = image.height;
    spec.tile_depth = 1;
    return spec;
  }

  static OIIO::ImageInput* create() { return new MemoryImage; }

 private:
  const ImageData* image_{nullptr};
};

OIIO::TextureOpt::Wrap wrap_of(TextureWrap wrap) {
  switch (wrap) {
    case TextureWrap::Clamp:
      return OIIO::TextureOpt::WrapClamp;
    case TextureWrap::Mirror:
      return OIIO::TextureOpt::WrapMirror;
    case TextureWrap::Repeat:
      break;
  }
  return OIIO::TextureOpt::WrapPeriodic;
}

using Perthread = OIIO::TextureSystem::Perthread;

// What the texture system keeps per thread, tiles among them. Not taken from the system itself: it
// finds a thread's record by the address of the cache, which a later cache may get again, and
// threads that outlive the first one would then look up its texels.
class ThreadRecords {
 public:
  explicit ThreadRecords(OIIO::TextureSystem& system) : system_(&system) {}

  ~ThreadRecords() {
    for (const auto& [id, record] : records_) system_->destroy_thread_info(record);
  }

  ThreadRecords(const ThreadRecords&) = delete;
  ThreadRecords& operator=(const ThreadRecords&) = delete;

  std::uint64_t id() const { return id_; }

  // Locks only where a thread comes from another set, or for the first time.
  Perthread* mine() {
    thread_local std::uint64_t last_id = 0;
    thread_local Perthread* last = nullptr;
    if (last_id != id_) {
      const std::lock_guard lock(mutex_);
      Perthread*& record = records_[std::this_thread::get_id()];
      if (record == nullptr) record = system_->create_thread_info();
      last = record;
      last_id = id_;
    }
    return system_->get_perthread_info(last);
  }

 private:
  static std::uint64_t next_id() {
    static std::atomic<std::uint64_t> count{0};
    return ++count;
  }

  OIIO::TextureSystem* system_;
  const std::uint64_t id_{next_id()};  // never used again, unlike an address
  std::mutex mutex_;
  std::map<std::thread::id, Perthread*> records_;
};

class OiioTextureSet final : public TextureSet {
 public:
  OiioTextureSet()
      : cache_(OIIO::ImageCache::create(false)),
        system_(OIIO::TextureSystem::create(false, cache_)),
        threads_(std::make_unique<ThreadRecords>(*system_)) {
    // Never throws a tile away: the texels are counted and bounded elsewhere.
    cache_->attribute("max_memory_MB", 1e9f);
  }

  ~OiioTextureSet() override {
    threads_ = nullptr;
    OIIO::TextureSystem::destroy(system_);
    OIIO::ImageCache::destroy(cache_);
  }

  OiioTextureSet(const OiioTextureSet&) = delete;
  OiioTextureSet& operator=(const OiioTextureSet&) = delete;

  std::uint32_t add(const TextureDescription& description) override {
    const Image& image = image_of(description);
    if (description.channel < 0 || description.channel >= image.data->channels) {
      throw InputError(description.file + ": there is no channel " +
                       std::to_string(description.channel) + "; the image has channels 0 to " +
                       std::to_string(image.data->channels - 1));
    }
    Texture texture;
    texture.image = image.handle;
    texture.is_grey = image.data->channels < 3;
    texture.channel = description.channel;
    texture.options.mipmode = OIIO::TextureOpt::MipModeNoMIP;
    texture.options.interpmode = OIIO::TextureOpt::InterpBilinear;
    texture.options.swrap = wrap_of(description.wrap_u);
    texture.options.twrap = wrap_of(description.wrap_v);
    textures_.push_back(texture);
    return static_cast<std::uint32_t>(textures_.size() - 1);
  }

  Rgb color(std::uint32_t index, const Vec2& uv) const noexcept override {
    const Texture& texture = textures_[index];
    Rgb value;
    if (texture.is_grey) return Rgb(look_up(texture, uv, 0, 1, &value.x));
    look_up(texture, uv, 0, 3, &value.x);
    return value;
  }

  float scalar(std::uint32_t index, const Vec2& uv) const noexcept override {
    const Texture& texture = textures_[index];
    float value = 0.0f;
    return look_up(texture, uv, texture.channel, 1, &value);
  }

  std::size_t memory_bytes() const noexcept override {
    std::size_t bytes = 0;
    for (const Image& image : images_) bytes += image.data->values.size() * sizeof(float);
    return bytes;
  }

 private:
  struct Image {
    std::string file;
    bool srgb;
    std::unique_ptr<ImageData> data;
    OIIO::TextureSystem::TextureHandle* handle;
  };

  struct Texture {
    OIIO::TextureSystem::TextureHandle* image{nullptr};
    bool is_grey{false};
    int channel{0};
    OIIO::TextureOpt options;
  };

  // Textures of one file and encoding share its texels.
  const Image& image_of(const TextureDescription& description) {
    const auto found = std::find_if(images_.begin(), images_.end(), [&](const Image& image) {
      return image.file == description.file && image.srgb == description.srgb;
    });
    if (found != images_.end()) return *found;
    auto data = std::make_unique<ImageData>(
        read_image(description.file, description.srgb ? Encoding::Srgb : Encoding::Linear));
    check_range(description.file, *data);
    // Unique in the process, for the same reason as the records of threads.
    const OIIO::ustring name("penumbra " + std::to_string(threads_->id()) + "." +
                             std::to_string(images_.size()));
    images_.push_back({description.file, description.srgb, std::move(data), nullptr});
    images_.back().handle = enter(name, *images_.back().data);
    return images_.back();
  }

  static void check_range(const std::string& file, const ImageData& image) {
    for (std::size_t i = 0; i < image.values.size(); ++i) {
      if (image.values[i] <= 1.0f) continue;
      std::ostringstream text;
      text << file << ": " << texel_place(image, i) << " is " << image.values[i]
           << "; allowed in a texture: 0 to 1";
      throw InputError(text.str());
    }
  }

  OIIO::TextureSystem::TextureHandle* enter(OIIO::ustring name, const ImageData& image) {
    OIIO::ImageSpec config;
    const ImageData* const address = &image;
    config.attribute(kImageAttribute, OIIO::TypeDesc::PTR, &address);
    // The tile is put into the cache without a copy. `read_native_tile` is for a cache that drops
    // tiles all the same.
    const bool entered =
        cache_->add_file(name, MemoryImage::create, &config) &&
        cache_->add_tile(name, 0, 0, 0, 0, 0, 0, -1, OIIO::TypeDesc::FLOAT, image.values.data(),
                         OIIO::AutoStride, OIIO::AutoStride, OIIO::AutoStride, false);
    if (!entered) throw RunError("OpenImageIO's image cache: " + cache_->geterror());
    OIIO::TextureSystem::TextureHandle* const handle =
        system_->get_texture_handle(name, threads_->mine());
    if (handle == nullptr || !system_->good(handle)) {
      throw RunError("OpenImageIO's texture system: " + system_->geterror());
    }
    return handle;
  }

  // @return the first number
  float look_up(const Texture& texture, const Vec2& uv, int channel, int channels,
                float* result) const noexcept {
    // Options are written to by the texture system.
    OIIO::TextureOpt options = texture.options;
    options.firstchannel = channel;
    const bool found = system_->texture(texture.image, threads_->mine(), options, uv.x, uv.y, 0.0f,
                                        0.0f, 0.0f, 0.0f, channels, result);
    PN_CHECK(found, "a texture in memory can be looked up");
    return result[0];
  }

  // Raw pointers up to version 2.5 of OpenImageIO, shared ones later.
  decltype(OIIO::ImageCache::create(false)) cache_;
  decltype(OIIO::TextureSystem::create(false)) system_;
  std::unique_ptr<ThreadRecords> threads_;
  std::vector<Image> images_;
  std::vector<Texture> textures_;
};

}  // namespace

std::unique_ptr<TextureSet> make_texture_set() { return std::make_unique<OiioTextureSet>(); }

}  // namespace penumbra
