#include "harness/project_root.h"

#include <algorithm>
#include <cstdlib>

#include "scenes/core/error.h"

namespace penumbra {

namespace fs = std::filesystem;

namespace {

bool holds_project(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_directory(folder / "scenes", ignored) &&
         fs::is_directory(folder / "configs", ignored);
}

}  // namespace

fs::path project_root() {
  if (const char* const given = std::getenv("PENUMBRA_ROOT"); given != nullptr && *given != '\0') {
    if (holds_project(given)) return fs::absolute(given).lexically_normal();
    throw InputError(std::string("PENUMBRA_ROOT=") + given +
                     ": error: expected a folder that holds scenes/ and configs/");
  }
  for (fs::path folder = fs::current_path();; folder = folder.parent_path()) {
    if (holds_project(folder)) return folder;
    if (folder == folder.parent_path()) break;
  }
#ifdef PENUMBRA_SOURCE_DIR
  if (holds_project(PENUMBRA_SOURCE_DIR)) return PENUMBRA_SOURCE_DIR;
#endif
  throw InputError(
      "error: no folder with scenes/ and configs/ here or above; "
      "set PENUMBRA_ROOT to the project's folder");
}

std::vector<std::string> scene_names(const fs::path& root) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(root / "scenes", ignored)) {
    if (fs::is_regular_file(entry.path() / "scene.json", ignored)) {
      names.push_back(entry.path().filename().string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace penumbra
