// How a mixture draws: points for its components, and directions from points.

#include <algorithm>

#include "estimators/mixture/mixture.h"
#include "scenes/core/frame.h"
#include "scenes/core/warp.h"

namespace penumbra {
namespace {

constexpr float kOneMinusEpsilon = 1.0f - 0x1p-24f;

// Lanes [at, at + count) of `world` in the frame, and back.
void to_local(const Frame& frame, const VectorBlock& world, std::size_t at, std::size_t count,
              VectorBlock& __restrict local) noexcept {
  const Frame f = frame;
  for (std::size_t i = at; i < at + whole_groups(count); ++i) {
    const Vec3 w = f.to_local(world[i]);
    local.x[i] = w.x;
    local.y[i] = w.y;
    local.z[i] = w.z;
  }
}

void to_world(const Frame& frame, const VectorBlock& local, std::size_t at, std::size_t count,
              VectorBlock& __restrict world) noexcept {
  const Frame f = frame;
  for (std::size_t i = at; i < at + whole_groups(count); ++i) {
    const Vec3 w = f.to_world(local[i]);
    world.x[i] = w.x;
    world.y[i] = w.y;
    world.z[i] = w.z;
  }
}

}  // namespace

// Streams: a light's scene index; then all lights as one or the BSDF for all lights; the cone; the
// BSDF of each light's pair. Lights that are left out at a point do not shift the numbers of the
// others.
std::uint32_t Mixture::stream(int component) const noexcept {
  const std::uint32_t* active_id = active_ids_.data() + first_light_;
  const int light_end = light_components();
  if (component < light_end && !lights_as_one_) return active_id[component];
  const auto lights = static_cast<std::uint32_t>(scene_->lights().size());
  if (component < light_end) return lights + 2;
  if (component > light_end) return lights + 1;
  return restricted_ ? lights + 3 + *active_id : lights;
}

void Mixture::draw_points(SamplerKind sampler, int component, std::uint32_t count) noexcept {
  const std::uint32_t stream_of_set = stream(component);
  if (drawn_.independent) {
    return add_runs(component, count, [&](std::uint32_t first, std::uint32_t n, std::size_t at) {
      drawn_.points.add(at, n, stream_of_set, first);
    });
  }
  StreamKey key = drawn_.key;
  key.component = stream_of_set;
  const PointSet points(sampler, key, count);
  const bool with_choice = component < light_components()
                               ? lights_as_one_ || proposal(component).uses_choice()
                               : bsdf_.uses_choice();
  add_runs(component, count, [&](std::uint32_t first, std::uint32_t n, std::size_t at) {
    points.fill(first, n, with_choice, drawn_.variates, at);
  });
}

// Appends points of a component to the block at hand, which is kept whenever it is full.
// @param fill  puts points [first, first + n) into the lanes from `at` on
template <typename Fill>
void Mixture::add_runs(int component, std::uint32_t count, Fill fill) noexcept {
  for (std::uint32_t done = 0; done < count;) {
    if (drawn_.count == kBlock) keep_block();
    const std::size_t at = drawn_.count;
    const std::uint32_t n = std::min(count - done, static_cast<std::uint32_t>(kBlock - at));
    fill(done, n, at);
    // The lanes behind the last are those of the next run.
    for (std::size_t i = at; i < at + whole_groups(n); ++i) drawn_.component[i] = component;
    drawn_.lights_only = drawn_.lights_only && component < light_components();
    drawn_.run[drawn_.runs++] = {component, static_cast<std::uint32_t>(at), n, count};
    drawn_.count += n;
    done += n;
  }
}

// Turns the points at hand into directions in world and local coordinates, and their own densities
// except the BSDF's. Run by run, in ascending order: loops over whole groups leave what has no
// meaning in the lanes of the next.
void Mixture::draw_directions() noexcept {
  std::size_t lights = 0;  // lanes of lights, which are the first
  std::size_t r = 0;
  for (; r < drawn_.runs && drawn_.run[r].component < light_components(); ++r) {
    const Run& run = drawn_.run[r];
    if (lights_as_one_) {
      draw_any_light(run);
    } else {
      proposal(run.component)
          .sample(drawn_.variates, run.count, run.first, drawn_.wi, drawn_.own_pdf);
    }
    lights += run.count;
  }
  to_local(frame_, drawn_.wi, 0, lights, drawn_.wi_local);
  for (; r < drawn_.runs; ++r) {
    const Run& run = drawn_.run[r];
    if (run.component == cone_component()) {
      draw_cone(run);
    } else {
      bsdf_.sample(drawn_.variates, run.count, run.first, drawn_.wi_local);
      to_world(frame_, drawn_.wi_local, run.first, run.count, drawn_.wi);
    }
  }
}

void Mixture::draw_any_light(const Run& run) noexcept {
  const auto n = static_cast<double>(active_.size());
  for (std::size_t i = run.first; i < run.first + run.count; ++i) {
    Variates v = drawn_.variates[i];
    const float scaled = v.choice * static_cast<float>(n);
    const auto light = std::min(static_cast<std::size_t>(scaled), active_.size() - 1);
    v.choice = std::min(scaled - static_cast<float>(light), kOneMinusEpsilon);
    const LightSample s = active_[light].sample(v).value_or(LightSample{});
    auto pdf = static_cast<double>(s.pdf_w);
    for_each_met(s.wi, [&](std::size_t other) {
      if (other != light) pdf += static_cast<double>(active_[other].pdf_w(s.wi));
    });
    drawn_.wi.set(i, s.wi);
    drawn_.own_pdf[i] = static_cast<float>(pdf / n);
    drawn_.light[i] = static_cast<int>(light);
  }
}

void Mixture::draw_cone(const Run& run) noexcept {
  const Frame about_axis(cone_.axis);
  const float pdf = uniform_cone_pdf_w(cone_.one_minus_cos);
  for (std::size_t i = run.first; i < run.first + run.count; ++i) {
    const Vec3 local = sample_uniform_cone(drawn_.variates[i].u, cone_.one_minus_cos);
    drawn_.wi.set(i, about_axis.to_world(local).normalized());
    drawn_.own_pdf[i] = pdf;
  }
  to_local(frame_, drawn_.wi, run.first, run.count, drawn_.wi_local);
}

}  // namespace penumbra
