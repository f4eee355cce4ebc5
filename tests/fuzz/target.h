#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Fuzz targets: each gives a reader of files arbitrary bytes. What a reader promises is that it
/// returns, or throws the one type of exception that its documentation names, with a message that
/// names the file. Any other exception, a crash, a hang, too much memory or a report of a sanitizer
/// is a finding.
namespace penumbra {

/// A folder of this process with the files that inputs may refer to; removed with the object.
class Sandbox {
 public:
  /// Copies tests/fuzz/sandbox and makes the folder the root of the project (PENUMBRA_ROOT).
  Sandbox();
  ~Sandbox();
  Sandbox(const Sandbox&) = delete;
  Sandbox& operator=(const Sandbox&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  /// Writes a file into the folder. @return its path
  std::filesystem::path write(const std::string& name, std::string_view bytes) const;

 private:
  std::filesystem::path folder_;
};

struct FuzzTarget {
  std::string_view name;
  /// Reads one input, and checks what must hold of what was read.
  void (*read)(const Sandbox& sandbox, std::string_view input);
  /// Names that the reader knows, for mutations of JSON; nullptr where inputs are no JSON.
  std::vector<std::string> (*words)();
};

std::span<const FuzzTarget> fuzz_targets();

/// @return nullptr where there is none of that name
const FuzzTarget* find_fuzz_target(std::string_view name);

/// An input of several parts: the text before the first line that begins with `mark`, then what
/// follows each such mark up to the next.
std::vector<std::string_view> split_input(std::string_view input, std::string_view mark);

// The targets; one function each, as FuzzTarget::read.
void fuzz_scene(const Sandbox& sandbox, std::string_view input);
void fuzz_config(const Sandbox& sandbox, std::string_view input);
void fuzz_obj(const Sandbox& sandbox, std::string_view input);
void fuzz_ply(const Sandbox& sandbox, std::string_view input);
void fuzz_gltf(const Sandbox& sandbox, std::string_view input);
void fuzz_image(const Sandbox& sandbox, std::string_view input);
void fuzz_exr(const Sandbox& sandbox, std::string_view input);
void fuzz_rows(const Sandbox& sandbox, std::string_view input);
void fuzz_plan(const Sandbox& sandbox, std::string_view input);
void fuzz_manifest(const Sandbox& sandbox, std::string_view input);

}  // namespace penumbra
