#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "harness/page/page_images.h"
#include "harness/report.h"

namespace penumbra {

/// Of the data inside report.html. Keys may be added without another version.
inline constexpr int kPageDataVersion = 1;

/// Everything that the page shows, as JSON: {"format": "penumbra-report", "version", "name",
/// "summary", "folder", "baseline", "tuned_baseline", "confidence", "primary_time",
/// "relmse_epsilon", "published_source", "bias_level", "statements", "headline", "efficiency",
/// "curves", "curve_points", "aggregate", "ecdf", "runs", "stages", "images", "crops", "exposure",
/// "missing", "stale_rows", "files", "environment", "stability"}. Tables are {"columns", "rows"}
/// with the names and units of their CSV files (column_json.h); "headline" are places in
/// "efficiency" (summary.h).
nlohmann::ordered_json page_data(const std::filesystem::path& folder, const Report& report,
                                 const PageImages& images);

}  // namespace penumbra
