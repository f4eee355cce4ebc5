#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/exr.h"
#include "harness/mpi_ranks.h"
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
  /// @param ranks  which share the tiles; all make the same calls, and the root writes the file
  ReferenceJob(const LoadedScene& scene, std::string id, std::filesystem::path file, int threads,
               const Ranks& ranks);

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
  /// Running sums of one half, in double; the file keeps their means in float. Passes are added in
  /// their order at every pixel, so that neither threads nor ranks show in a bit.
  struct Half {
    std::vector<Vec3d> sum;  ///< of this rank's tiles; elsewhere without meaning
    int spp{0};

    void add(const RenderResult& pass, int pass_spp);
  };

  RenderSettings settings() const;
  /// Numbers of all ranks' tiles at the root; without meaning elsewhere.
  std::vector<Vec3d> joined(const std::vector<Vec3d>& pixels) const;
  Image mean(const Half& half) const;
  bool is_time_to_save(double seconds) const;
  nlohmann::json lineage_entry() const;
  RenderResult render_pass(RenderSettings& settings, int half) const;
  void save() const;
  void write(const Image& a, const Image& b, ReferenceType type, int spp) const;

  const LoadedScene& scene_;
  std::string id_;
  std::filesystem::path file_;
  int threads_;
  const Ranks& ranks_;
  Half halves_[2];
  nlohmann::json lineage_ = nlohmann::json::array();
  int next_pass_{0};
};

}  // namespace penumbra
