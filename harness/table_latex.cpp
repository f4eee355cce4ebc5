#include "harness/table_latex.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cctype>
#include <map>
#include <set>
#include <vector>

#include "harness/number_text.h"

namespace penumbra {
namespace {

/// 1.23e-7 in mathematics; text that is no number stays.
std::string latex_number(const std::string& text) {
  if (text == "-") return "--";
  const std::size_t e = text.find('e');
  const bool scaled = e != std::string::npos && e > 0;
  if (!scaled) return "$" + text + "$";
  return fmt::format("${}\\times10^{{{}}}$", text.substr(0, e), text.substr(e + 1));
}

std::string latex_ratio(const std::optional<double>& value) {
  return value ? latex_number(ratio_text(*value)) : "--";
}

std::string latex_interval(const EfficiencyRow& row) {
  if (!row.ratio) return "--";
  const bool exact = row.ratio_lo == row.ratio && row.ratio_hi == row.ratio;
  if (!row.ratio_lo || !row.ratio_hi || exact) return latex_ratio(row.ratio);
  return fmt::format("{} [{}, {}]", latex_ratio(row.ratio), latex_ratio(row.ratio_lo),
                     latex_ratio(row.ratio_hi));
}

std::string latex_seconds(const std::optional<double>& value) {
  const std::string text = seconds_text(value);
  const std::size_t blank = text.find(' ');
  if (blank == std::string::npos) return latex_number(text);
  return latex_number(text.substr(0, blank)) + "\\," + text.substr(blank + 1);
}

std::string srl_text(const EfficiencyRow& row) {
  if (row.srl_adaptive == 0) return std::to_string(row.srl);
  return fmt::format("{}-{}", row.srl_initial, row.srl_adaptive);
}

std::optional<double> time_of(const EfficiencyRow& row, const TableOptions& options) {
  return options.primary == PrimaryTime::Cpu ? row.time_cpu_s : row.time_wall_s;
}

std::optional<double> efficiency_of(const EfficiencyRow& row, const TableOptions& options) {
  return options.primary == PrimaryTime::Cpu ? row.eff_cpu : row.eff;
}

std::string verdict_of(const EfficiencyRow& row) {
  return latex_escaped(std::string(verdict_text(row.verdict)) + (is_biased(row) ? ", biased" : ""));
}

/// Characters that may stand in a name of \csname.
std::string name_part(std::string_view text) {
  constexpr std::string_view kAllowed = " .+-=(),:/_";
  std::string name;
  for (const char c : text) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 && (c & 0x80) == 0;
    name += plain || kAllowed.find(c) != std::string_view::npos ? c : '-';
  }
  return name;
}

using Rows = std::span<const EfficiencyRow>;

/// What may tell cells of one label apart, in this order.
std::array<std::string, 5> parts_of(const EfficiencyRow& row) {
  return {row.sampler, row.budget_s ? fmt::format("B{:g}", *row.budget_s) : "", row.params,
          "SRL" + srl_text(row), fmt::format("SPP{}", row.spp)};
}

/// The label and what it takes to tell the row apart from others of its label in its scene.
std::string label_name(const EfficiencyRow& row, Rows rows) {
  std::vector<const EfficiencyRow*> others;
  for (const EfficiencyRow& other : rows) {
    const bool rival = &other != &row && other.scene == row.scene && other.label == row.label;
    if (rival) others.push_back(&other);
  }
  std::string name = row.label;
  const auto parts = parts_of(row);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto told_apart =
        std::erase_if(others, [&](const auto* other) { return parts_of(*other)[i] != parts[i]; });
    if (told_apart > 0 && !parts[i].empty()) name += "/" + parts[i];
  }
  return name;
}

/// Names of all rows, unique within a scene.
std::vector<std::string> names_of(Rows rows) {
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (const EfficiencyRow& row : rows) {
    const std::string scene = name_part(row.scene) + "@";
    const std::string name = scene + name_part(label_name(row, rows));
    std::string free = name;
    for (int i = 2; !taken.insert(free).second; ++i) free = fmt::format("{}/{}", name, i);
    names.push_back(free);
  }
  return names;
}

struct Macro {
  std::string_view name;
  std::string (*text)(const EfficiencyRow&, const TableOptions&);
};

constexpr std::array<Macro, 8> kMacros{{
    {"Ratio", [](const auto& r, const auto&) { return latex_ratio(r.ratio); }},
    {"RatioInterval", [](const auto& r, const auto&) { return latex_interval(r); }},
    {"RatioLow", [](const auto& r, const auto&) { return latex_ratio(r.ratio_lo); }},
    {"RatioHigh", [](const auto& r, const auto&) { return latex_ratio(r.ratio_hi); }},
    {"MSE", [](const auto& r, const auto&) { return latex_number(number_text(r.err)); }},
    {"RelMSE", [](const auto& r, const auto&) { return latex_number(number_text(r.relmse)); }},
    {"Time", [](const auto& r, const auto& o) { return latex_seconds(time_of(r, o)); }},
    {"Verdict", [](const auto& r, const auto&) { return verdict_of(r); }},
}};

std::string macros(Rows rows, const TableOptions& options) {
  std::string text =
      "\\makeatletter\n"
      "\\newcommand{\\penumbra@value}[3]{\\ifcsname penumbra@#1@#2@#3\\endcsname\n"
      "  \\csname penumbra@#1@#2@#3\\endcsname\\else\n"
      "  \\textbf{??}\\@latex@warning{Penumbra has no #1 of \\detokenize{#2}, "
      "\\detokenize{#3}}\\fi}\n";
  for (const Macro& macro : kMacros) {
    text += fmt::format("\\newcommand{{\\Penumbra{0}}}[2]{{\\penumbra@value{{{0}}}{{#1}}{{#2}}}}\n",
                        macro.name);
  }
  text += "\\makeatother\n";
  const std::vector<std::string> names = names_of(rows);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    text += "% " + names[i] + "\n";
    for (const Macro& macro : kMacros) {
      text += fmt::format("\\expandafter\\def\\csname penumbra@{}@{}\\endcsname{{{}}}\n",
                          macro.name, names[i], macro.text(rows[i], options));
    }
  }
  return text;
}

std::string table(Rows rows, const TableOptions& options) {
  std::string text =
      "\\newcommand{\\PenumbraTable}{%\n\\begin{tabular}{lllrrrrrrl}\n\\toprule\n"
      "Scene & Method & Points & SPP & SRL & $T$ & MSE & Eff & Ratio & Verdict \\\\\n"
      "\\midrule\n";
  std::string scene;
  for (const EfficiencyRow& row : rows) {
    const bool next = row.scene != scene;
    if (next && !scene.empty()) text += "\\addlinespace\n";
    scene = row.scene;
    const std::string label = row.params.empty() ? row.label : row.label + " " + row.params;
    const std::array<std::string, 10> fields{next ? latex_escaped(row.scene) : "",
                                             latex_escaped(label),
                                             latex_escaped(row.sampler),
                                             std::to_string(row.spp),
                                             latex_escaped(srl_text(row)),
                                             latex_seconds(time_of(row, options)),
                                             latex_number(number_text(row.err)),
                                             latex_number(number_text(efficiency_of(row, options))),
                                             latex_interval(row),
                                             verdict_of(row)};
    text += fmt::format("{} \\\\\n", fmt::join(fields, " & "));
  }
  return text + "\\bottomrule\n\\end{tabular}}\n";
}

std::string header(const TableOptions& options) {
  return fmt::format(
      "% Efficiencies measured by Penumbra. Put \\input of this file into the preamble, with\n"
      "% \\usepackage{{booktabs}}; \\PenumbraTable then prints the table and, for example,\n"
      "% \\PenumbraRatioInterval{{scene}}{{label}} quotes one number. Names are listed below.\n"
      "% Eff is 1/(T MSE) in {} time; ratios are to \"{}\" in the same blocks, with {:g} %\n"
      "% intervals by a block jackknife; MSE is debiased.\n",
      options.primary == PrimaryTime::Cpu ? "CPU" : "wall", name_part(options.baseline),
      100 * options.confidence);
}

std::string code_point_text(std::string_view text, std::size_t& i) {
  const auto lead = static_cast<unsigned char>(text[i]);
  const std::size_t more = lead >= 0xF0 ? 3 : lead >= 0xE0 ? 2 : lead >= 0xC0 ? 1 : 0;
  unsigned point = more == 0 ? 0xFFFD : lead & (0x3F >> more);
  for (std::size_t k = 0; k < more; ++k) {
    if (i + 1 >= text.size() || (text[i + 1] & 0xC0) != 0x80) return "U+FFFD";
    point = point << 6 | (static_cast<unsigned char>(text[++i]) & 0x3Fu);
  }
  return fmt::format("U+{:04X}", point);
}

}  // namespace

std::string latex_escaped(std::string_view text) {
  static const std::map<char, std::string_view> kSpecial{{'\\', "\\textbackslash{}"},
                                                         {'{', "\\{"},
                                                         {'}', "\\}"},
                                                         {'$', "\\$"},
                                                         {'&', "\\&"},
                                                         {'#', "\\#"},
                                                         {'%', "\\%"},
                                                         {'_', "\\_"},
                                                         {'^', "\\textasciicircum{}"},
                                                         {'~', "\\textasciitilde{}"},
                                                         {'<', "\\textless{}"},
                                                         {'>', "\\textgreater{}"},
                                                         {'|', "\\textbar{}"},
                                                         {'"', "\\char34{}"},
                                                         {'-', "{-}"},
                                                         {'`', "\\char96{}"},
                                                         {'\'', "\\char39{}"},
                                                         {'\n', " "},
                                                         {'\r', " "},
                                                         {'\t', " "}};
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (const auto found = kSpecial.find(c); found != kSpecial.end()) {
      result += found->second;
    } else if ((c & 0x80) != 0) {
      result += code_point_text(text, i);
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) {
      result += fmt::format("U+{:04X}", static_cast<unsigned>(c));
    } else {
      result += c;
    }
  }
  return result;
}

std::string to_latex(std::span<const EfficiencyRow> rows, const TableOptions& options) {
  return header(options) + macros(rows, options) + table(rows, options);
}

}  // namespace penumbra
