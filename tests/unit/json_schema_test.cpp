#include "scenes/core/json_schema.h"

#include <gtest/gtest.h>

#include <string>

namespace penumbra {
namespace {

constexpr std::string_view kSchema = R"({
  "type": "object", "additionalProperties": false, "required": ["kind"],
  "properties": {
    "kind": {"enum": ["one", "two", "three"]},
    "n": {"type": "integer", "minimum": 1, "maximum": 8},
    "open": {"type": "number", "exclusiveMinimum": 0},
    "even": {"type": "integer", "multipleOf": 2},
    "text": {"type": "string", "minLength": 1, "pattern": "^[a-z]*$", "description": "small letters"},
    "pair": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2},
    "set": {"type": "array", "items": {"type": "string"}, "uniqueItems": true, "minItems": 1},
    "color": {"anyOf": [{"$ref": "#/definitions/unit"},
                        {"type": "array", "items": {"$ref": "#/definitions/unit"}, "maxItems": 3}]},
    "shapes": {"type": "array", "items": {"oneOf": [{"$ref": "#/definitions/ball"},
                                                    {"$ref": "#/definitions/box"}]}},
    "table": {"type": "object", "additionalProperties": {"type": "boolean"}},
    "tuple": {"not": {"type": "null"}}
  },
  "definitions": {
    "unit": {"type": "number", "minimum": 0, "maximum": 1},
    "ball": {"type": "object", "additionalProperties": false, "required": ["type", "radius"],
             "properties": {"type": {"const": "ball"}, "radius": {"type": "number"}}},
    "box": {"type": "object", "additionalProperties": false, "required": ["type", "size"],
            "properties": {"type": {"const": "box"}, "size": {"type": "number"}}}
  }
})";

/// The messages for a document, without the file's name.
std::string faults_of(std::string_view text) {
  static const JsonSchema schema(kSchema);
  DiagnosticList faults;
  schema.validate(LocatedJson::parse_text(text, "f"), faults);
  return faults.text();
}

TEST(JsonSchema, AcceptsAValidDocument) {
  EXPECT_EQ(
      faults_of(R"({"kind": "one", "n": 8, "pair": [1, 2.5], "color": [0, 1], "table": {"x": true},
                          "shapes": [{"type": "box", "size": 1}]})"),
      "");
}

TEST(JsonSchema, PointsAtAnUnknownKeyAndSuggests) {
  EXPECT_EQ(faults_of("{\"kind\": \"one\",\n \"tetx\": 1}"),
            "f:2:2: error: /tetx: unknown key \"tetx\"; did you mean \"text\"? (allowed: color, "
            "even, kind, n, "
            "open, pair, set, shapes, table, text, tuple)");
}

TEST(JsonSchema, ReportsEveryUnknownKey) {
  const std::string text = faults_of(R"({"kind": "one", "zzzzz": 1, "yyyyy": 1})");
  EXPECT_NE(text.find("\"zzzzz\""), std::string::npos);
  EXPECT_NE(text.find("\"yyyyy\""), std::string::npos);
}

TEST(JsonSchema, NamesAMissingKeyAtItsObject) {
  EXPECT_EQ(faults_of("{}"), "f:1:1: error: missing key \"kind\"");
}

TEST(JsonSchema, SaysWhichTypeIsExpectedAndWhatWasFound) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "n": "abc"})"),
            "f:1:22: error: /n: expected integer, found string \"abc\"");
}

TEST(JsonSchema, DoesNotTakeAFractionForAnInteger) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "n": 1.5})"),
            "f:1:22: error: /n: expected integer, found number 1.5");
}

TEST(JsonSchema, ListsEnumValuesAndSuggests) {
  EXPECT_EQ(faults_of(R"({"kind": "tow"})"),
            "f:1:10: error: /kind: unknown value \"tow\"; did you mean \"two\"? (allowed: one, "
            "two, three)");
}

TEST(JsonSchema, StatesTheRangeOfANumber) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "n": 9})"),
            "f:1:22: error: /n: expected an integer in [1, 8], found 9");
}

TEST(JsonSchema, StatesAnOpenBound) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "open": 0})"),
            "f:1:25: error: /open: expected a number greater than 0, found 0");
}

TEST(JsonSchema, StatesTheDivisor) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "even": 3})"),
            "f:1:25: error: /even: expected a multiple of 2, found 3");
}

TEST(JsonSchema, DividesNumbersThatNoIntegerHolds) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "even": 1e30})"),
            "f:1:25: error: /even: expected integer, found number 1e+30");
}

TEST(JsonSchema, StatesTheNumberOfItems) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "pair": [1]})"),
            "f:1:25: error: /pair: expected 2 items, found 1");
}

TEST(JsonSchema, RefusesRepeatedItems) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "set": ["a", "b", "a"]})"),
            "f:1:24: error: /set: a is listed twice");
}

TEST(JsonSchema, DescribesTheFormOfAText) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "text": "A"})"),
            "f:1:25: error: /text: expected small letters, found string \"A\"");
}

TEST(JsonSchema, LocatesAFaultInAnArray) {
  EXPECT_EQ(faults_of("{\"kind\": \"one\", \"pair\": [1,\n true]}"),
            "f:2:2: error: /pair/1: expected number, found true");
}

TEST(JsonSchema, ReportsTheFaultOfTheAlternativeOfTheSameType) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "color": [0, 2, 1]})"),
            "f:1:30: error: /color/1: expected a number in [0, 1], found 2");
}

TEST(JsonSchema, NamesTheTypesOfAlternativesWhenNoneFits) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "color": "red"})"),
            "f:1:26: error: /color: expected number or array, found string \"red\"");
}

TEST(JsonSchema, ReportsTheFaultOfTheAlternativeThatTypeNames) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "shapes": [{"type": "box", "size": "big"}]})"),
            "f:1:52: error: /shapes/0/size: expected number, found string \"big\"");
}

TEST(JsonSchema, ListsTheKeysOfTheAlternativeThatTypeNames) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "shapes": [{"type": "box", "size": 1, "radius": 2}]})"),
            "f:1:55: error: /shapes/0/radius: unknown key \"radius\" (allowed: size, type)");
}

TEST(JsonSchema, ListsTheTypesWhenNoAlternativeHasTheName) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "shapes": [{"type": "bal", "radius": 1}]})"),
            "f:1:37: error: /shapes/0/type: unknown type \"bal\"; did you mean \"ball\"? (allowed: "
            "ball, box)");
}

TEST(JsonSchema, ListsTheTypesWhenTheNameIsMissing) {
  EXPECT_EQ(faults_of(R"({"kind": "one", "shapes": [{"radius": 1}]})"),
            "f:1:28: error: /shapes/0: missing key \"type\" (allowed: ball, box)");
}

TEST(JsonSchema, ReportsFaultsOfSeveralLevelsWithoutTheirParents) {
  EXPECT_EQ(faults_of("{\"table\": {\"x\": 1},\n\"n\": 0,\n\"shapes\": [{\"type\": \"ball\"}]}"),
            "f:1:1: error: missing key \"kind\"\n"
            "f:1:17: error: /table/x: expected boolean, found number 1\n"
            "f:2:6: error: /n: expected an integer in [1, 8], found 0\n"
            "f:3:12: error: /shapes/0: missing key \"radius\"");
}

TEST(JsonSchema, NeverAcceptsWhatItCannotExplain) {
  EXPECT_NE(faults_of(R"({"kind": "one", "tuple": null})"), "");
}

TEST(JsonSchema, RefusesADocumentThatIsNoObject) {
  EXPECT_EQ(faults_of("[]"), "f:1:1: error: expected object, found array of 0 items");
}

}  // namespace
}  // namespace penumbra
