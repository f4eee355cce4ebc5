#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/exr.h"
#include "harness/reference.h"
#include "harness/render.h"
#include "harness/scene_store.h"

namespace penumbra {

/// How the reference of a scene is rendered: one pass with one estimate at every shading point.
RenderSettings reference_settings(const LoadedScene& scene, int threads);

/// Renders the reference of a scene into its file.
class ReferenceJob {
 public:
  /// @param scene  outlives the job
  /// @param file   written at least once a minute
  ReferenceJob(const LoadedScene& scene, std::string id, std::filesystem::path file, int threads);

  /// Estimates per pixel, both halves together.
  int spp() const { return halves_[0].spp + halves_[1].spp; }

  /// Takes over what a file holds; its lineage says which seeds are used up.
  void resume(const ExrFile& file);

  /// Renders passes of equal size, alternating between the halves, until there are `target`
  /// estimates per pixel.
  /// @throws RunError when an estimate is not finite or negative
  void run(int target);

  /// Renders the finite sum over lights without extent: one estimate at every shading point. It is
  /// rendered with two seeds, whose pictures must have the same bits.
  /// @throws RunError when they have not
  void run_exact();

 private:
  /// Running sums of one half, in double; the file keeps their means in float.
  struct Half {
    std::vector<Vec3d> sum;
    int spp{0};

    void add(const RenderResult& pass, int pass_spp);
    Image mean(int width, int height) const;
  };

  nlohmann::json lineage_entry() const;
  RenderResult render_pass(RenderSettings& settings, int half) const;
  void save() const;
  void write(const Image& a, const Image& b, ReferenceType type, int spp) const;

  const LoadedScene& scene_;
  std::string id_;
  std::filesystem::path file_;
  int threads_;
  Half halves_[2];
  nlohmann::json lineage_ = nlohmann::json::array();
  int next_pass_{0};
};

}  // namespace penumbra
