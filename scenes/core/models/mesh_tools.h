#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "scenes/core/models/model_file.h"

/// What the importers have in common.
namespace penumbra {

/// @throws InputError "file[:line]: error: message"
[[noreturn]] void model_error(const std::filesystem::path& file, const std::string& message);
[[noreturn]] void model_error(const std::filesystem::path& file, int line,
                              const std::string& message);

/// Cuts a polygon into triangles of its own winding, concave ones along ears.
/// @param corners  positions in order, at least 3
/// @param out      appended to: indices into `corners`; nothing where the polygon has no area
/// @return false, with nothing appended, where a concave polygon has more than
///         `kMaxConcaveCorners`
bool triangulate(std::span<const Vec3d> corners, std::vector<std::array<std::uint32_t, 3>>& out);
inline constexpr std::size_t kMaxConcaveCorners = 1024;

/// Whether a triangle's area can be told from rounding.
bool has_area(const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Whether a face meets a vertex twice.
bool has_repeats(std::span<const std::uint32_t> corners);

/// Makes names unique.
class UniqueNames {
 public:
  /// `wanted`, or with ".2", ".3", ... where that is taken; from now on taken.
  std::string settle(const std::string& wanted);

 private:
  std::set<std::string> taken_;
  std::map<std::string, int> last_;  ///< number of a name that was wanted before
};

/// Gathers the shapes of a model under unique names.
class ModelBuilder {
 public:
  explicit ModelBuilder(std::filesystem::path file) : file_(std::move(file)) {}

  const std::filesystem::path& file() const { return file_; }
  Model& model() { return model_; }

  /// A name for a shape or a light.
  std::string unique_name(const std::string& wanted) { return names_.settle(wanted); }

  /// Adds a mesh. Triangles without area are left out with a warning that counts them, and the
  /// whole mesh where nothing else is left.
  /// @param left_out  faces that were found to have no area before
  void add_mesh(const std::string& name, std::uint32_t material, TriangleMeshShape mesh,
                const std::optional<EmissionDescription>& emission, std::size_t left_out = 0);

  /// Adds a control cage as it is.
  void add_cage(const std::string& name, std::uint32_t material, SubdivisionShape cage,
                const std::optional<EmissionDescription>& emission);

  /// Describes an image file that a material refers to.
  /// @param place  of the reference, for messages: "file:line" or "file"
  /// @param use    what it is for, in the file's words
  /// @throws InputError when the file does not exist
  TextureDescription texture(const std::filesystem::path& image, const std::string& place,
                             const std::string& use);

  void warn(std::string message) { model_.warnings.push_back(std::move(message)); }
  void warn_of_material(std::string message) {
    model_.material_warnings.push_back(std::move(message));
  }

  /// The finished model.
  /// @throws InputError when there is no shape
  Model take();

 private:
  std::filesystem::path file_;
  Model model_;
  UniqueNames names_;
  std::map<std::string, std::string> hashes_;  ///< of the image files so far
};

}  // namespace penumbra
