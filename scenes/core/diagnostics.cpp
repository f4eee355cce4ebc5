#include "scenes/core/diagnostics.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "scenes/core/error.h"

namespace penumbra {

std::string Location::text() const {
  if (line == 0) return source;
  return source + ":" + std::to_string(line) + ":" + std::to_string(column);
}

std::string Diagnostic::text() const {
  std::string result = location.text() + ": error: ";
  if (!pointer.empty()) result += pointer + ": ";
  return result + message;
}

void DiagnosticList::add(Location location, std::string pointer, std::string message) {
  diagnostics_.push_back({std::move(location), std::move(pointer), std::move(message)});
}

bool DiagnosticList::covers(std::string_view pointer) const {
  return std::any_of(diagnostics_.begin(), diagnostics_.end(), [&](const Diagnostic& d) {
    return d.pointer.starts_with(pointer) &&
           (d.pointer.size() == pointer.size() || d.pointer[pointer.size()] == '/');
  });
}

std::string DiagnosticList::text() const {
  std::vector<Diagnostic> sorted = diagnostics_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return std::tie(a.location.source, a.location.line, a.location.column) <
           std::tie(b.location.source, b.location.line, b.location.column);
  });
  std::string result;
  for (std::size_t i = 0; i < std::min(sorted.size(), kMaxShown); ++i) {
    if (i > 0) result += '\n';
    result += sorted[i].text();
  }
  if (sorted.size() > kMaxShown) {
    result += "\n... and " + std::to_string(sorted.size() - kMaxShown) + " more errors";
  }
  return result;
}

void DiagnosticList::throw_if_any() const {
  if (!empty()) throw InputError(text());
}

}  // namespace penumbra
