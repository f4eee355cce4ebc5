#pragma once

#include <filesystem>
#include <string>

/// references/small/: the references that are part of the repository, with a manifest of what each
/// is and of its bytes, so that a file that was changed, cut or forgotten is noticed.
namespace penumbra {

/// The folder, of this project.
std::filesystem::path small_references();

/// references/manifest.json, of this project.
std::filesystem::path reference_manifest();

/// Whether a file lies in `small_references()`.
bool is_small_reference(const std::filesystem::path& file);

/// Checks the bytes of a file of `small_references()` against its entry in the manifest.
/// @throws ReferenceError naming file and manifest, when there is no entry or it has another id or
/// hash
/// @throws RunError when one of the two can not be read
void check_small_reference(const std::filesystem::path& file, const std::string& id);

/// Copies a reference into `small_references()` and adds or replaces its entry in the manifest. An
/// entry holds scene, id, file, scene_hash, resolution, camera_samples, quantity, type, spp,
/// core_version, commit, lineage, bytes and the XXH3 hash of the bytes; entries are in the order of
/// scenes and ids.
/// @param file  of a reference, checked
/// @return the copy
/// @throws RunError when something can not be read or written
std::filesystem::path publish_small_reference(const std::filesystem::path& file);

}  // namespace penumbra
