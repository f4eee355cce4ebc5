// Proposals of every type of light, from a point below it: set-up, a block of samples, a block of
// densities, and the test of rays along the outline.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "harness/micro/checks.h"
#include "harness/micro/register.h"
#include "scenes/core/frame.h"
#include "scenes/core/warp.h"

namespace penumbra::micro {
namespace {

// A light with the directions that its kernels are timed on.
struct LightCase {
  std::string name;
  LightSampling sampling{LightSampling::Area};
  const LightField* field{nullptr};

  const Light& light() const { return field->scene->lights()[0]; }
  bool set_up(LightProposal& proposal) const {
    return proposal.set_up(light(), sampling, field->point.position, field->point.geometric_normal);
  }
};

VariateBlock block_of_variates(std::uint64_t seed) {
  StreamKey key;
  key.seed = seed;
  VariateBlock block;
  PointSet(SamplerKind::Independent, key, kBlock).fill(0, kBlock, true, block);
  return block;
}

std::vector<double> lanes(const Block<float>& block) {
  return {block.begin(), block.begin() + kBlock};
}

// Solid angle of the directions of positive density, by a grid of equal parts over the cone that
// holds them.
double solid_angle_by_grid(const LightProposal& proposal) {
  constexpr int kSide = 192;
  const DirectionCone cone = proposal.directions();
  const float one_minus_cos = std::min(cone.one_minus_cos, 2.0f);
  const Frame frame(cone.axis);
  int met = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const Vec2 u((static_cast<float>(x) + 0.5f) / kSide, (static_cast<float>(y) + 0.5f) / kSide);
      const Vec3 wi = frame.to_world(sample_uniform_cone(u, one_minus_cos));
      met += proposal.pdf_w(wi.normalized()) > 0.0f ? 1 : 0;
    }
  }
  return met * 2.0 * std::numbers::pi * static_cast<double>(one_minus_cos) / (kSide * kSide);
}

// The same as the mean of 1/pdf over draws, which holds only where the density is that of the draws
// and integrates to 1. The density itself has peaks along the outline of a mesh that no grid
// resolves.
std::string density_fault(const LightProposal& proposal, std::uint64_t seed) {
  constexpr std::uint32_t kDraws = 8192;
  StreamKey key;
  key.seed = seed;
  const PointSet points(SamplerKind::Independent, key, kDraws);
  double sum = 0.0;
  double squares = 0.0;
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    const auto sample = proposal.sample(points(i));
    if (!sample) continue;
    const double weight = 1.0 / static_cast<double>(proposal.pdf_w(sample->wi));
    sum += weight;
    squares += weight * weight;
  }
  const double found = sum / kDraws;
  const double error = std::sqrt(std::max(squares / kDraws - found * found, 0.0) / kDraws);
  const double expected = solid_angle_by_grid(proposal);
  return values_fault("solid angle by draws", std::span(&found, 1), std::span(&expected, 1), 0.01,
                      5.5 * error);
}

// Of the share of drawn directions whose ray meets the light; rounding may turn some past its edge.
std::string emitter_fault(const LightCase& c, const VectorBlock& wi) {
  RayBatch rays(kBlock);
  for (std::size_t i = 0; i < kBlock; ++i) rays.add(c.field->point.position, wi[i]);
  c.field->scene->intersect(rays);
  int missed = 0;
  for (std::size_t i = 0; i < kBlock; ++i) {
    const bool below = wi[i].z <= 0.0f;
    missed += !below && c.field->scene->emitter(rays.hits[i], wi[i]) != 0 ? 1 : 0;
  }
  return missed <= 1 ? "" : fmt::format("{} of {} drawn directions miss the light", missed, kBlock);
}

std::string light_fault(const LightCase& c, std::uint64_t seed) {
  LightProposal proposal;
  if (!c.set_up(proposal)) return "the light is left out";
  const VariateBlock variates = block_of_variates(seed);
  VectorBlock wi;
  Block<float> drawn{}, evaluated{};
  proposal.sample(variates, kBlock, 0, wi, drawn);
  proposal.pdf_w(wi, kBlock, evaluated);
  std::vector<double> scalar_drawn, scalar_evaluated;
  for (std::size_t i = 0; i < kBlock; ++i) {
    const auto sample = proposal.sample(variates[i]);
    if (!sample) return "a draw gave no direction";
    if ((sample->wi - wi[i]).length() > 1e-5f)
      return "a direction differs from the one drawn alone";
    scalar_drawn.push_back(static_cast<double>(sample->pdf_w));
    scalar_evaluated.push_back(static_cast<double>(proposal.pdf_w(wi[i])));
  }
  for (const std::string& fault :
       {values_fault("densities drawn, block and scalar", lanes(drawn), scalar_drawn, 1e-4),
        values_fault("densities, block and scalar", lanes(evaluated), scalar_evaluated, 1e-4),
        values_fault("densities drawn and evaluated", lanes(drawn), lanes(evaluated), 2e-3),
        emitter_fault(c, wi)}) {
    if (!fault.empty()) return fault;
  }
  return density_fault(proposal, seed);
}

// A ray that passes the outline and meets nothing, one through the middle, and one away from it.
Vec3 outline_direction(const LightCase& c) {
  const Light& light = c.light();
  const Vec3 from = c.field->point.position;
  if (light.type == LightType::Rectangle) return (light.origin - from).normalized();
  const Vec3 axis = light.center - from;
  const float distance = axis.length();
  const float sine = light.radius / distance;
  const Frame frame(axis / distance);
  return frame.to_world(Vec3(sine, 0.0f, std::sqrt(1.0f - sine * sine))).normalized();
}

std::string grazes_fault(const LightCase& c) {
  LightProposal proposal;
  c.set_up(proposal);
  const Light& light = c.light();
  const Vec3 middle = light.type == LightType::Rectangle
                          ? light.origin + (light.edge_u + light.edge_v) * 0.5f
                          : light.center;
  constexpr float kFree = std::numeric_limits<float>::infinity();
  const Vec3 outline = outline_direction(c);
  if (!proposal.grazes(outline, kFree)) return "a ray along the outline does not graze";
  if (proposal.grazes(outline, 1e-3f)) return "a ray that is stopped before the light grazes";
  if (proposal.grazes((middle - c.field->point.position).normalized(), kFree)) {
    return "a ray through the middle grazes";
  }
  return proposal.grazes(-outline, kFree) ? "a ray away from the light grazes" : "";
}

void time_set_up(benchmark::State& state, Suite& suite, const LightCase& c) {
  LightProposal proposal;
  if (!suite.passes(state, "light/" + c.name,
                    [&] { return light_fault(c, suite.config().seed); })) {
    return;
  }
  time_kernel(state, {"light", 1.0, &suite.ray_meter()}, [&] {
    benchmark::DoNotOptimize(c.set_up(proposal));
    benchmark::ClobberMemory();
  });
}

void time_block(benchmark::State& state, Suite& suite, const LightCase& c, bool draws) {
  if (!suite.passes(state, "light/" + c.name,
                    [&] { return light_fault(c, suite.config().seed); })) {
    return;
  }
  LightProposal proposal;
  c.set_up(proposal);
  const VariateBlock variates = block_of_variates(suite.config().seed);
  VectorBlock wi;
  Block<float> pdf{};
  proposal.sample(variates, kBlock, 0, wi, pdf);
  time_kernel(state, {"sample", kBlock, &suite.ray_meter()}, [&] {
    if (draws) {
      proposal.sample(variates, kBlock, 0, wi, pdf);
    } else {
      proposal.pdf_w(wi, kBlock, pdf);
    }
    benchmark::DoNotOptimize(&pdf);
    benchmark::ClobberMemory();
  });
}

void time_grazes(benchmark::State& state, Suite& suite, const LightCase& c) {
  if (!suite.passes(state, "grazes/" + c.name, [&] { return grazes_fault(c); })) return;
  LightProposal proposal;
  c.set_up(proposal);
  VectorBlock wi;
  Block<float> pdf{};
  proposal.sample(block_of_variates(suite.config().seed), kBlock, 0, wi, pdf);
  time_kernel(state, {"ray", kBlock, &suite.ray_meter()}, [&] {
    bool any = false;
    for (std::size_t i = 0; i < kBlock; ++i) any |= proposal.grazes(wi[i], 3.0f);
    benchmark::DoNotOptimize(any);
  });
}

std::vector<LightCase> light_cases(Suite& suite) {
  const RectangleShape rectangle{Vec3d(-0.4, -0.3, 2.0), Vec3d(0.0, 0.8, 0.0),
                                 Vec3d(1.0, 0.0, 0.0)};
  const SphereShape sphere{Vec3d(0.3, 0.2, 2.0), 0.5};
  std::vector<LightCase> cases;
  const auto add = [&](std::string name, LightSampling sampling, auto make) {
    const LightField& field = suite.field(name, make);
    cases.push_back({std::move(name), sampling, &field});
  };
  const auto make_rectangle = [&] { return make_single_light(rectangle); };
  add("rectangle_area", LightSampling::Area, make_rectangle);
  add("rectangle_angle", LightSampling::SolidAngle, make_rectangle);
  add("sphere", LightSampling::SolidAngle, [&] { return make_single_light(sphere); });
  for (const int rings : suite.config().mesh_levels) {
    add(fmt::format("mesh_{}_triangles", 4 * rings * (rings - 1)), LightSampling::Area,
        [&] { return make_single_light(sphere_mesh(rings)); });
  }
  add("environment", LightSampling::Area, make_sky);
  return cases;
}

}  // namespace

void register_light_kernels(Suite& suite) {
  for (const LightCase& c : light_cases(suite)) {
    const auto add = [&](const char* kernel, auto time) {
      benchmark::RegisterBenchmark(fmt::format("light/{}/{}", c.name, kernel).c_str(), time);
    };
    add("set_up", [&suite, c](benchmark::State& state) { time_set_up(state, suite, c); });
    add("sample", [&suite, c](benchmark::State& state) { time_block(state, suite, c, true); });
    add("pdf_w", [&suite, c](benchmark::State& state) { time_block(state, suite, c, false); });
    const LightType type = c.light().type;
    if (type == LightType::Rectangle || type == LightType::Sphere) {
      add("grazes", [&suite, c](benchmark::State& state) { time_grazes(state, suite, c); });
    }
  }
}

}  // namespace penumbra::micro
