#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "harness/config.h"
#include "harness/exr.h"
#include "harness/metrics.h"
#include "harness/mpi_ranks.h"
#include "harness/render.h"
#include "harness/scene_store.h"

/// References: the truth of a scene's shading points as two independent halves, found by a hash of
/// everything that decides it, and extendable.
namespace penumbra {

/// A reference as read from its file.
struct Reference {
  std::string id;  ///< hash of what decides the truth
  std::filesystem::path file;
  ReferenceType type{ReferenceType::Sampled};  ///< Sampled or ExactSum
  int spp{0};  ///< estimates per pixel, both halves together; of an exact sum, one for each of the
               ///< pixel's shading points
  /// Side of the squares [pixels], from the upper left, within which the noise of pixels may be
  /// correlated because the estimator shares information there. 1: pixels are independent, 0:
  /// nowhere known to be.
  int correlated_side{1};
  Image half_a, half_b;  ///< [y][x], radiance without the emission of lights seen directly; equal
                         ///< in an exact sum

  ReferenceHalves halves() const { return {half_a.pixels, half_b.pixels}; }
  bool exact() const { return type == ReferenceType::ExactSum; }
};

/// Hash of all that decides the truth: scene content and resolution, camera samples, quantity, core
/// version. How the reference was sampled does not take part.
std::string reference_id(const LoadedScene& scene);

/// How the truth of a scene is found: Sampled or ExactSum. With the shading points fixed, lights
/// without extent bring a finite sum, which every estimator adds without randomness.
/// @throws InputError when the config asks for an exact sum and the scene has other lights
ReferenceType reference_type(const LoadedScene& scene);

/// The reference of a scene in references/small/ (in git) or references/ (a cache), of two that
/// with more samples.
/// @return nullopt where there is none
/// @throws ReferenceError as read_reference
std::optional<Reference> find_reference(const LoadedScene& scene);
std::optional<Reference> find_reference(const std::string& id);

/// Reads a reference and checks that it is what its name says; one of references/small/ also
/// against the manifest there.
/// @throws ReferenceError when it belongs to something else, lacks a half or is not the manifest's,
/// RunError when it can not be read
Reference read_reference(const std::filesystem::path& file, const std::string& id);

/// Finds the reference of a scene, renders it when there is none and adds samples when it has fewer
/// than asked for. What is rendered goes into the cache references/, whose file is rewritten at
/// least once a minute, so that a killed render goes on from there. An exact sum has nothing to add
/// to; a sampled reference of a scene that has one gives way to it.
/// @param add_spp  estimates per pixel to add to what is there, on top of what the config asks for
/// @param ranks  which call this together and share the tiles of the image; their number shows in
///               no bit
/// @throws InputError as reference_type
/// @throws ReferenceError when an existing file is not usable
/// @throws RunError when this rank does not see the file that the root has written
Reference provide_reference(const LoadedScene& scene, int threads, int add_spp = 0,
                            const Ranks& ranks = single_rank());

/// One line for people: file, samples, and noise relative to the mean of the image.
std::string describe(const std::string& scene_name, const Reference& reference);

/// Estimates per pixel to add to a reference of `spp` so that its share of an error falls from
/// `share` to kShareToWarn: the reference's variance falls as 1 / spp.
/// @param share           above 0; nothing: the error is not above the reference's noise, which
///                        tells no number, and four times the samples are a step
/// @param camera_samples  each half gets a multiple of these
/// @return 0 when the share is low enough
std::int64_t spp_to_add(std::optional<double> share, int spp, int camera_samples);

}  // namespace penumbra
