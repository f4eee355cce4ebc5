#pragma once

#include <filesystem>
#include <vector>

#include "harness/exr.h"
#include "harness/report.h"

/// The pictures of cells in a result folder, found by the rows of its table.
namespace penumbra {

/// The picture of a cell: its first block, rendered again with the estimator's maps.
struct ResultPicture {
  std::size_t row{0};          ///< of ReportTables::efficiency
  RunRow run;                  ///< the first block's
  std::filesystem::path file;  ///< exists
};

/// Those that are there, in the order of the table.
std::vector<ResultPicture> result_pictures(const std::filesystem::path& folder,
                                           const Report& report);

/// The reference that a cell's picture was compared with, seen emission included: the picture less
/// its error. @throws RunError when the file has no layer "error"
Image reference_picture(const ExrFile& picture);

}  // namespace penumbra
