#include "tests/fuzz/target.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>

#include "harness/experiment_schema.h"
#include "scenes/core/error.h"
#include "scenes/core/scene_schema.h"
#include "tests/fuzz/json_words.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;

/// Names in the sandbox and names that are none.
const std::vector<std::string> kFileNames{"tri.obj",
                                          "tri.ply",
                                          "tri.gltf",
                                          "grey.png",
                                          "white.hdr",
                                          "nan.pfm",
                                          "missing.obj",
                                          "dir",
                                          "dir.obj",
                                          ".",
                                          "../tri.obj",
                                          "",
                                          "/",
                                          "scene.json",
                                          "/dev/zero",
                                          "box",
                                          "scenes/box/scene.json",
                                          "loop.obj"};

std::vector<std::string> scene_words() { return words_of_schema(kSceneSchemaJson, kFileNames); }
std::vector<std::string> config_words() {
  return words_of_schema(kExperimentSchemaJson, kFileNames);
}

std::vector<std::string> gltf_words() {
  return {"accessors",
          "asset",
          "attributes",
          "buffer",
          "bufferView",
          "bufferViews",
          "buffers",
          "byteLength",
          "byteOffset",
          "byteStride",
          "camera",
          "cameras",
          "children",
          "color",
          "componentType",
          "count",
          "doubleSided",
          "emissiveFactor",
          "extensions",
          "images",
          "indices",
          "intensity",
          "KHR_lights_punctual",
          "KHR_materials_emissive_strength",
          "light",
          "lights",
          "material",
          "materials",
          "matrix",
          "max",
          "mesh",
          "meshes",
          "min",
          "mode",
          "name",
          "nodes",
          "normalized",
          "NORMAL",
          "perspective",
          "POSITION",
          "primitives",
          "rotation",
          "samplers",
          "scale",
          "scene",
          "scenes",
          "source",
          "sparse",
          "spot",
          "TEXCOORD_0",
          "textures",
          "translation",
          "type",
          "uri",
          "values",
          "VEC2",
          "VEC3",
          "SCALAR",
          "yfov",
          "tri.bin",
          "grey.png",
          "data:application/octet-stream;base64,AAAA"};
}

std::vector<std::string> plan_words() {
  return {"version", "machine",    "commit",          "core_version", "scenes", "cells",
          "id",      "label",      "sampler",         "params",       "spp",    "srl",
          "fixed_s", "per_unit_s", "predicted_cpu_s", "budget_s",     "4-12"};
}

std::vector<std::string> manifest_words() {
  return {"version", "references", "file", "id", "scene", "bytes", "xxh3_128", "small/box-1.exr"};
}

const std::array<FuzzTarget, 10> kTargets{{{"scene", fuzz_scene, scene_words},
                                           {"config", fuzz_config, config_words},
                                           {"obj", fuzz_obj, nullptr},
                                           {"ply", fuzz_ply, nullptr},
                                           {"gltf", fuzz_gltf, gltf_words},
                                           {"image", fuzz_image, nullptr},
                                           {"exr", fuzz_exr, nullptr},
                                           {"rows", fuzz_rows, nullptr},
                                           {"plan", fuzz_plan, plan_words},
                                           {"manifest", fuzz_manifest, manifest_words}}};

}  // namespace

Sandbox::Sandbox() {
  std::string pattern = (fs::temp_directory_path() / "penumbra-fuzz-XXXXXX").string();
  PN_CHECK(mkdtemp(pattern.data()) != nullptr, "a folder for files can be made");
  folder_ = pattern;
  fs::copy(fs::path(PENUMBRA_SOURCE_DIR) / "tests/fuzz/sandbox", folder_,
           fs::copy_options::recursive);
  setenv("PENUMBRA_ROOT", folder_.c_str(), 1);
}

Sandbox::~Sandbox() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

fs::path Sandbox::write(const std::string& name, std::string_view bytes) const {
  const fs::path file = folder_ / name;
  std::ofstream stream(file, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  PN_CHECK(stream.good(), "the input can be written");
  return file;
}

std::span<const FuzzTarget> fuzz_targets() { return kTargets; }

const FuzzTarget* find_fuzz_target(std::string_view name) {
  const auto found = std::find_if(kTargets.begin(), kTargets.end(),
                                  [&](const FuzzTarget& target) { return target.name == name; });
  return found == kTargets.end() ? nullptr : &*found;
}

std::vector<std::string_view> split_input(std::string_view input, std::string_view mark) {
  const std::string separator = "\n" + std::string(mark);
  std::vector<std::string_view> parts;
  for (std::size_t end = 0; end != std::string_view::npos;) {
    end = input.find(separator);
    parts.push_back(input.substr(0, end));
    if (end != std::string_view::npos) input.remove_prefix(end + separator.size());
  }
  return parts;
}

}  // namespace penumbra
