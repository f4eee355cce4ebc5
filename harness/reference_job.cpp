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

// Every pixel has one rank with a number and 0 from the others, so the sums are exact.
std::vector<Vec3d> ReferenceJob::joined(const std::vector<Vec3d>& pixels) const {
  if (ranks_.count() == 1) return pixels;
  const std::vector<TileRect>& tiles = scene_.points.tiles;
  const WorkShare own = settings().tiles;
  std::vector<double> numbers(3 * pixels.size(), 0.0);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    if (!own.has(t)) continue;
    for (int y = tiles[t].y0; y < tiles[t].y0 + tiles[t].height; ++y) {
      for (int x = tiles[t].x0; x < tiles[t].x0 + tiles[t].width; ++x) {
        const std::size_t place = pixel_index(scene_.points.width, x, y);
        for (int c = 0; c < 3; ++c) {
          numbers[3 * place + static_cast<std::size_t>(c)] = pixels[place][c];
        }
      }
    }
  }
  ranks_.sum_to_root(numbers);
  std::vector<Vec3d> result(pixels.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  }
  return result;
}

Image ReferenceJob::mean(const Half& half) const {
  const std::vector<Vec3d> sum = joined(half.sum);
  Image image = make_image(scene_.points.width, scene_.points.height);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    image.pixels[i] = Rgb(Imath::V3f(sum[i] / static_cast<double>(half.spp)));
  }
  return image;
}

ReferenceJob::ReferenceJob(const LoadedScene& scene, std::string id, std::filesystem::path file,
                           int threads, const Ranks& ranks)
    : scene_(scene), id_(std::move(id)), file_(std::move(file)), threads_(threads), ranks_(ranks) {
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

RenderSettings ReferenceJob::settings() const {
  RenderSettings settings = reference_settings(scene_, threads_);
  settings.tiles = {ranks_.rank(), ranks_.count()};
  return settings;
}

// All ranks save together, when the root's clock says so.
bool ReferenceJob::is_time_to_save(double seconds) const {
  return ranks_.from_root(seconds > kSaveInterval_s ? "yes" : "") == "yes";
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
  RenderSettings pass_settings = settings();
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
    if (is_time_to_save(since_save.wall_s())) {
      save();
      since_save = Stopwatch();
    }
  }
  save();
  progress.finish();
}

void ReferenceJob::run_exact() {
  RenderSettings pass_settings = settings();
  RenderResult first = render_pass(pass_settings, 0);
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
  first.radiance = joined(first.radiance);
  const Image image = first.image();
  write(image, image, ReferenceType::ExactSum, pass_settings.spp);
}

void ReferenceJob::save() const {
  const Image a = mean(halves_[0]);
  const Image b = mean(halves_[1]);
  write(a, b, ReferenceType::Sampled, spp());
}

void ReferenceJob::write(const Image& a, const Image& b, ReferenceType type, int spp) const {
  if (!ranks_.is_root()) return;
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
