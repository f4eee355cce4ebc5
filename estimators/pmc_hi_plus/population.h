#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimators/mixture/sums.h"
#include "scenes/core/sampler.h"
#include "scenes/core/shading_point.h"

/// What the initial populations of a block of pixels found, and what their neighbours may know.
namespace penumbra::pmc_hi_plus {

inline constexpr int kBlockSide = 8;  ///< [pixels]
inline constexpr int kBlockPixels = kBlockSide * kBlockSide;
inline constexpr int kMostEstimates = 8;  ///< of a pixel, that learn from one another

/// Estimates of a pixel are made at a few points of it in turn. They are learned from in two
/// halves, like the squares of a chessboard over pixels and estimates: what one half found decides
/// what the other half draws, so that no estimate's samples decide their own number. Each point has
/// estimates in both halves, where it has more than one.
/// @param points  of a pixel that have estimates
inline constexpr int half_of(int x, int y, int estimate, int points) noexcept {
  return (x + y + estimate / points + estimate % points) & 1;
}

/// Means over the estimates of one half in the neighbourhood of a place, weighted by
/// 1/(1 + d^2) with the distance d in pixels.
struct Neighbourhood {
  int estimates{0};
  double luminance{0};   ///< of the initial estimates
  double lobe_share{0};  ///< of that luminance, for which the BSDF component's density stands
  /// [slot], of a component's part of an estimate, if it drew one sample only; at least the mean
  /// over the estimates at the same point
  std::span<const double> variance;
};

/// Initial populations of a block. Slots are the scene's sampled lights, then the BSDF.
class Population {
 public:
  /// One estimate.
  struct Member {
    bool used{false};
    StreamKey key;
    std::uint32_t material{0};
    Vec3 normal{0.0f};
    int lights{0};                  ///< that can contribute at the point
    bool lobe{false};               ///< whether the BSDF component can draw
    double luminance{0};            ///< of the initial estimate
    double lobe_luminance{0};       ///< part of it that the BSDF component's density stands for
    RgbSum radiance{0.0};           ///< the initial estimate
    std::size_t first{0}, last{0};  ///< its lit samples
  };

  /// The estimates of one half at one point of a pixel: they decide the same, and have the same
  /// decided for them.
  struct Place {
    int count{0};                            ///< estimates in use
    std::size_t first{0};                    ///< one of them
    double luminance{0}, lobe_luminance{0};  ///< sums
  };

  /// @param estimates  most estimates of a pixel at a time
  Population(std::size_t slots, int estimates);

  /// Forgets all.
  /// @param estimates       of each pixel, at most those of the constructor
  /// @param camera_samples  points of a pixel that they take turns at
  void begin(int width, int height, int estimates, int camera_samples) noexcept;

  int width() const noexcept { return width_; }
  int pixels() const noexcept { return width_ * height_; }
  int estimates() const noexcept { return estimates_; }
  int half(int pixel, int estimate) const noexcept {
    return half_of(pixel % width_, pixel / width_, estimate, points_);
  }
  std::size_t index(int pixel, int estimate) const noexcept {
    return static_cast<std::size_t>(pixel) * static_cast<std::size_t>(estimates_) +
           static_cast<std::size_t>(estimate);
  }

  /// Puts an estimate at a point into use, with nothing found yet.
  Member& use(std::size_t i, const ShadingPoint& point) noexcept;
  const Member& operator[](std::size_t i) const noexcept { return members_[i]; }
  /// [slot], as in Neighbourhood.
  std::span<double> variance(std::size_t i) noexcept {
    return std::span(variance_).subspan(i * slots_, slots_);
  }

  /// Adds up the estimates of each place; before all that follows.
  void gather() noexcept;
  /// Places are numbered by pixel, half and point.
  std::size_t most_places() const noexcept { return places_.size(); }
  std::size_t place_of(int pixel, int estimate) const noexcept {
    return place_index(pixel, half(pixel, estimate), estimate % points_);
  }
  const Place& place(std::size_t p) const noexcept { return places_[p]; }
  /// Calls visit(p, place) for the places of one half that have estimates.
  template <typename Visit>
  void for_each_place(int half, Visit visit) const noexcept {
    for (int pixel = 0; pixel < pixels(); ++pixel) {
      for (int point = 0; point < points_; ++point) {
        const std::size_t p = place_index(pixel, half, point);
        if (places_[p].count > 0) visit(p, places_[p]);
      }
    }
  }
  /// What estimates of the other half found around a place, on surfaces of its kind: the same
  /// material and a normal within 60 degrees.
  /// @param radius   [pixels]; 0: the pixel alone
  /// @param scratch  [slot]
  Neighbourhood around(std::size_t p, int radius, std::span<double> scratch) const noexcept;

 private:
  std::size_t place_index(int pixel, int half, int point) const noexcept {
    return static_cast<std::size_t>(pixel * 2 + half) * static_cast<std::size_t>(points_) +
           static_cast<std::size_t>(point);
  }
  bool same_kind(std::size_t a, std::size_t b) const noexcept;

  std::size_t slots_;
  int width_{0}, height_{0}, estimates_{0};
  int points_{1};                     // of a pixel that have estimates
  std::vector<Member> members_;       // [estimate]
  std::vector<double> variance_;      // [estimate][slot]
  std::vector<Place> places_;         // [place]
  std::vector<double> variance_sum_;  // [place][slot]
};

}  // namespace penumbra::pmc_hi_plus
