#pragma once

#include <filesystem>
#include <vector>

#include "harness/run_row.h"

/// measurements.csv of ranks that measure at once: each appends to a file of its own, and the root
/// puts them together.
namespace penumbra {

/// measurements.csv of a folder.
std::filesystem::path row_file(const std::filesystem::path& folder);

/// The file that a rank appends to.
std::filesystem::path row_part(const std::filesystem::path& folder, int rank);

/// Appends the rows of all parts to measurements.csv, in canonical order, and removes the parts.
/// Rows that are there already, of a call that was stopped in between, are not added again; a torn
/// last line is left out.
/// @return rows that were added
/// @throws RunError when another process writes one of the files; InputError as read_run_rows
std::size_t join_row_parts(const std::filesystem::path& folder);

/// The order in which one process would have measured: by block, then by position.
void sort_rows(std::vector<RunRow>& rows);

}  // namespace penumbra
