#include "harness/reference_manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "harness/atomic_file.h"
#include "harness/exr.h"
#include "harness/keys.h"
#include "harness/project_root.h"
#include "harness/reference_metadata.h"
#include "scenes/core/error.h"
#include "scenes/core/file_bytes.h"

namespace penumbra {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// What is missing or cannot be read is not the user's input here.
std::string read_stored(const fs::path& file) {
  try {
    return read_bytes(file);
  } catch (const InputError& error) {
    throw ReferenceError(error.what());
  }
}

std::string hash_of(const std::string& bytes) {
  return hash_of_bytes(std::as_bytes(std::span(bytes.data(), bytes.size())));
}

/// The manifest, or an empty one where there is no file.
ordered_json read_manifest() {
  const fs::path file = reference_manifest();
  if (!fs::exists(file)) return {{"version", 1}, {"references", ordered_json::array()}};
  const ordered_json manifest = ordered_json::parse(read_stored(file), nullptr, false);
  if (manifest.is_object() && manifest.contains("references") &&
      manifest["references"].is_array()) {
    return manifest;
  }
  throw ReferenceError(file.string() + ": is not a manifest of references; restore it");
}

/// How a fault of a file is put right.
std::string remedy(const fs::path& file) {
  return fmt::format(
      "restore {} and {}, or remove the first and make it again with `penumbra "
      "reference CONFIG --small`",
      file.string(), reference_manifest().string());
}

ordered_json entry_of(const fs::path& file, const std::string& bytes) {
  const ExrFile exr = read_exr(file);
  const auto text = [&](const char* key) {
    const auto found = exr.metadata.find(key);
    return found == exr.metadata.end() ? std::string() : found->second;
  };
  const auto number = [&](const char* key) { return reference_count(exr, key); };
  return {{"scene", text("scene")},
          {"id", text("reference_id")},
          {"file", "small/" + file.filename().string()},
          {"scene_hash", text("scene_hash")},
          {"resolution", {exr.width, exr.height}},
          {"camera_samples", number("camera_samples")},
          {"quantity", text("quantity")},
          {"type", text("reference_type")},
          {"spp", number("spp")},
          {"core_version", number("core_version")},
          {"commit", text("commit")},
          {"lineage", reference_lineage(exr)},
          {"bytes", bytes.size()},
          {"xxh3_128", hash_of(bytes)}};
}

/// A member's text; empty where there is none, which is no entry's.
std::string text_at(const ordered_json& entry, const char* key) {
  if (!entry.is_object()) return {};
  const auto found = entry.find(key);
  return found != entry.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::pair<std::string, std::string> place_of(const ordered_json& entry) {
  return {text_at(entry, "scene"), text_at(entry, "id")};
}

}  // namespace

fs::path small_references() { return project_root() / "references" / "small"; }

fs::path reference_manifest() { return project_root() / "references" / "manifest.json"; }

bool is_small_reference(const fs::path& file) {
  return fs::absolute(file).lexically_normal().parent_path() ==
         fs::absolute(small_references()).lexically_normal();
}

void check_small_reference(const fs::path& file, const std::string& id) {
  const std::string name = "small/" + file.filename().string();
  const ordered_json manifest = read_manifest();
  for (const ordered_json& entry : manifest["references"]) {
    if (text_at(entry, "file") != name) continue;
    if (text_at(entry, "id") != id) {
      throw ReferenceError(fmt::format("{}: its entry in {} is of the reference {}, not {}; {}",
                                       file.string(), reference_manifest().string(),
                                       text_at(entry, "id"), id, remedy(file)));
    }
    const std::string found = hash_of(read_stored(file));
    const std::string expected = text_at(entry, "xxh3_128");
    if (found == expected) return;
    throw ReferenceError(fmt::format("{}: its bytes have the hash {}, {} says {}; {}",
                                     file.string(), found, reference_manifest().string(), expected,
                                     remedy(file)));
  }
  throw ReferenceError(fmt::format("{}: has no entry in {}; {}", file.string(),
                                   reference_manifest().string(), remedy(file)));
}

fs::path publish_small_reference(const fs::path& file) {
  ordered_json manifest = read_manifest();
  const fs::path copy = small_references() / file.filename();
  const std::string bytes = read_stored(file);
  const ordered_json entry = entry_of(file, bytes);
  std::error_code error;
  fs::create_directories(copy.parent_path(), error);
  if (error) throw RunError(copy.parent_path().string() + ": " + error.message());
  if (!is_small_reference(file)) write_file_atomically(copy, bytes);

  ordered_json entries = ordered_json::array({entry});
  for (const ordered_json& other : manifest["references"]) {
    if (text_at(other, "file") != entry["file"]) entries.push_back(other);
  }
  std::sort(entries.begin(), entries.end(),
            [](const auto& a, const auto& b) { return place_of(a) < place_of(b); });
  manifest["references"] = entries;
  write_file_atomically(reference_manifest(), manifest.dump(2) + "\n");
  return copy;
}

}  // namespace penumbra
