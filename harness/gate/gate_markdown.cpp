#include "harness/gate/gate_markdown.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "harness/gate/gate_words.h"
#include "harness/number_text.h"
#include "harness/text_grid.h"

namespace penumbra {
namespace {

// Text without meaning to Markdown or HTML. The grid and lists of text_grid.h escape "|" and line
// ends themselves.
std::string escaped(std::string_view text) {
  constexpr std::string_view kActive = "\\`*_[]<>&~$";
  std::string result;
  for (const char c : readable(text)) {
    if (kActive.find(c) != std::string_view::npos) result += '\\';
    result += c;
  }
  return result;
}

std::string paragraph(std::string_view text) {
  std::string line = escaped(text);
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line;
}

std::string list_of(const std::vector<std::string>& items) {
  std::vector<std::string> lines;
  lines.reserve(items.size());
  for (const std::string& item : items) lines.push_back(escaped(item));
  return markdown_notes(lines);
}

// A fence longer than any that the text holds.
std::string code_block(const std::string& text) {
  std::string fence = "```";
  while (text.find(fence) != std::string::npos) fence += '`';
  return fence + "\n" + text + "\n" + fence + "\n";
}

std::string folded(std::string_view title, const std::string& content) {
  return fmt::format("\n<details><summary>{}</summary>\n\n{}\n</details>\n", title, content);
}

TextGrid verdicts_of(const GateResult& result) {
  TextGrid grid;
  grid.columns = {{"Verdict", true}, {"Cell", true}, {"Efficiency", false}, {"Why", true}};
  const auto add = [&](std::string_view name, const auto& judged) {
    grid.lines.push_back(
        {fmt::format("**{}**", to_string(judged.verdict)), escaped(name),
         effect_text(judged.efficiency),
         escaped(fmt::format("{}: {}", to_string(judged.reason), judged.sentence))});
  };
  add(kSuiteName, result.suite);
  for (const GateCell* cell : worst_first(result)) add(cell->name, *cell);
  return grid;
}

TextGrid numbers_of(const GateResult& result) {
  TextGrid grid;
  grid.columns = {{"Cell", true},         {"Blocks", false},
                  {"Currency", true},     {"Efficiency", false},
                  {"In CPU time", false}, {"Error", false},
                  {"Rays", false},        {"Instructions", false},
                  {"CPU time", false},    {"Smallest loss", false},
                  {"P_eff", false},       {"Images", true},
                  {"Bias", true},         {"Counters that moved", true}};
  for (const GateCell* cell : worst_first(result)) {
    grid.lines.push_back(
        {escaped(cell->name), std::to_string(cell->blocks),
         cell->efficiency ? escaped(to_string(cell->currency)) : "-",
         cell->no_efficiency.empty() ? effect_text(cell->efficiency) : escaped(cell->no_efficiency),
         effect_text(cell->efficiency_cpu), ratio_change_text(cell->error_ratio),
         ratio_change_text(cell->rays_ratio), ratio_change_text(cell->instructions_ratio),
         ratio_change_text(cell->cpu_ratio),
         cell->detectable ? fmt::format("{:.2f} %", 100 * *cell->detectable) : "-",
         number_text(cell->p_eff),
         cell->blocks == 0        ? "-"
         : cell->same_images      ? "same"
         : cell->same_half_images ? "same in half precision"
                                  : "changed",
         escaped(bias_text(cell->bias)), escaped(counters_text(*cell))});
  }
  return grid;
}

TextGrid sides_of(const GateResult& result) {
  TextGrid grid;
  grid.columns = {{"Side", true},     {"What", true},  {"Commit", true},
                  {"Compiler", true}, {"Flags", true}, {"Machine", true}};
  const auto add = [&](const char* side, const GateProvenance& provenance) {
    const auto build = nlohmann::json::parse(provenance.build, nullptr, false);
    const auto text_of = [&](const char* key) {
      const bool has = build.is_object() && build.contains(key) && build[key].is_string();
      return has ? escaped(build[key].get<std::string>()) : "-";
    };
    grid.lines.push_back({side, escaped(provenance.what), text_of("commit"), text_of("compiler"),
                          text_of("flags"), escaped(provenance.machine)});
  };
  add("base", result.base);
  add("head", result.head);
  return grid;
}

std::string how_text(const GateResult& result) {
  return fmt::format(
      "{} blocks, {} runs in {}, {}; failing at a confidence of {:g} over all looks.",
      result.blocks, result.runs, seconds_text(result.wall_s),
      result.interleaved ? "both sides in turns" : "against stored values", result.confidence);
}

}  // namespace

std::string gate_markdown(const GateResult& result) {
  std::string text =
      fmt::format("## Regression gate {}: {}\n\n**{}**: {}\n\n", paragraph(result.config_name),
                  to_string(result.verdict), to_string(result.verdict), paragraph(result.sentence));
  text += markdown_grid(verdicts_of(result));
  text += fmt::format(
      "\nEfficiency is 1 / (cost x {}), its change is of head against base with a 95 % interval. "
      "{}\n",
      escaped(result.metric), how_text(result));
  if (const auto steps = next_steps(result); !steps.empty()) {
    text += "\n**What to do**\n\n" + list_of(steps);
  }
  if (result.null_control) {
    text += "\n**Null control.** " + paragraph(null_control_text(*result.null_control)) + "\n";
  }
  if (!result.notes.empty()) text += "\n**Notes**\n\n" + list_of(result.notes);
  text += folded("Numbers of every cell", markdown_grid(numbers_of(result)));
  text += folded("Both sides", markdown_grid(sides_of(result)));
  text += folded("How to repeat it", code_block(readable(repeat_command(result))));
  return text;
}

}  // namespace penumbra
