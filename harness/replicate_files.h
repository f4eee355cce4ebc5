#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/image.h"
#include "harness/reference.h"
#include "harness/replicates.h"
#include "harness/run_row.h"

/// The pictures of single runs, <out>/runs/<run_id>.exr, and what is worked out of a cell's.
namespace penumbra {

/// The picture of a run. @param folder  of the results
std::filesystem::path run_picture(const std::filesystem::path& folder, const std::string& run_id);

/// Writes the picture of a run, the estimated quantity alone, whole or not at all. To be called
/// before the run's row is appended, so that no row lacks its picture.
/// @param row  of the run: ids and size go into the file
/// @throws RunError with path and reason
void write_run_picture(const std::filesystem::path& folder, const RunRow& row, const Image& image);

/// Bytes that a run's picture takes at most, noise being hardly compressible.
double run_picture_bytes(int width, int height);

/// Reads the pictures of one cell's runs, one after the other, and sums them up. Failed runs are
/// left out; of runs with one seed, whose pictures are equal, the first counts.
/// @param rows  of one cell
/// @return nullopt when fewer than two runs have a picture
/// @throws ReferenceError when a row was measured against another reference
/// @throws RunError when a picture cannot be read or is not the row's
std::optional<ReplicateSummary> summarise_replicates(const std::filesystem::path& folder,
                                                     std::span<const RunRow> rows,
                                                     const Reference& reference);

/// The rows of a table's cell, by block and attempt.
std::vector<RunRow> rows_of_cell(std::span<const RunRow> rows, const EfficiencyRow& cell);

/// Writes what the replicates of a cell look like: layer "" the standard deviation of one run,
/// "mean" the mean of the runs, "bias" that mean less the reference.
/// @param file  ends in .exr
/// @throws RunError with path and reason
void write_replicate_picture(const std::filesystem::path& file, const ReplicateSummary& summary,
                             const Reference& reference);

}  // namespace penumbra
