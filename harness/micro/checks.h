#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "estimators/mdhi/leaf_tree.h"
#include "estimators/pmc_hi/adaptation.h"
#include "scenes/core/light.h"
#include "scenes/core/ray_batch.h"

/// What the result of every kernel is held against before the kernel is timed. Each function takes
/// a result and the kernel's input, works out by other means what is due, and returns the fault in
/// one clause; empty where there is none.
namespace penumbra::micro {

/// Values with their expectations; a relative difference of `relative`, or of `absolute`, passes.
std::string values_fault(std::string_view what, std::span<const double> found,
                         std::span<const double> expected, double relative, double absolute = 0.0);

/// Counts that sum to `total`, are not negative, and differ from total x alpha_k by less than
/// `limit`.
std::string counts_fault(std::span<const int> counts, std::span<const double> alpha, int total,
                         double limit);

/// Whether counts summed over independent draws have the expectation draws x total x alpha_k: all
/// within 5.5 standard deviations of a multinomial, which bounds those of systematic sampling.
std::string mean_counts_fault(std::span<const std::int64_t> sums, std::span<const double> alpha,
                              int total, int draws);

/// Counts raised to a minimum, against taking one at a time from the largest, the first of equals.
std::string raised_fault(std::span<const int> before, std::span<const int> after, int minimum);

/// A cone against mean direction and RMS angle in double precision, by the arc tangent.
/// @param wi  unit directions
std::string cone_fault(const Cone& cone, std::span<const Vec3> wi, std::span<const double> weights,
                       const pmc_hi::ConeRules& rules);

/// ALSD's probabilities against its formula, for evidence given in full.
/// @param pixel, block  [light]
std::string probabilities_fault(std::span<const double> pmf, std::span<const double> pixel,
                                std::span<const double> block, double samples, double uniform,
                                double kappa);

/// Whether the leaves tile the charts, hold every sample once and within their boxes, and no more
/// of them than `capacity`.
std::string leaves_fault(const mdhi::LeafTree& tree, std::size_t charts, std::size_t samples,
                         std::size_t capacity);

/// Whether a leaf has the largest error of all.
std::string worst_leaf_fault(const mdhi::LeafTree& tree, std::size_t leaf);

/// Whether points lie in [0, 1) and have the means of uniform ones, within `limit` standard errors
/// of independent points.
std::string uniform_fault(std::span<const float> values, double limit);

/// Whether each of n equal parts of [0, 1) holds one of n values.
std::string strata_fault(std::span<const float> values);

/// Whether a density integrates to the mass of the directions that its sampler returns.
/// @param integral   by quadrature
/// @param mass       share of draws that gave a direction
/// @param tolerance  of quadrature and draws together
std::string mass_fault(double integral, double mass, double tolerance);

/// Whether hits of a batch are those of single queries. Rays through a common edge may meet either
/// neighbour: one in a thousand, and one more, may differ.
std::string hits_fault(std::span<const RayHit> batch, std::span<const RayHit> single);

}  // namespace penumbra::micro
