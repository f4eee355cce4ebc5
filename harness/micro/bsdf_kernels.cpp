// Materials of every type, a block of directions at a time.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "harness/micro/checks.h"
#include "harness/micro/register.h"
#include "scenes/core/bsdf.h"

namespace penumbra::micro {
namespace {

struct MaterialCase {
  std::string name;
  MaterialDescription material;

  // Seen at 45 degrees.
  BoundBsdf bound() const { return {Bsdf(material), Vec3(std::sqrt(0.5f), 0.0f, std::sqrt(0.5f))}; }
};

VariateBlock block_of_variates(std::uint64_t seed, std::uint32_t number) {
  StreamKey key;
  key.seed = seed;
  key.estimate = number;
  VariateBlock block;
  PointSet(SamplerKind::Independent, key, kBlock).fill(0, kBlock, true, block);
  return block;
}

// Integrals over the hemisphere.
struct Integrals {
  double mass{0};    // of the density, or share of draws that gave a direction
  double albedo{0};  // of f cos, luminance
  double albedo_error{0};
};

// By quadrature, uniform in the cosine and the azimuth.
Integrals by_quadrature(const BoundBsdf& bsdf) {
  constexpr int kSide = 512;
  Integrals result;
  for (int y = 0; y < kSide; ++y) {
    const float z = (static_cast<float>(y) + 0.5f) / kSide;
    const float sine = std::sqrt(1.0f - z * z);
    for (int x = 0; x < kSide; ++x) {
      const float phi = 2.0f * std::numbers::pi_v<float> * (static_cast<float>(x) + 0.5f) / kSide;
      const BsdfValue value = bsdf.evaluate(Vec3(sine * std::cos(phi), sine * std::sin(phi), z));
      result.mass += static_cast<double>(value.pdf_w);
      result.albedo += static_cast<double>(luminance(value.f_cos));
    }
  }
  const double cell = 2.0 * std::numbers::pi / (kSide * kSide);
  result.mass *= cell;
  result.albedo *= cell;
  return result;
}

// By draws.
Integrals by_draws(const BoundBsdf& bsdf, std::uint64_t seed) {
  constexpr std::uint32_t kDraws = 16384;
  StreamKey key;
  key.seed = seed;
  const PointSet points(SamplerKind::Independent, key, kDraws);
  Integrals result;
  double squares = 0.0;
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    const auto wi = bsdf.sample(points(i));
    if (!wi) continue;
    const BsdfValue value = bsdf.evaluate(*wi);
    result.mass += 1.0;
    const double weight =
        static_cast<double>(luminance(value.f_cos)) / static_cast<double>(value.pdf_w);
    result.albedo += weight;
    squares += weight * weight;
  }
  result.mass /= kDraws;
  result.albedo /= kDraws;
  result.albedo_error =
      std::sqrt(std::max(squares / kDraws - result.albedo * result.albedo, 0.0) / kDraws);
  return result;
}

// Directions of draws above the horizon, in the lanes of a block.
VectorBlock drawn_directions(const BoundBsdf& bsdf, std::uint64_t seed) {
  VectorBlock directions;
  std::size_t count = 0;
  for (std::uint32_t number = 0; count < kBlock; ++number) {
    const VariateBlock variates = block_of_variates(seed, number);
    for (std::size_t i = 0; i < kBlock && count < kBlock; ++i) {
      const auto wi = bsdf.sample(variates[i]);
      if (wi && wi->z > 0.0f) directions.set(count++, *wi);
    }
  }
  return directions;
}

std::string blocks_fault(const BoundBsdf& bsdf, std::uint64_t seed) {
  const VariateBlock variates = block_of_variates(seed, 0);
  VectorBlock drawn;
  bsdf.sample(variates, kBlock, 0, drawn);
  for (std::size_t i = 0; i < kBlock; ++i) {
    const auto alone = bsdf.sample(variates[i]);
    const bool above = drawn.z[i] > 0.0f;
    if (alone.has_value() != above || (above && (*alone - drawn[i]).length() > 1e-5f)) {
      return fmt::format("direction {} differs from the one drawn alone", i);
    }
  }
  const VectorBlock directions = drawn_directions(bsdf, seed);
  VectorBlock f_cos;
  Block<float> pdf{};
  bsdf.evaluate(directions, kBlock, f_cos, pdf);
  std::vector<double> found, expected;
  for (std::size_t i = 0; i < kBlock; ++i) {
    const BsdfValue alone = bsdf.evaluate(directions[i]);
    found.insert(found.end(), {static_cast<double>(pdf[i]), static_cast<double>(f_cos.y[i])});
    expected.insert(expected.end(),
                    {static_cast<double>(alone.pdf_w), static_cast<double>(alone.f_cos.y)});
  }
  return values_fault("density and value, block and scalar", found, expected, 1e-4, 1e-7);
}

std::string material_fault(const MaterialCase& c, std::uint64_t seed) {
  const BoundBsdf bsdf = c.bound();
  const std::string fault = blocks_fault(bsdf, seed);
  if (!fault.empty()) return fault;
  const Integrals quadrature = by_quadrature(bsdf);
  const Integrals draws = by_draws(bsdf, seed);
  const std::string mass = mass_fault(quadrature.mass, draws.mass, 0.02);
  if (!mass.empty()) return mass;
  return values_fault("albedo", std::span(&draws.albedo, 1), std::span(&quadrature.albedo, 1), 0.01,
                      5.5 * draws.albedo_error);
}

void time_material(benchmark::State& state, Suite& suite, const MaterialCase& c, bool draws) {
  const std::uint64_t seed = suite.config().seed;
  if (!suite.passes(state, "bsdf/" + c.name, [&] { return material_fault(c, seed); })) return;
  const BoundBsdf bsdf = c.bound();
  const VariateBlock variates = block_of_variates(seed, 0);
  VectorBlock wi = drawn_directions(bsdf, seed);
  VectorBlock f_cos;
  Block<float> pdf{};
  time_kernel(state, {"sample", kBlock, &suite.ray_meter()}, [&] {
    if (draws) {
      bsdf.sample(variates, kBlock, 0, wi);
      benchmark::DoNotOptimize(&wi);
    } else {
      bsdf.evaluate(wi, kBlock, f_cos, pdf);
      benchmark::DoNotOptimize(&f_cos);
    }
    benchmark::ClobberMemory();
  });
}

std::vector<MaterialCase> material_cases(const MicroConfig& config) {
  std::vector<MaterialCase> cases;
  cases.push_back({"lambert", {"lambert", LambertMaterial{}}});
  PhongMaterial phong;
  phong.specular = Rgb(0.4f);
  cases.push_back({"phong", {"phong", phong}});
  for (const float alpha : config.alphas) {
    ConductorMaterial conductor;
    conductor.alpha = alpha;
    cases.push_back({fmt::format("conductor_{}", alpha), {"conductor", conductor}});
    MixtureMaterial mixture;
    mixture.glossy = conductor;
    cases.push_back({fmt::format("mixture_{}", alpha), {"mixture", mixture}});
    MetallicRoughnessMaterial coat;
    coat.base_color = Rgb(0.5f);
    coat.metallic = 0.3f;
    coat.roughness = std::sqrt(alpha);
    cases.push_back({fmt::format("metallic_roughness_{}", alpha), {"metallic_roughness", coat}});
  }
  return cases;
}

}  // namespace

void register_bsdf_kernels(Suite& suite) {
  for (const MaterialCase& c : material_cases(suite.config())) {
    for (const bool draws : {true, false}) {
      benchmark::RegisterBenchmark(
          fmt::format("bsdf/{}/{}", c.name, draws ? "sample" : "evaluate").c_str(),
          [&suite, c, draws](benchmark::State& state) { time_material(state, suite, c, draws); });
    }
  }
}

}  // namespace penumbra::micro
