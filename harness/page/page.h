#pragma once

#include <filesystem>

#include "harness/report.h"

/// The report as one HTML page that needs nothing but a browser: no network, no server.
namespace penumbra {

struct PageOptions {
  bool embed_images{false};  ///< into the page itself, in place of the folder beside it
};

/// Writes report.html into a result folder, and unless embedded the images' pixels into
/// report_files/, which the page loads when they are looked at. Pictures that are missing are left
/// out, and the page says so.
/// @return the page
/// @throws RunError when a file cannot be written
std::filesystem::path write_page(const std::filesystem::path& folder, const Report& report,
                                 const PageOptions& options);

}  // namespace penumbra
