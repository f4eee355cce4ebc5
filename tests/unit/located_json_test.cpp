#include "scenes/core/located_json.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "scenes/core/error.h"
#include "scenes/core/suggest.h"

namespace penumbra {
namespace {

std::string error_of(std::string_view text) {
  try {
    LocatedJson::parse_text(text, "f.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

std::string value_place(const LocatedJson& json, std::string_view pointer) {
  return json.value_at(pointer).text();
}

TEST(LocatedJson, BuildsTheSameDocumentAsTheParserAlone) {
  const std::string text =
      R"({"a": [1, -2, 2.5e3, {"b": null}], "c/d": {"~": "\"x\\"}, "e": [[], {}, true]})";
  EXPECT_EQ(LocatedJson::parse_text(text, "f").root(), nlohmann::json::parse(text));
}

TEST(LocatedJson, LocatesEveryKeyAndValue) {
  const auto json =
      LocatedJson::parse_text("{\n  \"a\": [10,\n    20],\n  \"b\" : {\"c\":\"x\"}\n}", "f");
  EXPECT_EQ(value_place(json, ""), "f:1:1");
  EXPECT_EQ(json.key_at("/a").text(), "f:2:3");
  EXPECT_EQ(value_place(json, "/a"), "f:2:8");
  EXPECT_EQ(value_place(json, "/a/0"), "f:2:9");
  EXPECT_EQ(value_place(json, "/a/1"), "f:3:5");
  EXPECT_EQ(value_place(json, "/b"), "f:4:9");
  EXPECT_EQ(json.key_at("/b/c").text(), "f:4:10");
  EXPECT_EQ(value_place(json, "/b/c"), "f:4:14");
}

TEST(LocatedJson, LocatesValuesBehindCommentsAndEscapes) {
  const auto json = LocatedJson::parse_text(
      "\xEF\xBB\xBF// \"a\": 1\n{/* {[ */\"a\\\"\": \"\\\\\", // x\n\"b\":-1.5e-3/**/,\"c\":1}",
      "f");
  EXPECT_EQ(value_place(json, ""), "f:2:1");
  EXPECT_EQ(value_place(json, "/a\""), "f:2:17");
  EXPECT_EQ(value_place(json, "/b"), "f:3:5");
  EXPECT_EQ(value_place(json, "/c"), "f:3:21");
}

TEST(LocatedJson, LocatesKeysWithSlashAndTilde) {
  const auto json = LocatedJson::parse_text(R"({"a/b": {"~": 1}})", "f");
  EXPECT_EQ(value_place(json, child_pointer(child_pointer("", "a/b"), "~")), "f:1:15");
}

TEST(LocatedJson, LocatesAMissingValueAtItsNearestAncestor) {
  const auto json = LocatedJson::parse_text("{\"a\": {\"b\": 1}}", "f");
  EXPECT_EQ(value_place(json, "/a/x/y"), "f:1:7");
}

TEST(LocatedJson, ReportsASyntaxErrorAtTheTokenThatDoesNotFit) {
  EXPECT_EQ(error_of("{\n  \"a\": 1\n  \"b\": 2\n}").substr(0, 29),
            "f.json:3:3: error: not valid ");
}

TEST(LocatedJson, NamesATrailingComma) {
  EXPECT_EQ(error_of("{\n  \"a\": 1,\n}"), "f.json:2:9: error: trailing comma before '}'");
}

TEST(LocatedJson, RefusesBrokenTextsWithAPlace) {
  for (const char* text : {"", "{", "[1,", "\"abc", "nul", "[1e999]", "{\"a\"}", "[1] 2", "NaN",
                           "[\"\n\"]", "{\"a\":\"\xff\"}", "/* open", "[01]"}) {
    const std::string message = error_of(text);
    EXPECT_TRUE(message.starts_with("f.json:1:") || message.starts_with("f.json:2:"))
        << text << " -> " << message;
    EXPECT_EQ(message.find("json.exception"), std::string::npos) << message;
  }
}

TEST(LocatedJson, ReportsADuplicateKeyWithBothPlaces) {
  EXPECT_EQ(error_of("{\"a\": {\"k\": 1,\n  \"k\": 2}}"),
            "f.json:2:3: error: /a/k: key \"k\" is given twice; the first is at f.json:1:8");
}

TEST(LocatedJson, ReportsEveryDuplicateKey) {
  const std::string message = error_of("{\"a\": 1, \"a\": [1], \"a\": {\"b\": 1, \"b\": 2}}");
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 2) << message;
}

TEST(LocatedJson, RefusesBottomlessNesting) {
  EXPECT_NE(error_of(std::string(100000, '[')).find("nested deeper than 100 levels"),
            std::string::npos);
}

TEST(LocatedJson, NamesAFileThatCannotBeRead) {
  EXPECT_THROW(
      {
        try {
          LocatedJson::parse_file("/nonexistent/x.json");
        } catch (const InputError& error) {
          EXPECT_STREQ(error.what(),
                       "/nonexistent/x.json: error: cannot be read: No such file or directory");
          throw;
        }
      },
      InputError);
}

TEST(LocatedJson, RefusesAFolder) {
  EXPECT_THROW(LocatedJson::parse_file(std::filesystem::temp_directory_path()), InputError);
}

TEST(LocatedJson, OverriddenValuesNameTheirSource) {
  auto json = LocatedJson::parse_text("{\"a\": {\"b\": 1}, \"c\": 2}", "f");
  json.override_value("/a/n/m", 3, "--set a.n.m=3");
  EXPECT_EQ(json.root()["a"]["n"]["m"], 3);
  EXPECT_EQ(value_place(json, "/a/n"), "--set a.n.m=3");
  EXPECT_EQ(value_place(json, "/a/n/m"), "--set a.n.m=3");
  EXPECT_EQ(value_place(json, "/a/b"), "f:1:13");
}

TEST(LocatedJson, ALaterOverrideOfAParentTakesOverItsPlaces) {
  auto json = LocatedJson::parse_text("{}", "f");
  json.override_value("/a/b", 1, "first");
  json.override_value("/a", {{"b", 2}}, "second");
  EXPECT_EQ(value_place(json, "/a/b"), "second");
}

TEST(LocatedJson, LocatesTheLastOfManyElementsQuickly) {
  std::string text = "[0";
  for (int i = 1; i < 200000; ++i) text += ",\n" + std::to_string(i);
  const auto json = LocatedJson::parse_text(text + "]", "f");
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(value_place(json, "/199999"), "f:200000:1");
}

TEST(DiagnosticList, SortsByPlace) {
  DiagnosticList list;
  list.add({"f", 10, 1}, "/b", "second");
  list.add({"f", 9, 5}, "", "first");
  EXPECT_EQ(list.text(), "f:9:5: error: first\nf:10:1: error: /b: second");
}

TEST(DiagnosticList, CoversThePlaceAndWhatIsAboveIt) {
  DiagnosticList list;
  list.add({"f", 1, 1}, "/a/bc", "x");
  EXPECT_TRUE(list.covers("/a/bc"));
  EXPECT_TRUE(list.covers("/a"));
  EXPECT_FALSE(list.covers("/a/b"));
  EXPECT_FALSE(list.covers("/a/bc/d"));
}

TEST(DiagnosticList, CountsWhatItDoesNotShow) {
  DiagnosticList list;
  for (int i = 0; i < 105; ++i) list.add({"f", 1, 1}, "", "x");
  EXPECT_TRUE(list.text().ends_with("... and 5 more errors"));
}

TEST(Suggest, CountsASwapAsOneEdit) {
  EXPECT_EQ(edit_distance("blanace", "balance"), 2u);
  EXPECT_EQ(edit_distance("sobol", "soblo"), 1u);
  EXPECT_EQ(edit_distance("", "abc"), 3u);
}

TEST(Suggest, IgnoresCaseButPrefersItAmongEquals) {
  EXPECT_EQ(nearest_name("MIS", {"mia", "mis"}), "mis");
  EXPECT_EQ(nearest_name("Ab", {"ab", "Ab"}), "Ab");
}

TEST(Suggest, KeepsSilentWhenNothingIsNear) {
  EXPECT_EQ(did_you_mean("checkerboard", {"buddha", "yearright"}), "");
  EXPECT_EQ(did_you_mean("spp", {"srl"}), "");
}

TEST(Suggest, ListsWhatIsAllowed) {
  EXPECT_EQ(unknown_name("key", "sseed", {"seed", "spp"}),
            "unknown key \"sseed\"; did you mean \"seed\"? (allowed: seed, spp)");
}

}  // namespace
}  // namespace penumbra
