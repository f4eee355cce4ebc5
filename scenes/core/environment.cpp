#include "scenes/core/environment.h"

#include <algorithm>
#include <cmath>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

constexpr double kTwoPi = 2.0 * M_PI;

// Share of a sky's power below which what is above the mean is taken as rounding.
constexpr double kLeastExcess = 1e-6;

double luminance_of(const Vec3d& c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; }

// Cosine of the polar angle at a row's upper edge, minus that at its lower edge, as a product: no
// digits cancel near the poles.
double cosine_step(std::uint32_t row, std::uint32_t rows) {
  const double step = M_PI / static_cast<double>(rows);
  return 2.0 * std::sin((static_cast<double>(row) + 0.5) * step) * std::sin(0.5 * step);
}

}  // namespace

Environment::Environment(std::span<const Rgb> texels, std::uint32_t columns, std::uint32_t rows,
                         double rotation_deg)
    : columns_(columns),
      rows_(rows),
      rotation_((rotation_deg / 360.0 - std::floor(rotation_deg / 360.0)) * kTwoPi),
      texels_(texels.begin(), texels.end()),
      pdfs_(texels.size()) {
  PN_CHECK(columns > 0 && rows > 0 && texels.size() == std::size_t{columns} * rows,
           "an environment has rows x columns texels");
  std::vector<double> weights(texels.size());
  double total = 0.0;
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const double solid_angle = texel_solid_angle(static_cast<std::uint32_t>(i / columns));
    weights[i] = static_cast<double>(luminance(texels[i])) * solid_angle;
    total += weights[i];
    power_ += Vec3d(texels[i]) * solid_angle;
  }
  black_ = !(total > 0.0);
  if (black_) {
    for (std::size_t i = 0; i < texels.size(); ++i) {
      weights[i] = texel_solid_angle(static_cast<std::uint32_t>(i / columns));
      total += weights[i];
    }
  } else {
    find_lit_rows();
  }
  distribution_ = PiecewiseConstant2D(weights, columns, rows);
  for (std::size_t i = 0; i < texels.size(); ++i) {
    pdfs_[i] = static_cast<float>(weights[i] / total /
                                  texel_solid_angle(static_cast<std::uint32_t>(i / columns)));
  }
}

void Environment::find_lit_rows() noexcept {
  const auto is_lit = [](const Rgb& texel) { return !is_black(texel); };
  const auto first = std::find_if(texels_.begin(), texels_.end(), is_lit) - texels_.begin();
  const auto behind = std::find_if(texels_.rbegin(), texels_.rend(), is_lit).base();
  const auto last = behind - texels_.begin() - 1;
  // Shares first: half of the rows is half of pi to the bit.
  const auto rows = static_cast<double>(rows_);
  lit_theta_min_ = static_cast<double>(first / columns_) / rows * M_PI;
  lit_theta_max_ = static_cast<double>(last / columns_ + 1) / rows * M_PI;
}

bool Environment::can_light(const Vec3& normal) const noexcept {
  if (black_) return false;
  // Of all azimuths, the nearest to the normal is the normal's own. In double, so that a surface
  // that faces straight down sees nothing of a sky that ends at the horizon.
  const Vec3d n(normal);
  const double theta = std::atan2(std::sqrt(n.x * n.x + n.z * n.z), n.y);
  return theta - lit_theta_max_ < 0.5 * M_PI && lit_theta_min_ - theta < 0.5 * M_PI;
}

double Environment::texel_solid_angle(std::uint32_t row) const noexcept {
  return kTwoPi / static_cast<double>(columns_) * cosine_step(row, rows_);
}

std::size_t Environment::texel(const Vec3& w) const noexcept {
  // The polar angle by atan2: acos has no digits left near the poles.
  const float theta = std::atan2(std::sqrt(w.x * w.x + w.z * w.z), w.y);
  float phi = std::atan2(w.z, w.x) - static_cast<float>(rotation_);
  // Twice where the rotation is large: the difference lies between -3 pi and pi.
  for (int turn = 0; turn < 2 && phi < 0.0f; ++turn) phi += static_cast<float>(kTwoPi);
  const auto row =
      static_cast<std::uint32_t>(theta * (static_cast<float>(rows_) / static_cast<float>(M_PI)));
  const auto column =
      static_cast<std::uint32_t>(phi * (static_cast<float>(columns_) / static_cast<float>(kTwoPi)));
  return std::size_t{std::min(row, rows_ - 1)} * columns_ + std::min(column, columns_ - 1);
}

Rgb Environment::radiance(const Vec3& w) const noexcept { return texels_[texel(w)]; }

float Environment::pdf_w(const Vec3& w) const noexcept { return pdfs_[texel(w)]; }

Environment::Sample Environment::sample(const Vec2& u) const noexcept {
  const Vec3 w = direction(distribution_.sample(u).uv);
  // Looked up like the radiance, not taken from the texel drawn: at the border of a dim texel to a
  // bright one their quotient would be a firefly.
  return {w, pdf_w(w)};
}

// The direction at coordinates of the grid, in [0, 1)^2.
Vec3 Environment::direction(const Vec2& uv) const noexcept {
  const double row_coordinate = static_cast<double>(uv.y) * rows_;
  const std::uint32_t row = std::min(static_cast<std::uint32_t>(row_coordinate), rows_ - 1);
  const double within = row_coordinate - row;
  // Uniform in the cosine within the row, from the nearer pole, where 1 - cos keeps its digits.
  const bool upper = 2 * row < rows_;
  const std::uint32_t from_pole = upper ? row : rows_ - 1 - row;
  const double half = 0.5 * static_cast<double>(from_pole) * M_PI / static_cast<double>(rows_);
  const double edge = 2.0 * std::sin(half) * std::sin(half);
  const double depth = edge + cosine_step(row, rows_) * (upper ? within : 1.0 - within);
  const double sine = std::sqrt(std::max(0.0, depth * (2.0 - depth)));
  const double phi = kTwoPi * static_cast<double>(uv.x) + rotation_;
  return {static_cast<float>(sine * std::cos(phi)),
          static_cast<float>(upper ? 1.0 - depth : depth - 1.0),
          static_cast<float>(sine * std::sin(phi))};
}

std::size_t Environment::memory_bytes() const noexcept {
  // Texel, density, cumulative weights of the rows and of the marginal.
  return texels_.size() * (sizeof(Rgb) + sizeof(float) + sizeof(double)) +
         std::size_t{rows_} * 2 * sizeof(double);
}

CompensatedDensity::CompensatedDensity(const Environment& environment)
    : environment_(&environment), pdfs_(environment.texels_.size()) {
  const std::uint32_t columns = environment.columns();
  const auto solid_angle = [&](std::size_t texel) {
    return environment.texel_solid_angle(static_cast<std::uint32_t>(texel / columns));
  };
  const double power = luminance_of(environment.power());
  const double mean = power / (4.0 * M_PI);
  std::vector<double> weights(pdfs_.size());
  double total = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto radiance = static_cast<double>(luminance(environment.texels_[i]));
    weights[i] = std::max(0.0, radiance - mean) * solid_angle(i);
    total += weights[i];
  }
  // An even sky is above its mean by rounding only.
  if (!(total > kLeastExcess * power)) {
    total = 1.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      weights[i] = static_cast<double>(environment.pdfs_[i]) * solid_angle(i);
    }
  }
  distribution_ = PiecewiseConstant2D(weights, columns, environment.rows());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    pdfs_[i] = static_cast<float>(weights[i] / total / solid_angle(i));
  }
}

Environment::Sample CompensatedDensity::sample(const Vec2& u) const noexcept {
  const Vec3 w = environment_->direction(distribution_.sample(u).uv);
  return {w, pdf_w(w)};
}

float CompensatedDensity::pdf_w(const Vec3& w) const noexcept {
  return pdfs_[environment_->texel(w)];
}

}  // namespace penumbra
