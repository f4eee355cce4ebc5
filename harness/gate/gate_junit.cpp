#include "harness/gate/gate_junit.h"

#include <fmt/format.h>

#include <pugixml.hpp>
#include <sstream>

#include "harness/gate/gate_words.h"

namespace penumbra {
namespace {

// XML 1.0 has no control characters but tab and line ends, not even as references; nor has it
// U+FFFE and U+FFFF.
std::string xml_text(std::string_view text) {
  constexpr std::string_view kReplacement = "\xEF\xBF\xBD";
  std::string clean = readable(text);
  for (const std::string_view noncharacter : {"\xEF\xBF\xBE", "\xEF\xBF\xBF"}) {
    for (std::size_t i = 0; (i = clean.find(noncharacter, i)) != std::string::npos;) {
      clean.replace(i, noncharacter.size(), kReplacement);
    }
  }
  std::string result;
  for (const char c : clean) {
    const bool allowed = static_cast<unsigned char>(c) >= 0x20 || c == '\t' || c == '\n';
    result += allowed ? std::string_view(&c, 1) : kReplacement;
  }
  return result;
}

void set(pugi::xml_node node, const char* name, std::string_view value) {
  node.append_attribute(name).set_value(xml_text(value).c_str());
}

struct Counts {
  int tests{0};
  int failures{0};
  int errors{0};
  int skipped{0};
};

void set_counts(pugi::xml_node node, const Counts& counts, double wall_s) {
  set(node, "tests", std::to_string(counts.tests));
  set(node, "failures", std::to_string(counts.failures));
  set(node, "errors", std::to_string(counts.errors));
  set(node, "skipped", std::to_string(counts.skipped));
  set(node, "time", fmt::format("{:.3f}", wall_s));
}

/// The tests of a suite as they are added.
class Tests {
 public:
  Tests(pugi::xml_node suite, const GateResult& result)
      : suite_(suite), class_name_("gate." + result.config_name) {}

  const Counts& counts() const { return counts_; }

  /// @param details  what stands under the sentence
  void add(std::string_view name, GateVerdict verdict, GateReason reason,
           const std::string& sentence, const std::string& details) {
    pugi::xml_node test = add_test(name);
    if (verdict == GateVerdict::Inconclusive) {
      skip(test, fmt::format("{}: {}", to_string(reason), sentence));
      return;
    }
    if (verdict == GateVerdict::Pass) {
      test.append_child("system-out").text().set(xml_text(sentence + "\n" + details).c_str());
      return;
    }
    const bool broken = reason == GateReason::Failed;
    ++(broken ? counts_.errors : counts_.failures);
    pugi::xml_node fault = test.append_child(broken ? "error" : "failure");
    set(fault, "type", to_string(reason));
    set(fault, "message", sentence);
    fault.text().set(xml_text(details).c_str());
  }

  void add(const NullControl& control) {
    pugi::xml_node test = add_test("null control");
    const std::string sentence = null_control_text(control);
    if (control.rejected) {
      skip(test, sentence);
    } else {
      test.append_child("system-out").text().set(xml_text(sentence).c_str());
    }
  }

 private:
  pugi::xml_node add_test(std::string_view name) {
    ++counts_.tests;
    pugi::xml_node test = suite_.append_child("testcase");
    set(test, "classname", class_name_);
    set(test, "name", name);
    return test;
  }

  void skip(pugi::xml_node test, const std::string& message) {
    ++counts_.skipped;
    set(test.append_child("skipped"), "message", message);
  }

  pugi::xml_node suite_;
  std::string class_name_;
  Counts counts_;
};

std::string details_of(const GateCell& cell) {
  std::string text = fmt::format("blocks: {}\nefficiency in {}: {}\nefficiency in cpu_time: {}\n",
                                 cell.blocks, to_string(cell.currency),
                                 effect_text(cell.efficiency), effect_text(cell.efficiency_cpu));
  text += fmt::format("error: {}\nrays: {}\ninstructions: {}\nCPU time: {}\nbias: {}\n",
                      ratio_change_text(cell.error_ratio), ratio_change_text(cell.rays_ratio),
                      ratio_change_text(cell.instructions_ratio), ratio_change_text(cell.cpu_ratio),
                      bias_text(cell.bias));
  if (!cell.counters.empty()) text += "counters: " + counters_text(cell) + "\n";
  return text;
}

std::string details_of(const GateSuite& suite) {
  return fmt::format("cells: {}\nblocks: {}\nefficiency in {}: {}\n", suite.cells, suite.blocks,
                     to_string(suite.currency), effect_text(suite.efficiency));
}

void add_properties(pugi::xml_node suite, const GateResult& result) {
  pugi::xml_node properties = suite.append_child("properties");
  const auto add = [&](const char* name, std::string_view value) {
    pugi::xml_node property = properties.append_child("property");
    set(property, "name", name);
    set(property, "value", value);
  };
  add("verdict", to_string(result.verdict));
  add("sentence", result.sentence);
  add("exit_code", std::to_string(result.exit_code));
  add("base", result.base.what);
  add("base_build", result.base.build);
  add("head", result.head.what);
  add("head_build", result.head.build);
  add("machine", result.head.machine);
  for (const std::string& note : result.notes) add("note", note);
}

}  // namespace

std::string gate_junit(const GateResult& result) {
  pugi::xml_document document;
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  set(declaration, "version", "1.0");
  set(declaration, "encoding", "UTF-8");
  pugi::xml_node root = document.append_child("testsuites");
  pugi::xml_node suite = root.append_child("testsuite");
  set(root, "name", "penumbra gate");
  set(suite, "name", "gate." + result.config_name);
  add_properties(suite, result);

  Tests tests(suite, result);
  tests.add(kSuiteName, result.suite.verdict, result.suite.reason, result.suite.sentence,
            details_of(result.suite));
  for (const GateCell& cell : result.cells) {
    tests.add(cell.name, cell.verdict, cell.reason, cell.sentence, details_of(cell));
  }
  if (result.null_control) tests.add(*result.null_control);

  set_counts(root, tests.counts(), result.wall_s);
  set_counts(suite, tests.counts(), result.wall_s);
  std::ostringstream stream;
  document.save(stream, "  ", pugi::format_indent, pugi::encoding_utf8);
  return stream.str();
}

}  // namespace penumbra
