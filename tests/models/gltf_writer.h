#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/models/model_fixture.h"

namespace penumbra {

/// Writes small glTF files.
class GltfWriter {
 public:
  nlohmann::json root = {{"asset", {{"version", "2.0"}}}, {"scene", 0}};

  template <typename T>
  int add_view(const std::vector<T>& values) {
    while (binary_.size() % 4 != 0) binary_ += '\0';
    root["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", values.size() * sizeof(T)}});
    binary_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    return static_cast<int>(root["bufferViews"].size()) - 1;
  }

  /// @return index of the accessor
  int add_floats(const std::vector<float>& values, int components) {
    return add_accessor(add_view(values), 5126,
                        values.size() / static_cast<std::size_t>(components),
                        components == 2 ? "VEC2" : "VEC3");
  }
  template <typename T>
  int add_indices(const std::vector<T>& values) {
    return add_accessor(add_view(values),
                        sizeof(T) == 1   ? 5121
                        : sizeof(T) == 2 ? 5123
                                         : 5125,
                        values.size(), "SCALAR");
  }
  int add_accessor(int view, int type, std::size_t count, const char* shape) {
    root["accessors"].push_back(
        {{"bufferView", view}, {"componentType", type}, {"count", count}, {"type", shape}});
    return static_cast<int>(root["accessors"].size()) - 1;
  }
  /// @return index of a mesh of one primitive
  int add_mesh(const nlohmann::json& primitive) {
    root["meshes"].push_back({{"primitives", {primitive}}});
    return static_cast<int>(root["meshes"].size()) - 1;
  }
  /// Adds a root of the scene.
  void add_node(const nlohmann::json& node) {
    root["nodes"].push_back(node);
    root["scenes"][0]["nodes"].push_back(root["nodes"].size() - 1);
  }

  std::filesystem::path write(const ModelFiles& files, const std::string& name = "model") {
    root["buffers"] = {{{"byteLength", binary_.size()}, {"uri", name + ".bin"}}};
    files.write(name + ".bin", binary_);
    return files.write(name + ".gltf", root.dump(1));
  }

  /// The bytes of a .glb.
  std::string glb() {
    while (binary_.size() % 4 != 0) binary_ += '\0';
    root["buffers"] = {{{"byteLength", binary_.size()}}};
    std::string json = root.dump();
    while (json.size() % 4 != 0) json += ' ';
    const auto word = [](std::size_t value) {
      std::string bytes(4, '\0');
      for (std::size_t i = 0; i < 4; ++i) bytes[i] = static_cast<char>(value >> (8 * i));
      return bytes;
    };
    return "glTF" + word(2) + word(28 + json.size() + binary_.size()) + word(json.size()) + "JSON" +
           json + word(binary_.size()) + std::string("BIN\0", 4) + binary_;
  }

 private:
  std::string binary_;
};

/// One triangle (0,0,0), (1,0,0), (0,2,0) as mesh 0, used by node 0.
inline GltfWriter one_triangle() {
  GltfWriter gltf;
  const int positions = gltf.add_floats({0, 0, 0, 1, 0, 0, 0, 2, 0}, 3);
  const int indices = gltf.add_indices(std::vector<std::uint16_t>{0, 1, 2});
  gltf.add_node(
      {{"name", "piece"},
       {"mesh", gltf.add_mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}})}});
  return gltf;
}

}  // namespace penumbra
