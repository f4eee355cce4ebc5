#pragma once

#include <string_view>

/// The page's own files, compiled in (harness/page/assets/).
namespace penumbra {

extern const std::string_view kPageHtml;
extern const std::string_view kPageCss;
extern const std::string_view kPageBaseJs;    ///< data, numbers, colours, themes
extern const std::string_view kPageTablesJs;  ///< summary, tables, provenance
extern const std::string_view kPagePlotSpecsJs;
extern const std::string_view kPagePlotsJs;
extern const std::string_view kPagePixelsJs;  ///< loading and colouring of pixels
extern const std::string_view kPageViewerJs;
extern const std::string_view kPageMainJs;

}  // namespace penumbra
