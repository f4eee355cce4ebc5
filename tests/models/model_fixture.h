#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "scenes/core/error.h"
#include "scenes/core/models/model_file.h"

namespace penumbra {

/// A folder of its own for the files of one test, removed after it.
class ModelFiles {
 public:
  ModelFiles() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              ("penumbra-models-" + std::to_string(getpid()) + "-" + test->test_suite_name() + "-" +
               test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~ModelFiles() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  ModelFiles(const ModelFiles&) = delete;
  ModelFiles& operator=(const ModelFiles&) = delete;

  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    std::ofstream stream(folder_ / name, std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return folder_ / name;
  }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

/// Expects `load_model` to refuse a file with an InputError that names it and says `message`.
inline void expect_model_error(const std::filesystem::path& file, const std::string& message,
                               ModelFaces faces = ModelFaces::Triangles) {
  try {
    load_model(file, faces);
    ADD_FAILURE() << file << " was accepted; expected the error \"" << message << "\"";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(file.filename().string()), std::string::npos) << text;
    EXPECT_NE(text.find(message), std::string::npos) << text << "\nexpected: " << message;
  }
}

inline const TriangleMeshShape& mesh_of(const Model& model, std::size_t shape) {
  return std::get<TriangleMeshShape>(model.shapes.at(shape).shape);
}

/// Sum of the areas of a mesh's triangles.
inline double area_of(const TriangleMeshShape& mesh) {
  double area = 0.0;
  for (const auto& t : mesh.triangles) {
    area += 0.5 * (mesh.vertices[t[1]] - mesh.vertices[t[0]])
                      .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]])
                      .length();
  }
  return area;
}

}  // namespace penumbra
