#include "scenes/core/suggest.h"

#include <algorithm>
#include <cctype>
#include <tuple>

namespace penumbra {

namespace {

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

std::size_t max_edits(std::size_t length) { return std::clamp<std::size_t>(length / 3, 1, 3); }

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  // Three rows of the table suffice: a swap looks two rows back.
  std::vector<std::size_t> two_back(b.size() + 1);
  std::vector<std::size_t> previous(b.size() + 1);
  std::vector<std::size_t> current(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) previous[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitution = previous[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      current[j] = std::min({previous[j] + 1, current[j - 1] + 1, substitution});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        current[j] = std::min(current[j], two_back[j - 2] + 1);
      }
    }
    two_back.swap(previous);
    previous.swap(current);
  }
  return previous[b.size()];
}

std::string nearest_name(std::string_view given, const std::vector<std::string>& candidates) {
  // Nobody mistypes a name of such a length, and the table of distances grows with its square.
  constexpr std::size_t kMaxLength = 200;
  if (given.size() > kMaxLength) return {};
  const std::string given_lower = lower_case(given);
  std::tuple<std::size_t, std::size_t> best{};
  const std::string* nearest = nullptr;
  for (const std::string& candidate : candidates) {
    if (candidate.size() > kMaxLength) continue;
    const std::tuple distance{edit_distance(given_lower, lower_case(candidate)),
                              edit_distance(given, candidate)};
    if (std::get<0>(distance) > max_edits(std::max(given.size(), candidate.size()))) continue;
    if (nearest == nullptr || distance < best) {
      best = distance;
      nearest = &candidate;
    }
  }
  return nearest != nullptr ? *nearest : std::string();
}

std::string did_you_mean(std::string_view given, const std::vector<std::string>& candidates) {
  const std::string nearest = nearest_name(given, candidates);
  return nearest.empty() ? std::string() : "did you mean \"" + nearest + "\"?";
}

std::string allowed_names(const std::vector<std::string>& candidates) {
  if (candidates.empty()) return "none is allowed";
  std::string result = "allowed: ";
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i > 0) result += ", ";
    result += candidates[i];
  }
  return result;
}

std::string unknown_name(std::string_view kind, std::string_view given,
                         const std::vector<std::string>& candidates) {
  std::string result = "unknown " + std::string(kind) + " \"" + std::string(given) + "\"";
  if (const std::string hint = did_you_mean(given, candidates); !hint.empty())
    result += "; " + hint;
  return result + " (" + allowed_names(candidates) + ")";
}

}  // namespace penumbra
