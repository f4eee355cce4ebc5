#include <fmt/format.h>

#include <algorithm>

#include "harness/experiment.h"
#include "harness/image_file.h"
#include "harness/map_strips.h"
#include "harness/picture.h"
#include "harness/progress.h"
#include "harness/render.h"

namespace penumbra {

bool has_pictures(const ExperimentConfig& config, const Cell& cell) {
  if (!config.budget) return true;
  const std::vector<double>& times = config.budget->times;
  return cell.budget_time == *std::max_element(times.begin(), times.end());
}

std::filesystem::path Experiment::image_file(const Cell& cell, const std::string& suffix) const {
  return penumbra::image_file(options_.out, config_.scenes[cell.scene].name, cell, suffix);
}

void Experiment::write_pictures() {
  const WorkShare share = rank_share();
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    const Cell& cell = cells_[c];
    if (interrupted()) return;
    if (!share.has(c) || !has_pictures(config_, cell)) continue;
    if (!std::filesystem::exists(image_file(cell, ".exr"))) write_cell_pictures(cell);
  }
}

// The image of block 0 again, which its seed reproduces bit by bit, with the estimator's maps,
// which a timed run must not pay for.
void Experiment::write_cell_pictures(const Cell& cell) {
  const LoadedScene& scene = scenes_[cell.scene];
  const Reference& reference = *references_[cell.scene];
  RenderSettings settings = render_settings(cell, run_seed(config_, cell, 0), threads_);
  settings.maps = config_.images.maps;
  const RenderResult result = render(*scene.scene, scene.points, settings);
  const Image picture = add_images(result.width, result.height, result.radiance,
                                   seen_emission(*scene.scene, scene.points));
  const Image reflected = result.image();
  Image error = make_image(result.width, result.height);
  for (std::size_t i = 0; i < error.pixels.size(); ++i) {
    error.pixels[i] =
        reflected.pixels[i] - (reference.half_a.pixels[i] + reference.half_b.pixels[i]) * 0.5f;
  }
  std::vector<ExrLayer> layers = {{"", picture}, {"reflected", reflected}, {"error", error}};
  for (std::size_t m = 0; m < result.maps.size(); ++m) {
    layers.push_back({result.map_infos[m].name, result.maps[m]});
  }
  const float exposure = config_.images.exposure;
  write_png_rgb(image_file(cell, ".png"), picture, exposure);
  for (const CropConfig& crop_config : config_.images.crops) {
    if (crop_config.scene != scene.config->name) continue;
    const auto& r = crop_config.rectangle;
    write_png_rgb(image_file(cell, "-" + slug(crop_config.name) + ".png"),
                  crop(picture, {r[0], r[1], r[2], r[3]}), exposure);
  }
  write_map_strips(image_file(cell, "-maps.png"), result,
                   fmt::format("{}, {}", scene.config->name, cell.label));
  // Last: the file whose presence says that all pictures of the cell are there.
  write_exr(image_file(cell, ".exr"), layers,
            {{"cell", cell.id},
             {"label", cell.label},
             {"spp", std::to_string(cell.spp)},
             {"srl", cell.srl.text()},
             {"geometry", scene.scene->traits().geometry},
             {"reference_id", reference.id}});
}

}  // namespace penumbra
