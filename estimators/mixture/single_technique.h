#pragma once

#include <memory>

#include "estimators/estimator.h"

namespace penumbra {

/// A way of drawing directions that needs no other.
enum class Technique : std::uint8_t {
  Bsdf,        ///< from the BSDF's own density
  Hemisphere,  ///< uniform above the geometric surface
};

/// The estimator that draws SRL x lights directions by one technique and averages f/pdf.
std::unique_ptr<Estimator> make_single_technique(const Scene& scene, const Budget& budget,
                                                 Technique technique);

}  // namespace penumbra
