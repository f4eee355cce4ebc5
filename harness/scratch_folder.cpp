#include "harness/scratch_folder.h"

#include <cstdlib>
#include <system_error>

#include "scenes/core/error.h"

namespace penumbra {

namespace fs = std::filesystem;

ScratchFolder::ScratchFolder(const std::string& name) {
  // mkdtemp fills in the last six letters.
  std::string pattern = (fs::temp_directory_path() / ("penumbra-" + name + "-XXXXXX")).string();
  if (mkdtemp(pattern.data()) == nullptr) throw RunError(pattern + ": cannot be created");
  path_ = pattern;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace penumbra
