#include "harness/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "harness/build_info.h"
#include "harness/clocks.h"
#include "harness/keys.h"
#include "harness/progress.h"
#include "harness/project_root.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr double kSaveInterval_s = 60.0;

// Running sums of one half, in double; the file keeps their means in float.
struct Half {
  std::vector<Vec3d> sum;
  int spp{0};

  void add(const RenderResult& pass, int pass_spp) {
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += pass.radiance[i] * static_cast<double>(pass_spp);
    }
    spp += pass_spp;
  }
  Image mean(int width, int height) const {
    Image image = make_image(width, height);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      image.pixels[i] = Rgb(Imath::V3f(sum[i] / static_cast<double>(spp)));
    }
    return image;
  }
};

class ReferenceJob {
 public:
  ReferenceJob(const LoadedScene& scene, std::string id, std::filesystem::path file, int threads)
      : scene_(scene), id_(std::move(id)), file_(std::move(file)), threads_(threads) {
    const std::size_t pixels = static_cast<std::size_t>(scene.points.width) *
                               static_cast<std::size_t>(scene.points.height);
    for (Half& half : halves_) half.sum.assign(pixels, Vec3d(0.0));
  }

  int spp() const { return halves_[0].spp + halves_[1].spp; }

  // Takes over what a file holds; its lineage says which seeds are used up.
  void resume(const ExrFile& file) {
    const char* layers[2] = {"half_a", "half_b"};
    lineage_ = nlohmann::json::parse(file.metadata.at("lineage"));
    const int half_spp = std::stoi(file.metadata.at("spp")) / 2;
    for (std::size_t h = 0; h < 2; ++h) {
      const Image& image = file.image(layers[h]);
      for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        halves_[h].sum[i] = Vec3d(image.pixels[i]) * static_cast<double>(half_spp);
      }
      halves_[h].spp = half_spp;
    }
    for (const nlohmann::json& entry : lineage_) next_pass_ += entry.at("passes").get<int>();
  }

  // Renders passes of equal size, alternating between the halves, until there are `target`
  // estimates per pixel.
  void run(int target) {
    const ReferenceConfig& config = scene_.config->reference;
    RenderSettings settings = reference_settings(scene_, threads_);
    const int begun = spp();
    lineage_.push_back({{"estimator", config.estimator},
                        {"sampler", config.sampler},
                        {"srl", config.srl.text()},
                        {"params", settings.params.differences(settings.estimator->params())},
                        {"first_pass", next_pass_},
                        {"passes", 0},
                        {"spp", 0}});
    Progress progress("reference " + scene_.scene->name(), target - begun);
    Stopwatch since_save;
    while (spp() < target) {
      for (std::size_t h = 0; h < 2; ++h) {
        settings.seed =
            hash_texts({"reference", id_, h == 0 ? "a" : "b", std::to_string(next_pass_)});
        const RenderResult pass = render(*scene_.scene, scene_.points, settings);
        if (pass.bad_count > 0) fail_on(pass);
        halves_[h].add(pass, settings.spp);
        progress.update(spp() - begun);
      }
      ++next_pass_;
      lineage_.back()["passes"] = lineage_.back()["passes"].get<int>() + 1;
      lineage_.back()["spp"] = spp() - begun;
      if (since_save.wall_s() > kSaveInterval_s) {
        save();
        since_save = Stopwatch();
      }
    }
    save();
    progress.finish();
  }

 private:
  [[noreturn]] void fail_on(const RenderResult& pass) const {
    const BadEstimate& bad = pass.bad.front();
    throw RunError(fmt::format(
        "reference of scene \"{}\": {} estimates are not finite or negative, first at pixel {},{} "
        "estimate {}: ({}, {}, {})",
        scene_.scene->name(), pass.bad_count, bad.x, bad.y, bad.estimate, bad.value.x, bad.value.y,
        bad.value.z));
  }

  void save() const {
    const int width = scene_.points.width;
    const int height = scene_.points.height;
    const Image a = halves_[0].mean(width, height);
    const Image b = halves_[1].mean(width, height);
    Image mean = make_image(width, height);
    for (std::size_t i = 0; i < mean.pixels.size(); ++i) {
      mean.pixels[i] = (a.pixels[i] + b.pixels[i]) * 0.5f;
    }
    std::filesystem::create_directories(file_.parent_path());
    write_exr(file_, {{"", mean}, {"half_a", a}, {"half_b", b}},
              {{"reference_id", id_},
               {"scene", scene_.scene->name()},
               {"scene_hash", scene_.scene->content_hash()},
               {"quantity", std::string(to_string(scene_.points.quantity))},
               {"camera_samples", std::to_string(scene_.points.camera_samples)},
               {"spp", std::to_string(spp())},
               {"estimator", lineage_.back().at("estimator").get<std::string>()},
               {"seed", "hash of (reference, id, half, pass)"},
               {"core_version", std::to_string(kCoreVersion)},
               {"commit", std::string(build_info().commit)},
               {"lineage", lineage_.dump()}});
  }

  const LoadedScene& scene_;
  std::string id_;
  std::filesystem::path file_;
  int threads_;
  Half halves_[2];
  nlohmann::json lineage_ = nlohmann::json::array();
  int next_pass_{0};
};

std::string file_name(const std::string& scene_name, const std::string& id) {
  return scene_name + "-" + id + ".exr";
}

ExrFile read_checked(const std::filesystem::path& file, const std::string& id) {
  ExrFile exr = read_exr(file);
  for (const char* key : {"reference_id", "spp", "lineage"}) {
    if (exr.metadata.count(key) == 0) {
      throw ReferenceError(file.string() + ": not a reference: metadata \"" + key +
                           "\" is missing");
    }
  }
  if (exr.metadata.at("reference_id") != id) {
    throw ReferenceError(file.string() + ": is the reference " + exr.metadata.at("reference_id") +
                         ", not " + id);
  }
  if (!exr.has("half_a") || !exr.has("half_b")) {
    throw ReferenceError(file.string() + ": a half of the reference is missing");
  }
  return exr;
}

}  // namespace

std::string reference_id(const LoadedScene& scene) {
  return hash_id({"reference", scene.scene->content_hash(), to_string(scene.points.quantity),
                  std::to_string(scene.points.width), std::to_string(scene.points.height),
                  std::to_string(scene.points.camera_samples), std::to_string(kCameraSeed),
                  std::to_string(kCoreVersion)});
}

RenderSettings reference_settings(const LoadedScene& scene, int threads) {
  const ReferenceConfig& config = scene.config->reference;
  std::vector<ParamProblem> problems;
  RenderSettings settings;
  settings.estimator = find_estimator(config.estimator);
  PN_CHECK(settings.estimator != nullptr, "the config was checked");
  settings.params = resolve_params(settings.estimator->params(), config.params, problems);
  settings.budget = {*parse_sampler_kind(config.sampler), config.srl.initial, config.srl.adaptive};
  settings.threads = threads;
  settings.spp = scene.points.camera_samples;
  return settings;
}

std::optional<std::filesystem::path> find_reference_file(const std::string& scene_name,
                                                         const std::string& id) {
  const std::filesystem::path folder = project_root() / "references";
  for (const std::filesystem::path& place : {folder / "small", folder}) {
    const std::filesystem::path file = place / file_name(scene_name, id);
    if (std::filesystem::exists(file)) return file;
  }
  return std::nullopt;
}

Reference read_reference(const std::filesystem::path& file, const std::string& id) {
  ExrFile exr = read_checked(file, id);
  return {id, file, std::stoi(exr.metadata.at("spp")), exr.image("half_a"), exr.image("half_b")};
}

Reference provide_reference(const LoadedScene& scene, int threads, int add_spp) {
  const std::string id = reference_id(scene);
  const std::string& name = scene.scene->name();
  const std::optional<std::filesystem::path> found = find_reference_file(name, id);
  const std::filesystem::path file =
      found.value_or(project_root() / "references" / file_name(name, id));
  ReferenceJob job(scene, id, file, threads);
  if (found) job.resume(read_checked(file, id));
  const int target = std::max(scene.config->reference.spp, found ? job.spp() : 0) + add_spp;
  if (job.spp() < target) job.run(target);
  return read_reference(file, id);
}

}  // namespace penumbra
