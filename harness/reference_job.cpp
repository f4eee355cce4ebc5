#include "harness/reference_job.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/build_info.h"
#include "harness/clocks.h"
#include "harness/keys.h"
#include "harness/pixel_record.h"
#include "harness/progress.h"
#include "harness/reference_metadata.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr double kSaveInterval_s = 60.0;

int tile_side(const ShadingPoints& points) {
  int side = 1;
  for (const TileRect& tile : points.tiles) side = std::max({side, tile.width, tile.height});
  return side;
}

}  // namespace

void ReferenceJob::Half::add(const RenderResult& pass, int pass_spp) {
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum[i] += pass.radiance[i] * static_cast<double>(pass_spp);
  }
  spp += pass_spp;
}

Image ReferenceJob::Half::mean(int width, int height) const {
  Image image = make_image(width, height);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    image.pixels[i] = Rgb(Imath::V3f(sum[i] / static_cast<double>(spp)));
  }
  return image;
}

ReferenceJob::ReferenceJob(const LoadedScene& scene, std::string id, std::filesystem::path file,
                           int threads)
    : scene_(scene), id_(std::move(id)), file_(std::move(file)), threads_(threads) {
  const std::size_t pixels =
      static_cast<std::size_t>(scene.points.width) * static_cast<std::size_t>(scene.points.height);
  for (Half& half : halves_) half.sum.assign(pixels, Vec3d(0.0));
}

void ReferenceJob::resume(const ExrFile& file) {
  const char* layers[2] = {"half_a", "half_b"};
  lineage_ = reference_lineage(file);
  const int half_spp = reference_count(file, "spp") / 2;
  for (std::size_t h = 0; h < 2; ++h) {
    const Image& image = file.image(layers[h]);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      halves_[h].sum[i] = Vec3d(image.pixels[i]) * static_cast<double>(half_spp);
    }
    halves_[h].spp = half_spp;
  }
  for (const nlohmann::json& entry : lineage_) next_pass_ += entry.at("passes").get<int>();
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

nlohmann::json ReferenceJob::lineage_entry() const {
  const ReferenceConfig& config = scene_.config->reference;
  return {
      {"estimator", config.estimator},
      {"sampler", config.sampler},
      {"srl", config.srl.text()},
      {"params", reference_settings(scene_, threads_)
                     .params.differences(reference_settings(scene_, threads_).estimator->params())},
      {"tile", tile_side(scene_.points)},
      {"first_pass", next_pass_},
      {"passes", 0},
      {"spp", 0}};
}

RenderResult ReferenceJob::render_pass(RenderSettings& settings, int half) const {
  settings.seed = hash_texts({"reference", id_, half == 0 ? "a" : "b", std::to_string(next_pass_)});
  RenderResult pass = render(*scene_.scene, scene_.points, settings);
  if (pass.bad_count == 0) return pass;
  pass.bad.resize(1);
  find_causes(*scene_.scene, scene_.points, settings, pass);
  throw RunError(fmt::format(
      "reference of scene \"{}\": {} estimates are not finite or negative, the first at {}",
      scene_.scene->name(), pass.bad_count, describe(pass.bad.front())));
}

void ReferenceJob::run(int target) {
  RenderSettings pass_settings = reference_settings(scene_, threads_);
  const int begun = spp();
  lineage_.push_back(lineage_entry());
  Progress progress("reference " + scene_.scene->name(), target - begun);
  Stopwatch since_save;
  while (spp() < target) {
    for (int h = 0; h < 2; ++h) {
      halves_[h].add(render_pass(pass_settings, h), pass_settings.spp);
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

void ReferenceJob::run_exact() {
  RenderSettings pass_settings = reference_settings(scene_, threads_);
  const RenderResult first = render_pass(pass_settings, 0);
  const RenderResult second = render_pass(pass_settings, 1);
  if (first.radiance_hash() != second.radiance_hash()) {
    throw RunError("reference of scene \"" + scene_.scene->name() +
                   "\": two seeds give different pictures, so it is no exact sum; use "
                   "reference.type \"sampled\"");
  }
  nlohmann::json entry = lineage_entry();
  entry["type"] = to_string(ReferenceType::ExactSum);
  entry["passes"] = 1;
  entry["spp"] = pass_settings.spp;
  lineage_ = nlohmann::json::array({entry});
  const Image image = first.image();
  write(image, image, ReferenceType::ExactSum, pass_settings.spp);
}

void ReferenceJob::save() const {
  const int width = scene_.points.width;
  const int height = scene_.points.height;
  write(halves_[0].mean(width, height), halves_[1].mean(width, height), ReferenceType::Sampled,
        spp());
}

void ReferenceJob::write(const Image& a, const Image& b, ReferenceType type, int spp) const {
  Image mean = make_image(a.width, a.height);
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
             {"reference_type", std::string(to_string(type))},
             {"spp", std::to_string(spp)},
             {"estimator", lineage_.back().at("estimator").get<std::string>()},
             {"seed", "hash of (reference, id, half, pass)"},
             {"core_version", std::to_string(kCoreVersion)},
             {"commit", std::string(build_info().commit)},
             {"lineage", lineage_.dump()}});
}

}  // namespace penumbra
