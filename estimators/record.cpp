#include "estimators/record.h"

namespace penumbra {

std::string_view to_string(SampleFate fate) {
  switch (fate) {
    case SampleFate::NoDirection:
      return "no direction";
    case SampleFate::BelowHorizon:
      return "below horizon";
    case SampleFate::MissesLights:
      return "misses lights";
    case SampleFate::BlackBsdf:
      return "black f";
    case SampleFate::NotChosen:
      return "not chosen";
    case SampleFate::Dark:
      return "dark";
    case SampleFate::Lit:
      return "lit";
  }
  return "";
}

EstimateRecord* EstimateRecorder::begin(int pixel, int estimate) {
  if (pixel != pixel_in_tile) return nullptr;
  EstimateRecord& record = estimates.emplace_back();
  record.estimate = estimate;
  return &record;
}

EstimateRecord* EstimateRecorder::find(int pixel, int estimate) {
  if (pixel != pixel_in_tile) return nullptr;
  for (EstimateRecord& record : estimates) {
    if (record.estimate == estimate) return &record;
  }
  return nullptr;
}

}  // namespace penumbra
