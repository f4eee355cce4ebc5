#include "scenes/core/models/gltf_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <string_view>
#include <utility>

#include "scenes/core/file_bytes.h"

namespace penumbra {
namespace {

constexpr std::array<std::string_view, 2> kExtensions{"KHR_lights_punctual",
                                                      "KHR_materials_emissive_strength"};

constexpr std::size_t kMaxNesting = 64;
/// Of zeros that a sparse accessor implies: nothing in the file stands for them.
constexpr std::size_t kMaxImpliedElements = 1u << 20;
constexpr std::size_t kMaxElements = std::numeric_limits<std::int32_t>::max();
constexpr std::uint64_t kMaxElementsRead = std::uint64_t{1} << 28;

/// tinygltf builds nested values by recursion, which a hostile file would use to end the stack.
bool is_nested_too_deeply(std::string_view json) {
  std::size_t depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_text) {
      if (c == '\\') ++i;
      in_text = c != '"';
    } else if (c == '"') {
      in_text = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxNesting) return true;
    } else if ((c == '}' || c == ']') && depth > 0) {
      --depth;
    }
  }
  return false;
}

/// Files beside the model only: tinygltf would also look in the working directory.
struct FileAccess {
  std::string folder;

  static bool exists(const std::string& path, void* self) {
    const std::string& folder = static_cast<const FileAccess*>(self)->folder;
    std::error_code ignored;
    return path.starts_with(folder) && std::filesystem::is_regular_file(path, ignored);
  }
  static std::string expand(const std::string& path, void*) { return path; }
  static bool read(std::vector<unsigned char>* out, std::string* error, const std::string& path,
                   void*) {
    try {
      const std::string bytes = read_bytes(path);
      out->assign(bytes.begin(), bytes.end());
      return true;
    } catch (const std::exception& fault) {
      *error = fault.what();
      return false;
    }
  }
  static bool size(std::size_t* out, std::string*, const std::string& path, void*) {
    std::error_code error;
    *out = std::filesystem::file_size(path, error);
    return !error;
  }
};

/// Images are opened later, by path.
bool skip_image(tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*,
                int, void*) {
  return true;
}

/// Later versions of the library ask for the size of a file as well.
template <typename Callbacks>
void set_size_callback(Callbacks& callbacks) {
  if constexpr (requires { callbacks.GetFileSizeInBytes; }) {
    callbacks.GetFileSizeInBytes = &FileAccess::size;
  }
}

void configure(tinygltf::TinyGLTF& loader, FileAccess& access) {
  tinygltf::FsCallbacks callbacks{};
  callbacks.FileExists = &FileAccess::exists;
  callbacks.ExpandFilePath = &FileAccess::expand;
  callbacks.ReadWholeFile = &FileAccess::read;
  callbacks.WriteWholeFile = &tinygltf::WriteWholeFile;
  set_size_callback(callbacks);
  callbacks.user_data = &access;
  loader.SetFsCallbacks(callbacks);
  loader.SetImageLoader(&skip_image, nullptr);
}

std::uint32_t little_endian(std::string_view bytes, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) {
    value = (value << 8) | static_cast<unsigned char>(bytes[offset + i]);
  }
  return value;
}

/// On one line.
std::string trimmed(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ';');
  return text;
}

std::size_t component_bytes(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    default:
      return 4;
  }
}

template <typename T>
T load(const unsigned char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

float load_number(const unsigned char* bytes, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return static_cast<float>(load<std::uint8_t>(bytes)) / 255.0f;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return static_cast<float>(load<std::uint16_t>(bytes)) / 65535.0f;
    default:
      return load<float>(bytes);
  }
}

std::uint32_t load_index(const unsigned char* bytes, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return load<std::uint8_t>(bytes);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(bytes);
    default:
      return load<std::uint32_t>(bytes);
  }
}

bool is_index_type(int type) {
  return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
         type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

}  // namespace

bool is_supported_extension(const std::string& name) {
  return std::find(kExtensions.begin(), kExtensions.end(), name) != kExtensions.end();
}

GltfDocument::GltfDocument(std::filesystem::path file) : file_(std::move(file)) {
  const std::string bytes = read_bytes(file_);
  if (bytes.size() > std::numeric_limits<std::uint32_t>::max()) fault("larger than 4 GiB");
  if (bytes.starts_with("glTF")) {
    load_binary(bytes);
  } else {
    load_text(bytes);
  }
  if (!model_.asset.version.starts_with("2.")) {
    fault("version \"" + model_.asset.version + "\" of glTF, expected 2.0");
  }
  check_extensions();
}

void GltfDocument::load_text(const std::string& bytes) {
  if (is_nested_too_deeply(bytes)) fault("JSON is nested more than 64 times");
  load([&](tinygltf::TinyGLTF& loader, std::string& error, const std::string& folder) {
    std::string ignored;
    return loader.LoadASCIIFromString(&model_, &error, &ignored, bytes.data(),
                                      static_cast<unsigned>(bytes.size()), folder);
  });
}

void GltfDocument::load_binary(const std::string& bytes) {
  if (bytes.size() < 20) fault("the file ends in the header of 20 bytes");
  if (const std::uint32_t version = little_endian(bytes, 4); version != 2) {
    fault("version " + std::to_string(version) + " of the container, expected 2");
  }
  // tinygltf forgets the second chunk's header when it compares sizes, and would read beyond.
  const std::uint64_t length = little_endian(bytes, 8);
  const std::uint64_t json_end = 20ull + little_endian(bytes, 12);
  if (length > bytes.size() || json_end > length) {
    fault("the header promises " + std::to_string(std::max(length, json_end)) +
          " bytes, the file has " + std::to_string(bytes.size()));
  }
  if (json_end < length) {
    if (json_end + 8 > length || json_end + 8 + little_endian(bytes, json_end) > length) {
      fault("the binary chunk is longer than the file");
    }
  }
  if (is_nested_too_deeply(std::string_view(bytes).substr(20, json_end - 20))) {
    fault("JSON is nested more than 64 times");
  }
  load([&](tinygltf::TinyGLTF& loader, std::string& error, const std::string& folder) {
    std::string ignored;
    return loader.LoadBinaryFromMemory(&model_, &error, &ignored,
                                       reinterpret_cast<const unsigned char*>(bytes.data()),
                                       static_cast<unsigned>(bytes.size()), folder);
  });
}

/// Runs parse(loader, error, folder of the file), and reports what it did not understand.
template <typename Parse>
void GltfDocument::load(Parse parse) {
  tinygltf::TinyGLTF loader;
  FileAccess access{std::filesystem::absolute(file_).parent_path().string()};
  configure(loader, access);
  std::string error;
  bool sound = false;
  try {
    sound = parse(loader, error, access.folder);
  } catch (const std::exception& thrown) {
    error += thrown.what();
  }
  // Some faults of optional parts are told without failing.
  if (!sound || !error.empty()) fault(trimmed(error));
}

void GltfDocument::check_extensions() const {
  std::string missing;
  for (const std::string& name : model_.extensionsRequired) {
    if (is_supported_extension(name)) continue;
    missing += (missing.empty() ? "" : ", ") + name;
  }
  if (!missing.empty()) {
    fault("requires extensions that are not supported: " + missing +
          "; supported are KHR_lights_punctual and KHR_materials_emissive_strength");
  }
}

GltfDocument::Elements GltfDocument::elements(const std::string& user, int buffer_view,
                                              std::size_t offset, std::size_t count,
                                              std::size_t element_bytes) const {
  const tinygltf::BufferView& view = at(model_.bufferViews, buffer_view, "buffer view");
  const std::vector<unsigned char>& data = at(model_.buffers, view.buffer, "buffer").data;
  const std::size_t stride = view.byteStride != 0 ? view.byteStride : element_bytes;
  const bool view_fits =
      view.byteOffset <= data.size() && view.byteLength <= data.size() - view.byteOffset;
  const bool fits = view_fits && stride >= element_bytes && stride <= 4096 && count > 0 &&
                    offset <= view.byteLength && element_bytes <= view.byteLength - offset &&
                    (count - 1) <= (view.byteLength - offset - element_bytes) / stride;
  if (!fits) {
    fault(user + ": " + std::to_string(count) + " elements of " + std::to_string(element_bytes) +
          " bytes do not fit into buffer view " + std::to_string(buffer_view) + " of " +
          std::to_string(view.byteLength) + " bytes in a buffer of " + std::to_string(data.size()));
  }
  return {data.data() + view.byteOffset + offset, stride};
}

void GltfDocument::count_elements(std::size_t count) {
  elements_read_ += count;
  if (elements_read_ <= kMaxElementsRead) return;
  fault("its nodes use more than " + std::to_string(kMaxElementsRead) +
        " elements of accessors in all");
}

const tinygltf::Accessor& GltfDocument::accessor(int index, int components) const {
  const tinygltf::Accessor& accessor = at(model_.accessors, index, "accessor");
  const int found = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  if (found != components) {
    fault("accessor " + std::to_string(index) + ": expected elements of " +
          std::to_string(components) + " numbers, found " + std::to_string(found));
  }
  if (accessor.count == 0 || accessor.count > kMaxElements) {
    fault("accessor " + std::to_string(index) + " has " + std::to_string(accessor.count) +
          " elements, expected 1 to 2^31 - 1");
  }
  return accessor;
}

/// Calls read_element(index of the element, its bytes), first for all of them, then for those that
/// a sparse accessor replaces.
template <typename Read>
void GltfDocument::read(int index, int components, std::size_t count, Read read_element) {
  const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
  const std::string user = "accessor " + std::to_string(index);
  const std::size_t bytes =
      component_bytes(accessor.componentType) * static_cast<std::size_t>(components);
  if (accessor.bufferView >= 0) {
    const Elements found = elements(user, accessor.bufferView, accessor.byteOffset, count, bytes);
    count_elements(count);
    for (std::size_t i = 0; i < count; ++i) read_element(i, found.first + i * found.stride);
  } else if (!accessor.sparse.isSparse) {
    fault(user + " has no buffer view");
  }
  if (!accessor.sparse.isSparse) return;
  count_elements(count);
  const auto& sparse = accessor.sparse;
  if (sparse.count < 1 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0 ||
      !is_index_type(sparse.indices.componentType)) {
    fault(user + ": its sparse part has a count, offset or type that is not allowed");
  }
  const auto replaced = static_cast<std::size_t>(sparse.count);
  const Elements indices = elements(user + " (sparse indices)", sparse.indices.bufferView,
                                    static_cast<std::size_t>(sparse.indices.byteOffset), replaced,
                                    component_bytes(sparse.indices.componentType));
  const Elements values =
      elements(user + " (sparse values)", sparse.values.bufferView,
               static_cast<std::size_t>(sparse.values.byteOffset), replaced, bytes);
  for (std::size_t i = 0; i < replaced; ++i) {
    const std::uint32_t target =
        load_index(indices.first + i * indices.stride, sparse.indices.componentType);
    if (target >= count) {
      fault(user + ": sparse index " + std::to_string(target) + " does not exist; it has " +
            std::to_string(count) + " elements");
    }
    read_element(target, values.first + i * values.stride);
  }
}

std::vector<float> GltfDocument::read_vectors(int index, int components, bool may_be_normalized) {
  const tinygltf::Accessor& found = accessor(index, components);
  const int type = found.componentType;
  const bool normalized = may_be_normalized && found.normalized &&
                          (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                           type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT);
  if (type != TINYGLTF_COMPONENT_TYPE_FLOAT && !normalized) {
    fault("accessor " + std::to_string(index) + ": expected numbers of type float, found type " +
          std::to_string(type));
  }
  if (found.bufferView < 0 && found.count > kMaxImpliedElements) {
    fault("accessor " + std::to_string(index) + " has " + std::to_string(found.count) +
          " elements without a buffer view, at most " + std::to_string(kMaxImpliedElements) +
          " are supported");
  }
  const auto n = static_cast<std::size_t>(components);
  std::vector<float> values;
  if (found.bufferView < 0) values.assign(found.count * n, 0.0f);
  read(index, components, found.count, [&](std::size_t i, const unsigned char* bytes) {
    // Sized only when the elements are known to exist: a count alone must not reserve memory.
    if (values.empty()) values.resize(found.count * n);
    for (std::size_t k = 0; k < n; ++k) {
      const float value = load_number(bytes + k * component_bytes(type), type);
      if (!std::isfinite(value)) {
        fault("accessor " + std::to_string(index) + ": element " + std::to_string(i) +
              " is not finite");
      }
      values[i * n + k] = value;
    }
  });
  return values;
}

std::vector<std::uint32_t> GltfDocument::read_indices(int index) {
  const tinygltf::Accessor& found = accessor(index, 1);
  if (!is_index_type(found.componentType)) {
    fault("accessor " + std::to_string(index) +
          ": expected indices of type unsigned byte, short or int, found type " +
          std::to_string(found.componentType));
  }
  std::vector<std::uint32_t> values;
  read(index, 1, found.count, [&](std::size_t i, const unsigned char* bytes) {
    if (values.empty()) values.resize(found.count);
    values[i] = load_index(bytes, found.componentType);
  });
  return values;
}

}  // namespace penumbra
