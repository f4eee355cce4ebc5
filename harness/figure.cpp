#include "harness/figure.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "harness/atomic_file.h"
#include "harness/color_bar.h"
#include "harness/number_text.h"
#include "harness/picture_canvas.h"
#include "harness/result_pictures.h"
#include "harness/summary.h"
#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr int kPanel = 240;  ///< width of a crop's panel, about [px]
constexpr int kPad = 12;
constexpr double kFont = 15;
constexpr int kLine = 22;  ///< of text [px]
constexpr std::array<Rgb8, 4> kMarks{Rgb8{213, 94, 0}, Rgb8{0, 114, 178}, Rgb8{0, 158, 115},
                                     Rgb8{204, 121, 167}};

struct Method {
  std::string label, numbers;  ///< below the panels
  Image picture;
};

struct Subject {
  Image reference;
  std::vector<Method> methods;
};

std::vector<std::string> scenes_of(const std::vector<ResultPicture>& pictures) {
  std::vector<std::string> names;
  for (const ResultPicture& picture : pictures) {
    if (std::find(names.begin(), names.end(), picture.run.scene) == names.end()) {
      names.push_back(picture.run.scene);
    }
  }
  return names;
}

std::string numbers_of(const EfficiencyRow& row, const std::string& baseline) {
  std::string text = "MSE " + number_text(row.err);
  if (row.label != baseline && row.ratio) text += fmt::format(", {}x", ratio_text(*row.ratio));
  return text;
}

/// The pictures of one scene, by the methods that were asked for.
Subject read_subject(const std::filesystem::path& folder, const Report& report,
                     const FigureOptions& options) {
  const std::vector<ResultPicture> pictures = result_pictures(folder, report);
  std::vector<const ResultPicture*> chosen;
  std::vector<std::string> labels;
  for (const ResultPicture& picture : pictures) {
    if (picture.run.scene != options.scene) continue;
    chosen.push_back(&picture);
    labels.push_back(picture.run.label);
  }
  if (chosen.empty()) {
    throw InputError(fmt::format("{}: no pictures of scene \"{}\"; there are pictures of: {}",
                                 folder.string(), options.scene,
                                 fmt::join(scenes_of(pictures), ", ")));
  }
  Subject subject;
  const auto add = [&](const ResultPicture& picture) {
    const ExrFile file = read_exr(picture.file);
    if (subject.methods.empty()) subject.reference = reference_picture(file);
    const EfficiencyRow& row = report.tables.efficiency[picture.row];
    subject.methods.push_back(
        {row.label, numbers_of(row, report.tables.options.baseline), file.image()});
  };
  if (options.labels.empty()) {
    for (const ResultPicture* picture : chosen) add(*picture);
    return subject;
  }
  for (const std::string& label : options.labels) {
    const auto found = std::find(labels.begin(), labels.end(), label);
    if (found == labels.end()) {
      throw InputError(fmt::format("{}: no picture of method \"{}\" on {}; there are: {}",
                                   folder.string(), label, options.scene, fmt::join(labels, ", ")));
    }
    add(*chosen[static_cast<std::size_t>(found - labels.begin())]);
  }
  return subject;
}

/// "X,Y,WIDTH,HEIGHT", or nothing where the text is something else.
std::optional<PixelRect> parse_rectangle(const std::string& text) {
  std::array<int, 4> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0 && (at == end || *at++ != ',')) return std::nullopt;
    const auto [next, fault] = std::from_chars(at, end, numbers[i]);
    if (fault != std::errc()) return std::nullopt;
    at = next;
  }
  if (at != end) return std::nullopt;
  return PixelRect{numbers[0], numbers[1], numbers[2], numbers[3]};
}

std::vector<PixelRect> rectangles_of(const Report& report, const FigureOptions& options,
                                     const Image& reference) {
  std::vector<std::string> names;
  std::vector<PixelRect> known;
  for (const CropConfig& crop : report.config.images.crops) {
    if (crop.scene != options.scene) continue;
    names.push_back(crop.name);
    const auto& r = crop.rectangle;
    known.push_back({r[0], r[1], r[2], r[3]});
  }
  if (options.crops.empty()) {
    if (known.empty()) known.push_back({0, 0, reference.width, reference.height});
    return known;
  }
  std::vector<PixelRect> result;
  for (const std::string& text : options.crops) {
    const auto named = std::find(names.begin(), names.end(), text);
    const std::optional<PixelRect> rectangle =
        named != names.end() ? known[static_cast<std::size_t>(named - names.begin())]
                             : parse_rectangle(text).value_or(PixelRect{});
    const bool inside = rectangle->width > 0 && rectangle->height > 0 && rectangle->x >= 0 &&
                        rectangle->y >= 0 && rectangle->x + rectangle->width <= reference.width &&
                        rectangle->y + rectangle->height <= reference.height;
    if (!inside) {
      throw InputError(fmt::format(
          "--crop {}: expected X,Y,WIDTH,HEIGHT inside {} x {} pixels, or a crop of the config: {}",
          text, reference.width, reference.height,
          names.empty() ? "(none)" : fmt::format("{}", fmt::join(names, ", "))));
    }
    result.push_back(*rectangle);
  }
  return result;
}

/// The size at which a crop is drawn: whole factors up, a box filter down.
std::pair<int, int> panel_size(const PixelRect& crop) {
  if (crop.width <= kPanel) {
    const int factor = std::max(1, kPanel / crop.width);
    return {crop.width * factor, crop.height * factor};
  }
  return {kPanel,
          std::max(1, static_cast<int>(std::lround(1.0 * crop.height * kPanel / crop.width)))};
}

template <class Picture>
Picture resized(const Picture& picture, int width, int height) {
  return width >= picture.width ? upscale_nearest(picture, width / picture.width)
                                : downscale_box(picture, width, height);
}

/// Everything that is drawn at one crop.
struct CropRow {
  PixelRect rectangle;
  int width{0}, height{0};
  std::vector<Image> pictures;      ///< the reference first
  std::vector<ScalarImage> errors;  ///< of the methods
};

std::vector<CropRow> crop_rows(const Subject& subject, const std::vector<PixelRect>& rectangles) {
  std::vector<CropRow> rows;
  for (const PixelRect& rectangle : rectangles) {
    CropRow row;
    row.rectangle = rectangle;
    std::tie(row.width, row.height) = panel_size(rectangle);
    const Image reference = crop(subject.reference, rectangle);
    row.pictures.push_back(resized(reference, row.width, row.height));
    for (const Method& method : subject.methods) {
      const Image picture = crop(method.picture, rectangle);
      row.pictures.push_back(resized(picture, row.width, row.height));
      row.errors.push_back(resized(signed_error(picture, reference), row.width, row.height));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

class Figure {
 public:
  Figure(const Subject& subject, std::vector<CropRow> rows, const FigureOptions& options)
      : subject_(subject), rows_(std::move(rows)), options_(options) {
    std::vector<ScalarImage> errors;
    for (const CropRow& row : rows_) {
      for (const ScalarImage& error : row.errors) errors.push_back(error);
      column_width_ = std::max(column_width_, row.width);
      grid_height_ += 2 * (row.height + kPad);
    }
    grid_height_ -= kPad;
    scale_ = symmetric_scale(errors, "error [W/(m² sr)]");
    for (const ScalarImage& error : errors) add_exceeded(error, scale_, exceeded_);
    const Image& whole = subject_.reference;
    whole_height_ = std::min(grid_height_, static_cast<int>(480.0 * whole.height / whole.width));
    whole_width_ = std::max(
        1, static_cast<int>(std::lround(1.0 * whole_height_ * whole.width / whole.height)));
  }

  std::string bytes(PictureFormat format) {
    Canvas ruler(1, 1);
    const int bar = color_bar_width(ruler, scale_, kFont, bar_height());
    const int columns = static_cast<int>(subject_.methods.size()) + 1;
    const int grid_x = kPad + whole_width_ + 2 * kPad;
    const int width = grid_x + columns * (column_width_ + kPad) + bar + 2 * kPad;
    Canvas canvas(width, kPad + kLine + grid_height_ + 2 * kLine + 2 * kPad, format);
    canvas.text(options_.scene, kPad, kPad + 0.5 * kLine, 1.2 * kFont, width - 2 * kPad,
                Anchor::Left);
    draw_whole(canvas);
    int y = kPad + kLine + kPad / 2;
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      for (std::size_t c = 0; c < rows_[r].pictures.size(); ++c) {
        draw_panel(canvas, r, c, column_x(grid_x, static_cast<int>(c)), y);
      }
      y += 2 * (rows_[r].height + kPad);
    }
    for (int c = 0; c < columns; ++c) draw_names(canvas, c, column_x(grid_x, c), y);
    draw_color_bar(canvas,
                   {grid_x + columns * (column_width_ + kPad) + kPad / 2,
                    kPad + kLine + kPad / 2 + grid_height_ / 8, bar, bar_height()},
                   scale_, kFont, exceeded_);
    return canvas.bytes();
  }

 private:
  int bar_height() const { return grid_height_ * 3 / 4; }
  int column_x(int grid_x, int column) const { return grid_x + column * (column_width_ + kPad); }

  /// The reference with the crops marked.
  void draw_whole(Canvas& canvas) const {
    const Image& whole = subject_.reference;
    const PixelRect place{kPad, kPad + kLine + kPad / 2, whole_width_, whole_height_};
    const Image shown =
        whole_width_ < whole.width
            ? downscale_box(whole, whole_width_, whole_height_)
            : crop(upscale_nearest(whole, (whole_width_ + whole.width - 1) / whole.width),
                   {0, 0, whole_width_, whole_height_});
    canvas.paint(place, colors_of(shown, options_.exposure));
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      const PixelRect& c = rows_[r].rectangle;
      if (c.width == whole.width && c.height == whole.height) continue;
      const double scale = static_cast<double>(whole_width_) / whole.width;
      const auto at = [&](int value) { return static_cast<int>(std::lround(value * scale)); };
      const PixelRect mark{place.x + at(c.x), place.y + at(c.y), at(c.width), at(c.height)};
      for (int grow = 0; grow < 2; ++grow) {
        canvas.outline(
            {mark.x - grow, mark.y - grow, mark.width + 2 * grow, mark.height + 2 * grow},
            kMarks[r % kMarks.size()]);
      }
    }
    canvas.text("reference", place.x + 0.5 * place.width, place.y + place.height + 0.7 * kLine,
                kFont, place.width, Anchor::Center);
  }

  void draw_panel(Canvas& canvas, std::size_t r, std::size_t c, int x, int y) const {
    const CropRow& row = rows_[r];
    const PixelRect place{x, y, row.width, row.height};
    canvas.paint(place, colors_of(row.pictures[c], options_.exposure));
    canvas.outline(place, kMarks[r % kMarks.size()]);
    if (c == 0) return;
    const PixelRect below{x, y + row.height + kPad / 2, row.width, row.height};
    canvas.paint(below, colors_of(row.errors[c - 1], scale_));
    canvas.outline(below, {160, 160, 160});
  }

  void draw_names(Canvas& canvas, int column, int x, int y) const {
    const double middle = x + 0.5 * column_width_;
    const Method* method =
        column > 0 ? &subject_.methods[static_cast<std::size_t>(column) - 1] : nullptr;
    canvas.text(method ? method->label : "reference", middle, y + 0.5 * kLine, kFont, column_width_,
                Anchor::Center);
    if (method) {
      canvas.text(method->numbers, middle, y + 1.5 * kLine, 0.9 * kFont, column_width_,
                  Anchor::Center);
    }
  }

  const Subject& subject_;
  std::vector<CropRow> rows_;
  const FigureOptions& options_;
  ColorScale scale_;
  Exceeded exceeded_;
  int column_width_{1}, grid_height_{0};
  int whole_width_{1}, whole_height_{1};
};

}  // namespace

void write_figure(const std::filesystem::path& folder, const Report& report,
                  const FigureOptions& options) {
  const std::optional<PictureFormat> format = picture_format(options.out);
  if (!format) {
    throw InputError(options.out.string() + ": expected a file that ends in .png, .svg or .pdf");
  }
  const Subject subject = read_subject(folder, report, options);
  std::vector<CropRow> rows = crop_rows(subject, rectangles_of(report, options, subject.reference));
  Figure figure(subject, std::move(rows), options);
  write_file_atomically(options.out, figure.bytes(*format));
}

}  // namespace penumbra
