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
#include <cmath>
#include <memory>

#include "estimators/mixture/estimates.h"
#include "estimators/mixture/exact_light.h"
#include "estimators/restir_di/light_points.h"
#include "scenes/core/error.h"

namespace penumbra::restir_di {
namespace {

constexpr int kBlockSide = 16;  // [pixels]
constexpr std::size_t kBlockPixels = std::size_t{kBlockSide} * kBlockSide;
constexpr int kMostCandidates = 64;
constexpr int kMostNeighbours = 8;

// Iterations that a repetition's random numbers are keyed by, before the component goes up by one.
constexpr std::uint32_t kIterations = 4000;

struct Reservoir {
  LightPoint at;
  double target{0.0};  // t_i(y_i)
  double weight{0.0};  // W_i; 0: empty
};

// Index of the first entry whose cumulative weight is above u x the last.
std::size_t choose(std::span<const double> cumulative, float u) noexcept {
  const double aim = static_cast<double>(u) * cumulative.back();
  std::size_t i = 0;
  while (i + 1 < cumulative.size() && !(cumulative[i] > aim)) ++i;
  return i;
}

class RestirDi final : public Estimator {
 public:
  RestirDi(const Scene& scene, const ParamSet& params, const Budget& budget)
      : scene_(&scene),
        budget_(budget),
        candidates_(static_cast<std::uint32_t>(params.integer("candidates"))),
        neighbours_(static_cast<std::uint32_t>(params.integer("neighbours"))),
        radius_(static_cast<int>(params.integer("radius"))),
        one_over_m_(params.text("reuse_weights") == "one_over_m"),
        lights_(scene),
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

  // A pixel of the block with the estimate at hand.
  struct Pixel {
    explicit Pixel(const Scene& scene) : receiver(scene) {}

    Receiver receiver;
    std::uint32_t repetitions{0};  // 0: nothing to draw
    StreamKey key;
    Reservoir own;
    RgbSum sum{0.0};
    EstimateRecord* record{nullptr};
  };

  // A ray of a pixel.
  struct Shaded {
    Pixel* pixel;
    LightPoint at;
    Connection connection;
    double weight;  // [per measure of the light point]
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
      if (r < pixel.repetitions) choose_candidate(pixel, r);
    }
    enter_stage(clock_, EstimateStage::Adapt);
    rays_.clear();
    for (int i = 0; i < count; ++i) {
      if (r < pixels_[static_cast<std::size_t>(i)].repetitions) merge(i, r);
    }
    trace();
  }

  // Streams: behind the lights' and the mixture's, places on lights, choices of lights, and what a
  // repetition decides.
  StreamKey stream(const Pixel& pixel, std::uint32_t purpose,
                   std::uint32_t iteration) const noexcept {
    StreamKey key = pixel.key;
    key.component = static_cast<std::uint32_t>(scene_->lights().size()) + purpose;
    key.iteration = iteration;
    return key;
  }
  PointSet decisions(const Pixel& pixel, std::uint32_t r) const noexcept {
    return PointSet(SamplerKind::Independent,
                    stream(pixel, 2 + r / kIterations, 1 + r % kIterations), 1 + neighbours_);
  }

  // The pixel's own reservoir of a repetition. All candidates of an estimate are one point set.
  void choose_candidate(Pixel& pixel, std::uint32_t r) noexcept {
    const std::uint32_t total = pixel.repetitions * candidates_;
    const PointSet places(budget_.sampler, stream(pixel, 0, 0), total);
    const PointSet choices(budget_.sampler, stream(pixel, 1, 0), total);
    VariateBlock place, choice;
    places.fill(r * candidates_, candidates_, true, place);
    choices.fill(r * candidates_, candidates_, false, choice);
    counters_.candidates += candidates_;
    pixel.own.weight = 0.0;
    double sum = 0.0;
    for (std::uint32_t j = 0; j < candidates_; ++j) {
      Reservoir& candidate = candidate_[j];
      candidate.at = lights_.sample(choice.x[j], place[j]);
      candidate.target = 0.0;
      if (candidate.at.pdf > 0.0) {
        candidate.target = connect(pixel, candidate.at).target;
        sum += candidate.target / candidate.at.pdf;
      }
      cumulative_[j] = sum;
    }
    if (!(sum > 0.0)) return;
    const std::size_t chosen =
        choose(std::span(cumulative_).first(candidates_), decisions(pixel, r)(0).choice);
    pixel.own = candidate_[chosen];
    pixel.own.weight = sum / (candidates_ * pixel.own.target);
  }

  Connection connect(const Pixel& pixel, const LightPoint& at) const noexcept {
    return pixel.receiver.connect(scene_->lights()[at.light], at);
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
    const PointSet places = decisions(pixel, r);
    for (std::uint32_t k = 1; k <= neighbours_; ++k) {
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

  // Chooses among the reservoirs of the neighbourhood and makes the ray.
  void merge(int i, std::uint32_t r) noexcept {
    ++counters_.samples;
    const std::span<Pixel* const> all = members(i, r);
    Pixel& pixel = *all[0];
    double sum = 0.0;
    for (std::size_t s = 0; s < all.size(); ++s) {
      const Reservoir& offer = all[s]->own;
      Connection& here = connection_[s];
      double weight = 0.0;
      if (offer.weight > 0.0) {
        here = connect(pixel, offer.at);
        if (here.target > 0.0) {
          weight = share(all, s, here.target) * here.target * offer.weight;
        }
      }
      sum += weight;
      cumulative_[s] = sum;
    }
    if (!(sum > 0.0)) return;
    const std::size_t chosen =
        choose(std::span(cumulative_).first(all.size()), decisions(pixel, r)(0).u.x);
    const Connection& connection = connection_[chosen];
    shaded_[rays_.size()] = {&pixel, all[chosen]->own.at, connection, sum / connection.target};
    rays_.add(pixel.receiver.point().position, connection.wi);
  }

  // m_s at the light point of member s.
  double share(std::span<Pixel* const> all, std::size_t s, double target_here) const noexcept {
    if (one_over_m_) return 1.0 / static_cast<double>(all.size());
    const Reservoir& offer = all[s]->own;
    double total = 0.0;
    for (std::size_t q = 0; q < all.size(); ++q) {
      total += q == s ? offer.target : q == 0 ? target_here : connect(*all[q], offer.at).target;
    }
    return offer.target / total;
  }

  void trace() noexcept {
    enter_stage(clock_, EstimateStage::Trace);
    scene_->intersect(rays_);
    enter_stage(clock_, EstimateStage::Weigh);
    counters_.rays += rays_.size();
    counters_.untraced += rays_.untraced();
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      const Shaded& shaded = shaded_[i];
      Pixel& pixel = *shaded.pixel;
      const bool lit = pixel.receiver.sees(*scene_, shaded.at, shaded.connection, rays_.hits[i]);
      const double weight = shaded.weight * shaded.connection.geometry;
      if (lit) {
        ++counters_.lit;
        pixel.sum += widen(shaded.connection.f) * weight;
      }
      if (pixel.record != nullptr) record_sample(pixel, shaded, weight, lit);
    }
  }

  void begin_record(EstimateRecord& record) const {
    for (const std::uint32_t id : scene_->sampled_lights()) {
      record.components.push_back(scene_->lights()[id].name);
    }
    record.iterations.emplace_back().counts.assign(record.components.size(), 0);
  }

  void record_sample(const Pixel& pixel, const Shaded& shaded, double weight, bool lit) const {
    const std::span<const std::uint32_t> ids = scene_->sampled_lights();
    const auto component =
        static_cast<std::size_t>(std::find(ids.begin(), ids.end(), shaded.at.light) - ids.begin());
    IterationRecord& iteration = pixel.record->iterations.back();
    ++iteration.counts[component];
    ++iteration.rays;
    iteration.hits += lit ? 1 : 0;
    SampleRecord& sample = pixel.record->samples.emplace_back();
    sample.component = static_cast<int>(component);
    sample.wi = shaded.connection.wi;
    sample.own_pdf = static_cast<float>(shaded.at.pdf / shaded.connection.geometry);
    sample.f = lit ? shaded.connection.f : Rgb(0.0f);
    sample.weight = weight / pixel.repetitions;
    sample.fate = lit ? SampleFate::Lit : SampleFate::Dark;
  }

  const Scene* scene_;
  Budget budget_;
  std::uint32_t candidates_, neighbours_;
  int radius_;
  bool one_over_m_;
  LightPoints lights_;
  ExactLight exact_;
  EstimateCounters counters_;
  StageClock* clock_{nullptr};

  Block block_;
  std::vector<Pixel> pixels_;  // of the block, row-major
  RayBatch rays_;
  std::vector<Shaded> shaded_;  // [ray]

  // Scratch of a pixel.
  std::array<Reservoir, kMostCandidates> candidate_;
  std::array<double, kMostCandidates> cumulative_{};
  std::array<Pixel*, kMostNeighbours + 1> member_{};
  std::array<Connection, kMostNeighbours + 1> connection_;
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
