#include "estimators/restir_di/reservoirs.h"

namespace penumbra::restir_di {
namespace {

// Iterations that a repetition's random numbers are keyed by, before the component goes up by one.
constexpr std::uint32_t kIterations = 4000;

// Index of the first entry whose cumulative weight is above u x the last, which is positive.
// Entries without a weight of their own are never chosen, also where the product rounds to the
// last.
std::size_t choose_entry(std::span<const double> cumulative, float u) noexcept {
  const double aim = static_cast<double>(u) * cumulative.back();
  std::size_t chosen = 0;
  double before = 0.0;
  for (std::size_t i = 0; i < cumulative.size() && !(before > aim); ++i) {
    if (cumulative[i] > before) chosen = i;
    before = cumulative[i];
  }
  return chosen;
}

}  // namespace

// Streams: behind the lights', places on lights, choices of lights, and what a repetition decides.
StreamKey Reservoirs::stream(const Pixel& pixel, std::uint32_t purpose,
                             std::uint32_t iteration) const noexcept {
  StreamKey key = pixel.key;
  key.component = static_cast<std::uint32_t>(scene_->lights().size()) + purpose;
  key.iteration = iteration;
  return key;
}

PointSet Reservoirs::decisions(const Pixel& pixel, std::uint32_t r) const noexcept {
  return PointSet(SamplerKind::Independent, stream(pixel, 2 + r / kIterations, 1 + r % kIterations),
                  1 + settings_.neighbours);
}

// All candidates of an estimate are one point set.
void Reservoirs::fill(Pixel& pixel, std::uint32_t r) noexcept {
  const std::uint32_t count = settings_.candidates;
  const PointSet places(sampler_, stream(pixel, 0, 0), pixel.repetitions * count);
  const PointSet choices(sampler_, stream(pixel, 1, 0), pixel.repetitions * count);
  places.fill(r * count, count, true, places_);
  choices.fill(r * count, count, false, choices_);
  pixel.own.weight = 0.0;
  double sum = 0.0;
  for (std::uint32_t j = 0; j < count; ++j) {
    Reservoir& candidate = candidate_[j];
    candidate.at = lights_.sample(pixel.receiver.point().position, choices_.x[j], places_[j]);
    if (candidate.at.pdf > 0.0) {
      candidate.target = connect(pixel, candidate.at).target;
      sum += candidate.target / candidate.at.pdf;
    }
    cumulative_[j] = sum;
  }
  if (!(sum > 0.0)) return;
  pixel.own =
      candidate_[choose_entry(std::span(cumulative_).first(count), decisions(pixel, r)(0).choice)];
  pixel.own.weight = sum / (count * pixel.own.target);
}

std::optional<Choice> Reservoirs::choose(std::span<Pixel* const> members,
                                         std::uint32_t r) noexcept {
  const Pixel& pixel = *members[0];
  double sum = 0.0;
  for (std::size_t s = 0; s < members.size(); ++s) {
    const Reservoir& offer = members[s]->own;
    if (offer.weight > 0.0) {
      const Connection& here = connection_[s] = connect(pixel, offer.at);
      if (here.target > 0.0) sum += share(members, s, here.target) * here.target * offer.weight;
    }
    cumulative_[s] = sum;
  }
  if (!(sum > 0.0)) return std::nullopt;
  const std::size_t chosen =
      choose_entry(std::span(cumulative_).first(members.size()), decisions(pixel, r)(0).u.x);
  const Connection& connection = connection_[chosen];
  return Choice{members[chosen]->own.at, connection, sum / connection.target};
}

// m_s at the light point of member s.
double Reservoirs::share(std::span<Pixel* const> members, std::size_t s,
                         double target_here) const noexcept {
  if (settings_.one_over_m) return 1.0 / static_cast<double>(members.size());
  const Reservoir& offer = members[s]->own;
  double total = 0.0;
  for (std::size_t q = 0; q < members.size(); ++q) {
    total += q == s ? offer.target : q == 0 ? target_here : connect(*members[q], offer.at).target;
  }
  return offer.target / total;
}

}  // namespace penumbra::restir_di
