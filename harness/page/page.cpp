#include "harness/page/page.h"

#include <nlohmann/json.hpp>

#include "harness/atomic_file.h"
#include "harness/page/page_assets.h"
#include "harness/page/page_data.h"
#include "harness/page/vega.h"

namespace penumbra {
namespace {

/// Inside a script element only "</script" and "<!--" end or change it; in JSON both can be written
/// with an escaped '<'.
std::string inside_script(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

std::string inside_html(const std::string& plain) {
  std::string text;
  for (const char c : plain) {
    switch (c) {
      case '<':
        text += "&lt;";
        break;
      case '>':
        text += "&gt;";
        break;
      case '&':
        text += "&amp;";
        break;
      case '"':
        text += "&quot;";
        break;
      default:
        text += c;
    }
  }
  return text;
}

std::string filled(std::string_view page,
                   std::initializer_list<std::pair<std::string_view, std::string_view>> fields) {
  std::string text;
  for (std::size_t at = 0; at < page.size();) {
    const std::size_t begin = page.find("{{", at);
    if (begin == std::string_view::npos) return text.append(page.substr(at));
    const std::size_t end = page.find("}}", begin);
    text.append(page.substr(at, begin - at));
    const std::string_view name = page.substr(begin + 2, end - begin - 2);
    for (const auto& [field, value] : fields) {
      if (field == name) text.append(value);
    }
    at = end + 2;
  }
  return text;
}

}  // namespace

std::filesystem::path write_page(const std::filesystem::path& folder, const Report& report,
                                 const PageOptions& options) {
  const PageImages images = make_page_images(folder, report, options.embed_images);
  const auto json = page_data(folder, report, images);
  const std::string data =
      inside_script(json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  const std::string vega = vega_script();
  std::string script;
  for (const std::string_view part : {kPageBaseJs, kPageTablesJs, kPagePlotSpecsJs, kPagePlotsJs,
                                      kPagePixelsJs, kPageViewerJs, kPageMainJs}) {
    script += part;
  }
  const std::string title = inside_html(report.config.name);
  const std::filesystem::path file = folder / "report.html";
  write_file_atomically(file, filled(kPageHtml, {{"title", title},
                                                 {"style", kPageCss},
                                                 {"data", data},
                                                 {"vega", vega},
                                                 {"script", script},
                                                 {"pixels", images.scripts}}));
  return file;
}

}  // namespace penumbra
