// A replayed pixel for people.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "harness/replay.h"
#include "harness/text_grid.h"

namespace penumbra {
namespace {

constexpr std::size_t kWidth = 120;
constexpr std::size_t kNumberWidth = 11;  // of "{:.5g}": "-1.2346e-05"

std::string number(double value) { return fmt::format("{:.5g}", value); }
std::string number(float value) { return fmt::format("{:.5g}", value); }

template <typename Triple>
std::string triple(const Triple& v) {
  return fmt::format("({:.9g}, {:.9g}, {:.9g})", v[0], v[1], v[2]);
}

std::string direction(const Vec3& v) {
  return fmt::format("({:.6f}, {:.6f}, {:.6f})", v.x, v.y, v.z);
}

// Rows whose columns are an estimate's components, as several tables where they do not fit beside
// each other.
class ComponentTable {
 public:
  // `key_width`: of the first column, which every part repeats.
  ComponentTable(const EstimateRecord& record, std::string key, std::size_t key_width)
      : components_(record.components), key_(std::move(key)), key_width_(key_width) {}

  void add(std::string key, std::vector<std::string> fields) {
    keys_.push_back(std::move(key));
    fields_.push_back(std::move(fields));
  }

  std::string text() const {
    std::string result;
    for (std::size_t first = 0; first < components_.size();) {
      const std::size_t last = end_of_part(first);
      result += line(key_, components_, first, last);
      for (std::size_t i = 0; i < keys_.size(); ++i) {
        result += line(keys_[i], fields_[i], first, last);
      }
      first = last;
    }
    return result;
  }

 private:
  std::size_t width(std::size_t component) const {
    return std::max(kNumberWidth, components_[component].size());
  }

  std::size_t end_of_part(std::size_t first) const {
    std::size_t used = 4 + key_width_;
    std::size_t last = first;
    do {
      used += 1 + width(last++);
    } while (last < components_.size() && used + 1 + width(last) <= kWidth);
    return last;
  }

  std::string line(const std::string& key, const std::vector<std::string>& fields,
                   std::size_t first, std::size_t last) const {
    std::string result = fmt::format("    {:<{}}", key, key_width_);
    for (std::size_t c = first; c < last; ++c) {
      result += fmt::format(" {:>{}}", fields[c], width(c));
    }
    return result + "\n";
  }

  const std::vector<std::string>& components_;
  std::string key_;
  std::size_t key_width_;
  std::vector<std::string> keys_;
  std::vector<std::vector<std::string>> fields_;
};

std::string iteration_text(const EstimateRecord& record, std::size_t index) {
  const IterationRecord& iteration = record.iterations[index];
  std::string text =
      fmt::format("  iteration {}: {} rays, {} hits", index, iteration.rays, iteration.hits);
  if (iteration.cone_angle > 0.0) {
    text += fmt::format(", cone axis {}, half angle {:.6g} rad", direction(iteration.cone_axis),
                        iteration.cone_angle);
  }
  ComponentTable table(record, "component", 10);
  std::vector<std::string> counts;
  for (const int count : iteration.counts) counts.push_back(std::to_string(count));
  if (counts.size() == record.components.size()) table.add("samples", counts);
  std::vector<std::string> alphas;
  for (const double alpha : iteration.alpha) alphas.push_back(number(alpha));
  if (alphas.size() == record.components.size()) table.add("alpha", alphas);
  return text + "\n" + table.text();
}

std::string samples_text(const EstimateRecord& record) {
  std::size_t name_width = 9;
  for (const std::string& name : record.components) name_width = std::max(name_width, name.size());
  std::string text = fmt::format(
      "  samples: weight in sr, densities in 1/sr\n"
      "    {:>4} {:>2} {:<{}} {:>8} {:>8} {:>8} {:>10} {:>10} {:>10} {:>10} {:>11} {}\n",
      "#", "it", "component", name_width, "wi.x", "wi.y", "wi.z", "own pdf_w", "f.r", "f.g", "f.b",
      "weight", "fate");
  for (std::size_t i = 0; i < record.samples.size(); ++i) {
    const SampleRecord& s = record.samples[i];
    text += fmt::format(
        "    {:>4} {:>2} {:<{}} {:>8.5f} {:>8.5f} {:>8.5f} {:>10} {:>10} {:>10} {:>10} {:>11} {}\n",
        i, s.iteration, record.components[static_cast<std::size_t>(s.component)], name_width,
        s.wi.x, s.wi.y, s.wi.z, number(s.own_pdf), number(s.f.x), number(s.f.y), number(s.f.z),
        number(s.weight), to_string(s.fate));
  }
  return text;
}

std::string densities_text(const EstimateRecord& record) {
  ComponentTable table(record, "#", 4);
  bool any = false;
  for (std::size_t i = 0; i < record.samples.size(); ++i) {
    const std::vector<float>& pdfs = record.samples[i].pdfs;
    std::vector<std::string> fields(record.components.size(), "-");
    for (std::size_t c = 0; c < pdfs.size(); ++c) fields[c] = number(pdfs[c]);
    any = any || !pdfs.empty();
    table.add(fmt::format("{:>4}", i), std::move(fields));
  }
  if (record.samples.empty()) return {};
  if (!any) return "  the estimator evaluates each sample's own density only\n";
  return "  pdf_w of every component in each sample's direction; - where it was not evaluated\n" +
         table.text();
}

std::string estimate_text(const ReplayedEstimate& estimate) {
  std::string text = fmt::format("\nestimate {} at camera sample {}\n", estimate.record.estimate,
                                 estimate.camera_sample);
  if (!estimate.point.valid()) {
    return text +
           fmt::format("  nothing or a black surface was met: value {}\n", triple(estimate.value));
  }
  text += fmt::format(
      "  position {} in world units, material \"{}\" ({})\n"
      "  shading normal {}, geometric normal {}\n",
      triple(estimate.position_world), estimate.material, estimate.point.material,
      direction(estimate.point.shading_normal), direction(estimate.point.geometric_normal));
  if (!estimate.recorded) {
    return text +
           fmt::format("  the estimator left no record\n  value {}\n", triple(estimate.value));
  }
  const EstimateRecord& record = estimate.record;
  for (std::size_t i = 0; i < record.iterations.size(); ++i) text += iteration_text(record, i);
  text += samples_text(record) + densities_text(record);
  for (const std::string& line : record.notes) text += "  note: " + line + "\n";
  text += fmt::format("  sum of weight x f  {}\n  delta lights       {}\n",
                      triple(estimate.weighted_sum), triple(record.delta));
  if (!is_black(record.control)) {
    text += fmt::format("  control variates   {}\n", triple(record.control));
  }
  text += fmt::format("  value              {}, relative difference {:.2g}\n",
                      triple(estimate.value), estimate.relative_difference());
  return text;
}

std::string cell_text(const StoredRow& stored) {
  const RunRow& row = stored.row();
  const Cell& cell = stored.cell();
  std::string params;
  for (const auto& [name, value] : cell.params.values()) {
    params += (params.empty() ? "" : ", ") + name + "=" + to_string(value);
  }
  std::string text = fmt::format("row {}: {}, {}, {}, block {}, seed {}\n", row.run_id, row.scene,
                                 row.label, row.sampler, row.block, row.seed);
  text += wrapped(fmt::format("estimator {}: {}", row.estimator, params), kWidth);
  text += fmt::format(
      "SRL {} ({} initial, {} adaptive), SPP {}, {} camera samples, {} x {} pixels, measured on {} "
      "threads\n",
      row.srl, row.srl_initial, row.srl_adaptive, row.spp, row.camera_samples, row.width,
      row.height, row.threads);
  if (row.status == RunStatus::Failed) text += wrapped("the row failed: " + row.failure, kWidth);
  return text;
}

std::string pixel_text(const StoredRow& stored, const PixelReplay& replay) {
  const Quantity quantity = stored.scene().points.quantity;
  std::string text = fmt::format("\npixel {},{} in tile {},{} of {} x {}: {} {} {}\n", replay.x,
                                 replay.y, replay.tile.x0, replay.tile.y0, replay.tile.width,
                                 replay.tile.height, to_string(quantity), triple(replay.value),
                                 quantity == Quantity::Radiance ? "W/(m^2 sr)" : "W/m^2");
  if (!replay.stored) return text + "not compared: " + replay.why_not_stored + "\n";
  const std::string file = "images/" + replay.stored->file.filename().string();
  if (!replay.differs()) return text + "same bits as " + file + "\n";
  return text + fmt::format("DIFFERS from {}, which has {}\n", file, triple(replay.stored->value));
}

}  // namespace

std::string replay_text(const StoredRow& stored, const PixelReplay& replay,
                        std::optional<int> only) {
  std::string text = cell_text(stored) + pixel_text(stored, replay);
  for (const ReplayedEstimate& estimate : replay.estimates) {
    if (!only || *only == estimate.record.estimate) text += estimate_text(estimate);
  }
  return text;
}

}  // namespace penumbra
