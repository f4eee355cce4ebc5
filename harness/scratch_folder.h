#pragma once

#include <filesystem>
#include <string>

namespace penumbra {

/// A folder of its own in the system's place for temporary files; goes with all that is in it.
class ScratchFolder {
 public:
  /// @param name  for people who find it: "penumbra-<name>-..."
  /// @throws RunError when it cannot be made
  explicit ScratchFolder(const std::string& name);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace penumbra
