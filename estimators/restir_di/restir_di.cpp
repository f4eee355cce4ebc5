// ReSTIR for direct light, a single frame: resampled light points, shared between pixels.
//
// Idea: draw many light points without tracing anything, keep one of them in proportion to what it
// would reflect if nothing hid it, let neighbouring pixels offer theirs, keep one of these, and
// trace a single shadow ray. Sources: Bitterli et al. 2020, "Spatiotemporal reservoir resampling
// for real-time ray tracing with dynamic direct lighting"; Lin et al. 2022, "Generalized resampled
// importance sampling", for the weights.
//
// Equations, at pixel i with target t_i(y) = luminance of f_i(y) without visibility, y a light
// point (per area; directions of the environment per solid angle), p the density of LightPoints:
//   own choice   y_i among M candidates in proportion to t_i/p; W_i = 1/M sum_j (t_i/p)(y_j) /
//   t_i(y_i) offers       w_s = m_s(y_s) t_i(y_s) W_s for s in S = {i and its neighbours},
//                m_s(y) = t_s(y) / sum_{q in S} t_q(y)          (generalised balance heuristic)
//   estimate     F = f_i(y) V_i(y) sum_s w_s / t_i(y), y among the y_s in proportion to w_s
// Every estimate repeats this SRL x lights times (lights that can contribute), with new candidates
// and new neighbours, and takes the mean. A light point is the same point from everywhere, so
// moving it between pixels needs no Jacobian.
//
// Candidates are points on lights alone: directions drawn from the BSDF, and the solid angle of
// lights, are left out. Visibility is not part of the targets (no reuse of visibility), so a pixel
// in shadow offers what it would have seen. Neighbours are pixels of the same block of kBlockSide
// pixels, uniform within `radius`, duplicates left out; they take part with the same estimate and
// the same repetition.
//
// Parameters: candidates = 8, neighbours = 3, radius = 4 [pixels], reuse_weights = unbiased.
// Unbiased: given the pixels, m sums to 1 over the members that can offer y, and pixel i itself
// always can. With reuse_weights = one_over_m each member counts 1/|S|, also for points that it can
// not offer, below its horizon or where its BSDF is black: the image darkens there; the control
// that tests must reject. Weak case: few lights, where a ray costs less than the candidates; sharp
// lobes; lights that touch surfaces. Errors of neighbouring pixels are correlated: statistics have
// to come from runs with seeds of their own, not from the pixels of one image.

#include "estimators/restir_di/restir_di.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "estimators/mixture/estimates.h"
#include "estimators/mixture/exact_light.h"
#include "estimators/restir_di/reservoirs.h"

namespace penumbra::restir_di {
namespace {

constexpr int kBlockSide = 16;  // [pixels]
constexpr std::size_t kBlockPixels = std::size_t{kBlockSide} * kBlockSide;
ResamplingSettings settings_of(const ParamSet& params) {
  return {static_cast<std::uint32_t>(params.integer("candidates")),
          static_cast<std::uint32_t>(params.integer("neighbours")),
          params.text("reuse_weights") == "one_over_m"};
}

class RestirDi final : public Estimator {
 public:
  RestirDi(const Scene& scene, const ParamSet& params, const Budget& budget)
      : scene_(&scene),
        budget_(budget),
        settings_(settings_of(params)),
        radius_(static_cast<int>(params.integer("radius"))),
        reservoirs_(scene, budget.sampler, settings_),
        exact_(scene),
        pixels_(kBlockPixels, Pixel(scene)),
        rays_(kBlockPixels),
        shaded_(kBlockPixels) {
    most_samples(scene, budget);  // refuses what random numbers can not be keyed for
  }

  void estimate(const Tile& tile, std::uint64_t seed, TileOutput& out) noexcept override {
    counters_ = {};
    clock_ = out.clock;
    for (int y = 0; y < tile.height; y += kBlockSide) {
      for (int x = 0; x < tile.width; x += kBlockSide) {
        block_ = {x, y, std::min(kBlockSide, tile.width - x),
                  std::min(kBlockSide, tile.height - y)};
        for (int s = 0; s < tile.spp; ++s) one_estimate_each(tile, seed, s, out);
      }
    }
    counters_.iterations = counters_.estimates;
    enter_stage(clock_, EstimateStage::Outside);
    out.counters += counters_;
  }

 private:
  struct Block {
    int x0{0}, y0{0}, width{0}, height{0};
  };

  // A ray of a pixel.
  struct Shaded {
    Pixel* pixel;
    Choice choice;
  };

  void one_estimate_each(const Tile& tile, std::uint64_t seed, int s, TileOutput& out) noexcept {
    std::uint32_t most = 0;
    for (int i = 0; i < block_.width * block_.height; ++i) {
      set_up(tile, seed, i, s, out);
      most = std::max(most, pixels_[static_cast<std::size_t>(i)].repetitions);
    }
    for (std::uint32_t r = 0; r < most; ++r) one_repetition(r);
    for (int i = 0; i < block_.width * block_.height; ++i) {
      const Pixel& pixel = pixels_[static_cast<std::size_t>(i)];
      if (pixel.repetitions == 0) continue;
      out.radiance[output_index(tile, i, s)] += narrow(pixel.sum / pixel.repetitions);
    }
  }

  int pixel_in_tile(const Tile& tile, int i) const noexcept {
    return (block_.y0 + i / block_.width) * tile.width + block_.x0 + i % block_.width;
  }
  std::size_t output_index(const Tile& tile, int i, int s) const noexcept {
    return static_cast<std::size_t>(pixel_in_tile(tile, i)) * static_cast<std::size_t>(tile.spp) +
           static_cast<std::size_t>(s);
  }

  // Binds pixel i of the block to its point, and stores the light that needs no sampling.
  void set_up(const Tile& tile, std::uint64_t seed, int i, int s, TileOutput& out) noexcept {
    Pixel& pixel = pixels_[static_cast<std::size_t>(i)];
    const int in_tile = pixel_in_tile(tile, i);
    const ShadingPoint& point = tile.point(in_tile, s);
    Rgb& radiance = out.radiance[output_index(tile, i, s)];
    radiance = Rgb(0.0f);
    pixel.repetitions = 0;
    if (!point.valid()) return;
    enter_stage(clock_, EstimateStage::SetUp);
    ++counters_.estimates;
    pixel.receiver.set_up(*scene_, point, tile.surface(in_tile, s));
    pixel.record = out.recorder != nullptr ? out.recorder->begin(in_tile, s) : nullptr;
    if (pixel.record != nullptr) begin_record(*pixel.record);
    if (exact_.possible()) {
      radiance = exact_.radiance(point, pixel.receiver.frame(), pixel.receiver.bsdf(), counters_,
                                 pixel.record);
    }
    pixel.repetitions = static_cast<std::uint32_t>(budget_.srl()) * active_lights(point);
    pixel.key = {};
    pixel.key.seed = seed;
    pixel.key.pixel = tile.pixel_index(in_tile);
    pixel.key.estimate = static_cast<std::uint32_t>(s);
    pixel.sum = RgbSum(0.0);
  }

  // Lights that can contribute at a point, as a mixture counts them.
  std::uint32_t active_lights(const ShadingPoint& point) const noexcept {
    if (scene_->is_mirror(point.material)) return 0;
    std::uint32_t count = 0;
    LightProposal proposal;
    for (const std::uint32_t id : scene_->sampled_lights()) {
      count += proposal.set_up(scene_->lights()[id], LightSampling::Area, point.position,
                               point.geometric_normal, scene_->keep_all())
                   ? 1u
                   : 0u;
    }
    return count;
  }

  void one_repetition(std::uint32_t r) noexcept {
    const int count = block_.width * block_.height;
    enter_stage(clock_, EstimateStage::Sample);
    for (int i = 0; i < count; ++i) {
      Pixel& pixel = pixels_[static_cast<std::size_t>(i)];
      if (r >= pixel.repetitions) continue;
      reservoirs_.fill(pixel, r);
      counters_.candidates += settings_.candidates;
    }
    enter_stage(clock_, EstimateStage::Adapt);
    rays_.clear();
    for (int i = 0; i < count; ++i) {
      if (r < pixels_[static_cast<std::size_t>(i)].repetitions) merge(i, r);
    }
    trace();
  }

  // The pixels that offer their reservoirs to pixel i, itself first: by the pixels' places and
  // keyed random numbers alone.
  std::span<Pixel* const> members(int i, std::uint32_t r) noexcept {
    Pixel& pixel = pixels_[static_cast<std::size_t>(i)];
    member_[0] = &pixel;
    std::size_t count = 1;
    const int x = i % block_.width;
    const int y = i / block_.width;
    const int x0 = std::max(0, x - radius_), x1 = std::min(block_.width - 1, x + radius_);
    const int y0 = std::max(0, y - radius_), y1 = std::min(block_.height - 1, y + radius_);
    const PointSet places = reservoirs_.decisions(pixel, r);
    for (std::uint32_t k = 1; k <= settings_.neighbours; ++k) {
      const Vec2 u = places(k).u;
      const int nx = x0 + static_cast<int>(static_cast<double>(u.x) * (x1 - x0 + 1));
      const int ny = y0 + static_cast<int>(static_cast<double>(u.y) * (y1 - y0 + 1));
      Pixel* const other = &pixels_[static_cast<std::size_t>(ny * block_.width + nx)];
      const auto end = member_.begin() + static_cast<std::ptrdiff_t>(count);
      if (r < other->repetitions && std::find(member_.begin(), end, other) == end) {
        member_[count++] = other;
      }
    }
    return std::span(member_).first(count);
  }

  // Makes the ray of pixel i.
  void merge(int i, std::uint32_t r) noexcept {
    ++counters_.samples;
    Pixel& pixel = pixels_[static_cast<std::size_t>(i)];
    const std::optional<Choice> choice = reservoirs_.choose(members(i, r), r);
    if (!choice) return;
    shaded_[rays_.size()] = {&pixel, *choice};
    rays_.add(pixel.receiver.point().position, choice->connection.wi);
  }

  void trace() noexcept {
    enter_stage(clock_, EstimateStage::Trace);
    scene_->intersect(rays_);
    enter_stage(clock_, EstimateStage::Weigh);
    counters_.rays += rays_.size();
    counters_.untraced += rays_.untraced();
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      const Choice& choice = shaded_[i].choice;
      Pixel& pixel = *shaded_[i].pixel;
      const bool lit = pixel.receiver.sees(*scene_, choice.at, choice.connection, rays_.hits[i]);
      const double weight = choice.weight * choice.connection.geometry;
      if (lit) {
        ++counters_.lit;
        pixel.sum += widen(choice.connection.f) * weight;
      }
      if (pixel.record != nullptr) record_sample(pixel, choice, weight, lit);
    }
  }

  void begin_record(EstimateRecord& record) const {
    for (const std::uint32_t id : scene_->sampled_lights()) {
      record.components.push_back(scene_->lights()[id].name);
    }
    record.iterations.emplace_back().counts.assign(record.components.size(), 0);
  }

  void record_sample(const Pixel& pixel, const Choice& choice, double weight, bool lit) const {
    const std::span<const std::uint32_t> ids = scene_->sampled_lights();
    const auto component =
        static_cast<std::size_t>(std::find(ids.begin(), ids.end(), choice.at.light) - ids.begin());
    IterationRecord& iteration = pixel.record->iterations.back();
    ++iteration.counts[component];
    ++iteration.rays;
    iteration.hits += lit ? 1 : 0;
    SampleRecord& sample = pixel.record->samples.emplace_back();
    sample.component = static_cast<int>(component);
    sample.wi = choice.connection.wi;
    sample.own_pdf = static_cast<float>(choice.at.pdf / choice.connection.geometry);
    sample.f = lit ? choice.connection.f : Rgb(0.0f);
    sample.weight = weight / pixel.repetitions;
    sample.fate = lit ? SampleFate::Lit : SampleFate::Dark;
  }

  const Scene* scene_;
  Budget budget_;
  ResamplingSettings settings_;
  int radius_;
  Reservoirs reservoirs_;
  ExactLight exact_;
  EstimateCounters counters_;
  StageClock* clock_{nullptr};

  Block block_;
  std::vector<Pixel> pixels_;  // of the block, row-major
  RayBatch rays_;
  std::vector<Shaded> shaded_;  // [ray]

  std::array<Pixel*, kMostNeighbours + 1> member_{};
};

std::span<const ParamSpec> params() {
  static const std::vector<ParamSpec> specs = {
      {.name = "candidates",
       .default_value = std::int64_t{8},
       .doc = "light points that each reservoir is filled from, without rays",
       .choices = {},
       .min = 1,
       .max = kMostCandidates},
      {.name = "neighbours",
       .default_value = std::int64_t{3},
       .doc = "pixels whose reservoirs are offered to a pixel; 0: no reuse",
       .choices = {},
       .min = 0,
       .max = kMostNeighbours},
      {.name = "radius",
       .default_value = std::int64_t{4},
       .doc = "farthest neighbours, along rows and columns [pixels]; none beyond a block of 16",
       .choices = {},
       .min = 1,
       .max = kBlockSide - 1},
      {.name = "reuse_weights",
       .default_value = std::string("unbiased"),
       .doc = "weights of the neighbours' light points: by their targets, or the same for all, "
              "which loses light",
       .choices = {"unbiased", "one_over_m"}},
  };
  return specs;
}

std::string bias_reason(const ParamSet& params) {
  return params.text("reuse_weights") == "unbiased" || params.integer("neighbours") == 0
             ? ""
             : "neighbours count for light points that they can not offer";
}

std::unique_ptr<Estimator> create(const Scene& scene, const ParamSet& params,
                                  const Budget& budget) {
  return std::make_unique<RestirDi>(scene, params, budget);
}

}  // namespace

constinit const EstimatorEntry kEntry = {
    .name = "restir_di",
    .summary = "resampled light points shared between neighbouring pixels",
    .citation =
        "Bitterli, Wyman, Pharr, Shirley, Lefohn and Jarosz 2020, Spatiotemporal reservoir "
        "resampling for real-time ray tracing with dynamic direct lighting",
    .shares_in_tile = true,
    .correlates_pixels = true,
    .params = params,
    .bias_reason = bias_reason,
    .create = create,
};

}  // namespace penumbra::restir_di
