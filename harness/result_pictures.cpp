#include "harness/result_pictures.h"

#include <algorithm>

#include "harness/image_file.h"
#include "harness/replicate_files.h"

namespace penumbra {

std::vector<ResultPicture> result_pictures(const std::filesystem::path& folder,
                                           const Report& report) {
  std::vector<ResultPicture> pictures;
  const auto& rows = report.tables.efficiency;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::vector<RunRow> runs = rows_of_cell(report.rows, rows[i]);
    const auto first = std::min_element(
        runs.begin(), runs.end(), [](const auto& a, const auto& b) { return a.block < b.block; });
    if (first == runs.end()) continue;
    const auto sampler = parse_sampler_kind(first->sampler);
    if (!sampler) continue;
    Cell cell;
    cell.id = first->cell;
    cell.label = first->label;
    cell.sampler = *sampler;
    const std::filesystem::path file = image_file(folder, first->scene, cell, ".exr");
    if (std::filesystem::exists(file)) pictures.push_back({i, *first, file});
  }
  return pictures;
}

Image reference_picture(const ExrFile& picture) {
  Image reference = picture.image();
  const Image& error = picture.image("error");
  for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
    reference.pixels[i] = reference.pixels[i] - error.pixels[i];
  }
  return reference;
}

}  // namespace penumbra
