#include "harness/gate/gate_junit.h"

#include <gtest/gtest.h>

#include <pugixml.hpp>

#include "tests/unit/gate_fixture.h"

namespace penumbra {
namespace {

pugi::xml_document parsed(const GateResult& result) {
  pugi::xml_document document;
  const std::string text = gate_junit(result);
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  EXPECT_TRUE(parsed) << parsed.description() << " at " << parsed.offset << " of\n" << text;
  return document;
}

pugi::xml_node test_of(const pugi::xml_document& document, const std::string& name) {
  return document.child("testsuites")
      .child("testsuite")
      .find_child_by_attribute("testcase", "name", name.c_str());
}

int number_of(pugi::xml_node node, const char* name) { return node.attribute(name).as_int(-1); }

TEST(GateJunit, HasATestForTheSuiteForEveryCellAndForTheNullControl) {
  const auto document = parsed(passing_result());
  std::vector<std::string> names;
  const pugi::xml_node suite = document.child("testsuites").child("testsuite");
  for (const pugi::xml_node test : suite.children("testcase")) {
    names.emplace_back(test.attribute("name").value());
    EXPECT_STREQ(test.attribute("classname").value(), "gate.quick gate");
  }
  const std::vector<std::string> expected = {"all cells", "s/A/sobol", "s/B/sobol", "null control"};
  EXPECT_EQ(names, expected);
  for (const pugi::xml_node node : {document.child("testsuites"), suite}) {
    EXPECT_EQ(number_of(node, "tests"), 4);
    EXPECT_EQ(number_of(node, "failures"), 0);
    EXPECT_EQ(number_of(node, "errors"), 0);
    EXPECT_EQ(number_of(node, "skipped"), 0);
    EXPECT_STREQ(node.attribute("time").value(), "61.500");
  }
}

TEST(GateJunit, APassStatesItsSentence) {
  const auto document = parsed(passing_result());
  const std::string out = test_of(document, "s/B/sobol").child("system-out").text().get();
  EXPECT_EQ(out.rfind("sentence of s/B/sobol\n", 0), 0U) << out;
}

TEST(GateJunit, EveryLossIsAFailureWithItsReasonAsType) {
  for (const GateReason reason : kFailingReasons) {
    if (reason == GateReason::Failed) continue;
    const auto document = parsed(failing_result(reason));
    const pugi::xml_node failure = test_of(document, "s/B/sobol").child("failure");
    EXPECT_EQ(failure.attribute("type").value(), to_string(reason));
    EXPECT_STREQ(failure.attribute("message").value(), "sentence of s/B/sobol");
    const std::string details = failure.text().get();
    EXPECT_NE(details.find("counters: rays 1000 -> 1200 (+20.0 %)"), std::string::npos);
  }
}

TEST(GateJunit, AFailedRunIsAnError) {
  const auto document = parsed(failing_result(GateReason::Failed));
  const pugi::xml_node test = test_of(document, "s/B/sobol");
  EXPECT_FALSE(test.child("failure"));
  EXPECT_STREQ(test.child("error").attribute("type").value(), "failed");
  EXPECT_STREQ(test.child("error").attribute("message").value(), "block 3: ended by signal 11");
  const pugi::xml_node suite = document.child("testsuites").child("testsuite");
  EXPECT_EQ(number_of(suite, "errors"), 1);
}

TEST(GateJunit, InconclusiveIsSkippedWithItsSentence) {
  const auto document = parsed(inconclusive_result());
  const pugi::xml_node test = test_of(document, "s/B/sobol");
  EXPECT_FALSE(test.child("failure"));
  EXPECT_STREQ(test.child("skipped").attribute("message").value(),
               "too_noisy: sentence of s/B/sobol");
}

TEST(GateJunit, CountsAreThoseOfItsTests) {
  const GateResult result = gate_result(
      {crashed_cell("a"), crashed_cell("b"),
       gate_cell("c", 0.9, GateVerdict::Fail, GateReason::Slower),
       gate_cell("d", 1, GateVerdict::Inconclusive, GateReason::TooNoisy), unchanged_cell("e")},
      GateVerdict::Fail, 4);
  const auto document = parsed(result);
  const pugi::xml_node suite = document.child("testsuites").child("testsuite");
  int tests = 0, failures = 0, errors = 0, skipped = 0;
  for (const pugi::xml_node test : suite.children("testcase")) {
    ++tests;
    failures += test.child("failure") ? 1 : 0;
    errors += test.child("error") ? 1 : 0;
    skipped += test.child("skipped") ? 1 : 0;
  }
  EXPECT_EQ(number_of(suite, "tests"), tests);
  EXPECT_EQ(number_of(suite, "failures"), failures);
  EXPECT_EQ(number_of(suite, "errors"), errors);
  EXPECT_EQ(number_of(suite, "skipped"), skipped);
  EXPECT_EQ(errors, 2);
  EXPECT_EQ(failures, 2);  // the suite has the gate's verdict here
  EXPECT_EQ(skipped, 1);
}

TEST(GateJunit, ARejectedNullControlIsSkippedAndAMissingOneIsNoTest) {
  GateResult result = passing_result();
  result.null_control->rejected = true;
  const auto rejected = parsed(result);
  const std::string message =
      test_of(rejected, "null control").child("skipped").attribute("message").value();
  EXPECT_NE(message.find("REJECTED"), std::string::npos);
  EXPECT_FALSE(test_of(parsed(stored_result()), "null control"));
}

TEST(GateJunit, AwkwardTextComesBackAsItWas) {
  GateResult result = failing_result(GateReason::Noisier);
  result.cells[1].name = kAwkwardName;
  result.cells[1].sentence = kAwkwardName + "\n]]> second line";
  result.notes = {kAwkwardName};
  const auto document = parsed(result);
  const pugi::xml_node test = test_of(document, kAwkwardName);
  ASSERT_TRUE(test);
  EXPECT_EQ(test.child("failure").attribute("message").value(), result.cells[1].sentence);
  const pugi::xml_node note = document.child("testsuites")
                                  .child("testsuite")
                                  .child("properties")
                                  .find_child_by_attribute("property", "name", "note");
  EXPECT_EQ(note.attribute("value").value(), kAwkwardName);
}

TEST(GateJunit, HoldsOnlyCharactersThatXmlHas) {
  GateResult result = failing_result(GateReason::Failed);
  result.cells[1].name = std::string("nul\0bell\aescape\x1B", 16) + "\xFF\xEF\xBF\xBF\xEF\xBF\xBE";
  const std::string text = gate_junit(result);
  for (const char c : text) {
    EXPECT_TRUE(static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') << int{c};
  }
  EXPECT_EQ(text.find("&#0"), std::string::npos);
  EXPECT_EQ(text.find("&#x1"), std::string::npos);
  const std::string r = "\xEF\xBF\xBD";
  EXPECT_TRUE(test_of(parsed(result), "nul" + r + "bell" + r + "escape" + r + r + r + r));
}

}  // namespace
}  // namespace penumbra
