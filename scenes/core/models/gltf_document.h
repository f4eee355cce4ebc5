#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scenes/core/models/mesh_tools.h"
#include "scenes/core/models/tiny_gltf_model.h"

namespace penumbra {

/// Whether an extension is read, so that a file may require it.
bool is_supported_extension(const std::string& name);

/// A glTF file in tinygltf's structures, with every access checked: tinygltf takes references
/// between parts of a file as they come.
class GltfDocument {
 public:
  /// @throws InputError when the file can not be read, or requires an extension that is not
  ///         supported
  explicit GltfDocument(std::filesystem::path file);

  const std::filesystem::path& file() const { return file_; }
  const tinygltf::Model& model() const { return model_; }
  [[noreturn]] void fault(const std::string& message) const { model_error(file_, message); }

  /// items[index]. @throws InputError when there is no such element
  /// @param what  names an element: "mesh"
  template <typename T>
  const T& at(const std::vector<T>& items, int index, const char* what) const {
    if (index < 0 || static_cast<std::size_t>(index) >= items.size()) {
      fault(std::string(what) + " " + std::to_string(index) + " does not exist; the file has " +
            std::to_string(items.size()));
    }
    return items[static_cast<std::size_t>(index)];
  }

  /// Finite vectors of an accessor, [element][component].
  /// @param components  2 or 3, what the accessor must have
  /// @param may_be_normalized  integers that stand for numbers in [0, 1] are allowed too
  std::vector<float> read_vectors(int accessor, int components, bool may_be_normalized);

  /// Scalars of an accessor of unsigned integers.
  std::vector<std::uint32_t> read_indices(int accessor);

 private:
  /// `count` elements in a buffer, known to lie in it.
  struct Elements {
    const unsigned char* first{nullptr};
    std::size_t stride{0};
  };
  Elements elements(const std::string& user, int buffer_view, std::size_t offset, std::size_t count,
                    std::size_t element_bytes) const;
  void load_text(const std::string& bytes);
  void load_binary(const std::string& bytes);
  template <typename Parse>
  void load(Parse parse);
  void check_extensions() const;
  template <typename Read>
  void read(int accessor, int components, std::size_t count, Read read_element);
  const tinygltf::Accessor& accessor(int index, int components) const;
  /// Every node that uses a mesh reads it again, so a small file can ask for any amount.
  /// @throws InputError when it asks for too much
  void count_elements(std::size_t count);

  std::filesystem::path file_;
  tinygltf::Model model_;
  std::uint64_t elements_read_{0};  ///< of all accessors, as often as they are used
};

}  // namespace penumbra
