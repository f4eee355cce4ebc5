#include "estimators/estimator.h"

namespace penumbra {

EstimateCounters& EstimateCounters::operator+=(const EstimateCounters& other) {
  estimates += other.estimates;
  samples += other.samples;
  candidates += other.candidates;
  rays += other.rays;
  lit += other.lit;
  iterations += other.iterations;
  uncovered += other.uncovered;
  untraced += other.untraced;
  return *this;
}

}  // namespace penumbra
