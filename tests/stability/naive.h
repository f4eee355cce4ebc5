#pragma once

/// For the naive formulas of negative controls: what they divide by 0 is what they are here to
/// show, not a finding of the sanitizer.
#define PN_NAIVE __attribute__((no_sanitize("float-divide-by-zero")))
