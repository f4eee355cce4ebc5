#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Messages about names that are not known.
namespace penumbra {

/// Number of insertions, deletions, substitutions and swaps of neighbours that turn `a` into `b`,
/// bytewise; no substring is edited twice ("optimal string alignment"). Source: Damerau 1964, "A
/// technique for computer detection and correction of spelling errors".
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The candidate that was most likely meant: the nearest without regard to case, the nearest with
/// regard to case among equals, then the first. At most one edit per three characters, and three in
/// all, pass as a slip.
/// @return empty when none is near enough
std::string nearest_name(std::string_view given, const std::vector<std::string>& candidates);

/// `did you mean "x"?`, or empty when no candidate is near enough.
std::string did_you_mean(std::string_view given, const std::vector<std::string>& candidates);

/// `allowed: a, b, c`; `none is allowed` when there is none.
std::string allowed_names(const std::vector<std::string>& candidates);

/// `unknown <kind> "given"; did you mean "x"? (allowed: x, y, z)`.
std::string unknown_name(std::string_view kind, std::string_view given,
                         const std::vector<std::string>& candidates);

}  // namespace penumbra
