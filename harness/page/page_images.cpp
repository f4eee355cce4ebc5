#include "harness/page/page_images.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <cstring>

#include "harness/atomic_file.h"
#include "harness/exr.h"
#include "harness/image_file.h"
#include "harness/result_pictures.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

static_assert(std::endian::native == std::endian::little, "scripts hold little-endian floats");

constexpr const char* kFolder = "report_files";

/// Channel after channel.
std::vector<float> planar(const Image& image) {
  const std::size_t n = image.pixels.size();
  std::vector<float> values(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    values[i] = image.pixels[i].x;
    values[n + i] = image.pixels[i].y;
    values[2 * n + i] = image.pixels[i].z;
  }
  return values;
}

/// All lowest bytes, then all second ones, and so on.
std::vector<unsigned char> sorted_by_significance(const std::vector<float>& values) {
  constexpr std::size_t kBytes = sizeof(float);
  std::vector<unsigned char> bytes(values.size() * kBytes);
  for (std::size_t i = 0; i < values.size(); ++i) {
    unsigned char raw[kBytes];
    std::memcpy(raw, &values[i], kBytes);
    for (std::size_t b = 0; b < kBytes; ++b) bytes[b * values.size() + i] = raw[b];
  }
  return bytes;
}

std::string base64(const std::vector<unsigned char>& bytes) {
  namespace iterators = boost::archive::iterators;
  using Encoder =
      iterators::base64_from_binary<iterators::transform_width<const unsigned char*, 6, 8>>;
  std::string text(Encoder(bytes.data()), Encoder(bytes.data() + bytes.size()));
  text.append((3 - bytes.size() % 3) % 3, '=');
  return text;
}

std::string pixel_script(const std::string& key, const std::vector<float>& values) {
  const std::vector<unsigned char> bytes = sorted_by_significance(values);
  uLongf size = compressBound(bytes.size());
  std::vector<unsigned char> packed(size);
  // Level 1: noise hardly compresses better at 9, which takes five times as long.
  const int result = compress2(packed.data(), &size, bytes.data(), bytes.size(), 1);
  PN_CHECK(result == Z_OK, "the buffer is as large as zlib asks for");
  packed.resize(size);
  return fmt::format("penumbraPixels(\"{}\",\"{}\");\n", key, base64(packed));
}

/// A picture and the pixels that it has.
struct Source {
  PageImage image;
  std::vector<float> values;
};

/// In words, what has no picture.
std::vector<std::string> missing_pictures(const Report& report,
                                          const std::vector<ResultPicture>& pictures) {
  std::vector<std::string> missing;
  for (const EfficiencyRow& row : report.tables.efficiency) {
    const bool found =
        std::any_of(pictures.begin(), pictures.end(), [&](const ResultPicture& picture) {
          const RunRow& run = picture.run;
          return run.scene == row.scene && run.label == row.label && run.sampler == row.sampler;
        });
    const std::string text =
        fmt::format("picture of {}, {} ({})", row.scene, row.label, row.sampler);
    if (!found && std::find(missing.begin(), missing.end(), text) == missing.end()) {
      missing.push_back(text);
    }
  }
  return missing;
}

Source source_of(const ResultPicture& picture, const std::string& layer, int channels,
                 const ExrFile& file, std::vector<float> values) {
  PageImage image;
  image.key = fmt::format("{}-{}", picture.run.run_id, slug(layer));
  image.scene = picture.run.scene;
  image.label = picture.run.label;
  image.sampler = picture.run.sampler;
  image.layer = layer;
  image.run_id = picture.run.run_id;
  image.row = static_cast<int>(picture.row);
  image.width = file.width;
  image.height = file.height;
  image.channels = channels;
  return {image, std::move(values)};
}

Source reference_of(const ResultPicture& picture, const ExrFile& file) {
  Source source = source_of(picture, "radiance", 3, file, planar(reference_picture(file)));
  source.image.key = "reference-" + slug(picture.run.scene);
  source.image.label.clear();
  source.image.sampler.clear();
  source.image.run_id.clear();
  source.image.row = -1;
  return source;
}

std::vector<Source> sources_of(const ResultPicture& picture, bool with_reference) {
  const ExrFile file = read_exr(picture.file);
  std::vector<Source> sources;
  if (with_reference) sources.push_back(reference_of(picture, file));
  sources.push_back(source_of(picture, "radiance", 3, file, planar(file.image())));
  for (const ExrLayer& layer : file.layers) {
    if (const auto* map = std::get_if<ScalarImage>(&layer.content)) {
      sources.push_back(source_of(picture, layer.name, 1, file, map->pixels));
    }
  }
  return sources;
}

void store(const std::filesystem::path& folder, bool embed, Source& source, std::string& script) {
  script = pixel_script(source.image.key, source.values);
  source.values = {};
  if (embed) return;
  source.image.script = fmt::format("{}/{}.js", kFolder, source.image.key);
  write_file_atomically(folder / source.image.script, script);
  script.clear();
}

}  // namespace

PageImages make_page_images(const std::filesystem::path& folder, const Report& report, bool embed) {
  PageImages result;
  const std::vector<ResultPicture> pictures = result_pictures(folder, report);
  result.missing = missing_pictures(report, pictures);
  if (!embed && !pictures.empty()) std::filesystem::create_directories(folder / kFolder);
  struct Outcome {
    std::vector<PageImage> images;
    std::string scripts, fault;
  };
  std::vector<Outcome> outcomes(pictures.size());
  tbb::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t i) {
    const bool first = i == 0 || pictures[i - 1].run.scene != pictures[i].run.scene;
    Outcome& outcome = outcomes[i];
    std::vector<Source> sources;
    try {
      sources = sources_of(pictures[i], first);
    } catch (const RunError& error) {
      outcome.fault = error.what();
      return;
    }
    for (Source& source : sources) {
      std::string script;
      store(folder, embed, source, script);
      outcome.images.push_back(source.image);
      outcome.scripts += script;
    }
  });
  for (Outcome& outcome : outcomes) {
    if (!outcome.fault.empty()) result.missing.push_back(outcome.fault);
    result.images.insert(result.images.end(), outcome.images.begin(), outcome.images.end());
    result.scripts += outcome.scripts;
  }
  return result;
}

}  // namespace penumbra
