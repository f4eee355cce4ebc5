#pragma once

#include <chrono>
#include <cstddef>

/// Parts that not every scene needs, and what building them cost.
namespace penumbra {

/// One part as it was built for a scene; absent where `count` is 0.
struct ScenePart {
  std::size_t count{0};  ///< of what it is built for; SceneParts says what that is
  std::size_t bytes{0};
  double build_s{0.0};

  bool present() const noexcept { return count > 0; }
};

struct SceneParts {
  ScenePart textures;         ///< images, masks among them; with the opening of their module
  ScenePart masks;            ///< shapes whose hits are filtered
  ScenePart normals;          ///< meshes with normals at their vertices
  ScenePart uvs;              ///< shapes with texture coordinates
  ScenePart environment;      ///< texels of the table
  ScenePart light_crossings;  ///< mesh lights with a ray scene of their own
  ScenePart delta_lights;     ///< lights without a density
};

/// Adds the time of its own life to a sum in seconds, of a part for example.
class PartTimer {
 public:
  explicit PartTimer(double& sum_s) : sum_s_(&sum_s), start_(std::chrono::steady_clock::now()) {}
  explicit PartTimer(ScenePart& part) : PartTimer(part.build_s) {}
  ~PartTimer() {
    *sum_s_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  PartTimer(const PartTimer&) = delete;
  PartTimer& operator=(const PartTimer&) = delete;

 private:
  double* sum_s_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace penumbra
