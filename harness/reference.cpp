#include "harness/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "estimators/estimator.h"
#include "harness/inspection_lights.h"
#include "harness/keys.h"
#include "harness/progress.h"
#include "harness/project_root.h"
#include "harness/reference_job.h"
#include "harness/reference_manifest.h"
#include "harness/reference_metadata.h"
#include "harness/tile.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

std::string file_name(const std::string& scene_name, const std::string& id) {
  return scene_name + "-" + id + ".exr";
}

// Files of older versions have no type.
ReferenceType type_of(const ExrFile& exr) {
  const auto found = exr.metadata.find("reference_type");
  if (found == exr.metadata.end()) return ReferenceType::Sampled;
  return parse_reference_type(found->second).value_or(ReferenceType::Sampled);
}

int spp_of(const ExrFile& exr) { return reference_count(exr, "spp"); }

// Whether a layer can be the truth: a picture of numbers that an estimator may give.
void check_half(const ExrFile& exr, const std::string& name) {
  const auto layer = std::find_if(exr.layers.begin(), exr.layers.end(), [&](const ExrLayer& l) {
    return l.name == name && std::holds_alternative<Image>(l.content);
  });
  if (layer == exr.layers.end()) {
    throw ReferenceError(exr.path.string() + ": a half of the reference is missing");
  }
  const Image& image = std::get<Image>(layer->content);
  const auto bad = std::find_if(image.pixels.begin(), image.pixels.end(), is_bad);
  if (bad == image.pixels.end()) return;
  const auto place = static_cast<int>(bad - image.pixels.begin());
  throw ReferenceError(fmt::format(
      "{}: layer \"{}\", pixel {},{} is ({}, {}, {}); a reference is finite and not negative",
      exr.path.string(), name, place % image.width, place / image.width, bad->x, bad->y, bad->z));
}

ExrFile read_checked(const std::filesystem::path& file, const std::string& id) {
  if (is_small_reference(file)) check_small_reference(file, id);
  ExrFile exr = read_exr(file);
  const std::string& found_id = reference_text(exr, "reference_id");
  reference_count(exr, "spp");
  reference_lineage(exr);
  if (found_id != id) {
    throw ReferenceError(file.string() + ": is the reference " + found_id + ", not " + id);
  }
  check_half(exr, "half_a");
  check_half(exr, "half_b");
  return exr;
}

// Whether `a` is to be preferred to `b`.
bool better(const ExrFile& a, const ExrFile& b) {
  const bool exact_a = type_of(a) == ReferenceType::ExactSum;
  const bool exact_b = type_of(b) == ReferenceType::ExactSum;
  return exact_a != exact_b ? exact_a : spp_of(a) > spp_of(b);
}

// The id decides; the name in front of it is for people.
std::optional<ExrFile> find_file(const std::string& id) {
  std::optional<ExrFile> best;
  for (const std::filesystem::path& folder : {small_references(), project_root() / "references"}) {
    if (!std::filesystem::is_directory(folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (!entry.path().filename().string().ends_with(file_name("", id))) continue;
      ExrFile found = read_checked(entry.path(), id);
      if (!best || better(found, *best)) best = std::move(found);
    }
  }
  return best;
}

// Reference::correlated_side of what the lineage says.
int correlated_side(const ExrFile& exr) {
  int side = 1;
  for (const nlohmann::json& entry : reference_lineage(exr)) {
    const EstimatorEntry* const estimator = find_estimator(entry.value("estimator", ""));
    if (estimator != nullptr && !estimator->shares_in_tile) continue;
    const int tile = entry.value("tile", 0);
    if (tile == 0) return 0;
    // Squares of two sides have a common multiple; one pass of each is rare enough to give up.
    if (side != 1 && side != tile) return 0;
    side = tile;
  }
  return side;
}

Reference to_reference(const ExrFile& exr, const std::string& id) {
  return {id,
          exr.path,
          type_of(exr),
          spp_of(exr),
          correlated_side(exr),
          exr.image("half_a"),
          exr.image("half_b")};
}

// The id is of the scene and its resolution, but nothing ties a file's pixels to its id.
std::optional<ExrFile> find_file(const LoadedScene& scene, const std::string& id) {
  std::optional<ExrFile> found = find_file(id);
  const ShadingPoints& points = scene.points;
  if (found && (found->width != points.width || found->height != points.height)) {
    throw ReferenceError(fmt::format("{}: has {} x {} pixels, scene \"{}\" has {} x {}",
                                     found->path.string(), found->width, found->height,
                                     scene.config->name, points.width, points.height));
  }
  return found;
}

// What the root finds, or nothing, on all ranks.
std::optional<ExrFile> find_file(const LoadedScene& scene, const std::string& id,
                                 const Ranks& ranks) {
  std::optional<ExrFile> found;
  if (ranks.is_root()) found = find_file(scene, id);
  const std::string file = ranks.from_root(found ? found->path.string() : "");
  if (!found && !file.empty()) found = read_checked(file, id);
  ranks.barrier();  // nobody writes while others read
  return found;
}

// What the root has written.
Reference read_written(const std::filesystem::path& file, const std::string& id,
                       const Ranks& ranks) {
  ranks.barrier();
  if (!std::filesystem::exists(file)) {
    throw RunError(file.string() + ": is not seen here; ranks need a file system that they share");
  }
  return read_reference(file, id);
}

}  // namespace

std::string reference_id(const LoadedScene& scene) {
  return hash_id({"reference", scene.scene->content_hash(), to_string(scene.points.quantity),
                  std::to_string(scene.points.width), std::to_string(scene.points.height),
                  std::to_string(scene.points.camera_samples), std::to_string(kCameraSeed),
                  std::to_string(kCoreVersion)});
}

ReferenceType reference_type(const LoadedScene& scene) {
  const ReferenceType wanted = scene.config->reference.type;
  if (wanted == ReferenceType::Sampled) return wanted;
  std::string others;
  for (const std::uint32_t id : scene.scene->sampled_lights()) {
    const Light& light = scene.scene->lights()[id];
    others +=
        fmt::format("{}\"{}\" ({})", others.empty() ? "" : ", ", light.name, type_name(light.type));
  }
  if (others.empty()) return ReferenceType::ExactSum;
  if (wanted == ReferenceType::Auto) return ReferenceType::Sampled;
  throw InputError(fmt::format(
      "scene \"{}\" ({}): reference.type \"exact_sum\" is for scenes whose lights are all of type "
      "point, spot or directional; found {}; allowed here: \"auto\", \"sampled\"",
      scene.config->name, scene.config->file.string(), others));
}

std::optional<Reference> find_reference(const LoadedScene& scene) {
  const std::string id = reference_id(scene);
  const std::optional<ExrFile> found = find_file(scene, id);
  if (!found) return std::nullopt;
  return to_reference(*found, id);
}

std::optional<Reference> find_reference(const std::string& id) {
  const std::optional<ExrFile> found = find_file(id);
  if (!found) return std::nullopt;
  return to_reference(*found, id);
}

Reference read_reference(const std::filesystem::path& file, const std::string& id) {
  return to_reference(read_checked(file, id), id);
}

Reference provide_reference(const LoadedScene& scene, int threads, int add_spp,
                            const Ranks& ranks) {
  const ReferenceType type = reference_type(scene);
  const std::string id = reference_id(scene);
  const std::string& name = scene.scene->name();
  const std::optional<ExrFile> found = find_file(scene, id, ranks);
  const bool found_exact = found && type_of(*found) == ReferenceType::ExactSum;
  if (add_spp > 0 && (found_exact || type == ReferenceType::ExactSum)) {
    if (ranks.is_root())
      note("reference of " + scene.config->name +
           ": an exact sum has no noise that more samples could lower; none were added");
  }
  if (found_exact) return to_reference(*found, id);

  const std::filesystem::path file = project_root() / "references" / file_name(name, id);
  ReferenceJob job(scene, id, file, threads, ranks);
  if (type == ReferenceType::ExactSum) {
    job.run_exact();
    return read_written(file, id, ranks);
  }
  if (found) job.resume(*found);
  const int target = std::max(scene.config->reference.spp, job.spp()) + add_spp;
  if (job.spp() >= target) return to_reference(*found, id);
  job.run(target);
  return read_written(file, id, ranks);
}

std::string describe(const std::string& scene_name, const Reference& reference) {
  const ReferenceNoise noise = reference_noise(reference.halves());
  std::string text = fmt::format(
      "reference of {}: {}: {}, {} spp, mean {:.6g}", scene_name, reference.file.string(),
      reference.exact() ? "exact sum" : "sampled", reference.spp, noise.mean);
  if (reference.exact()) return text + ", no noise";
  if (!(noise.mean > 0)) return text + ", no relative noise";
  return text + fmt::format(", noise {:.2g} % of the mean per pixel, {:.2g} % of the whole image",
                            100 * std::sqrt(noise.variance) / noise.mean,
                            100 * noise.mean_se / noise.mean);
}

std::int64_t spp_to_add(std::optional<double> share, int spp, int camera_samples) {
  if (!share) return std::int64_t{3} * spp;
  if (!(*share > kShareToWarn)) return 0;
  const double missing = spp * (*share / kShareToWarn - 1.0);
  const std::int64_t step = std::int64_t{2} * camera_samples;
  return step * static_cast<std::int64_t>(std::ceil(missing / static_cast<double>(step)));
}

}  // namespace penumbra
