#include "harness/gate/gate_json.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "harness/project_root.h"
#include "scenes/core/json_schema.h"
#include "tests/unit/gate_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string schema_text() {
  std::ifstream stream(project_root() / "configs" / "gate_report.schema.json");
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// What the schema finds in a document.
std::string faults_of(const std::string& text) {
  static const JsonSchema kSchema(schema_text());
  DiagnosticList faults;
  kSchema.validate(LocatedJson::parse_text(text, "gate.json"), faults);
  return faults.text();
}

std::string faults_of(const GateResult& result) { return faults_of(gate_json(result).dump(2)); }

json parsed(const GateResult& result) { return json::parse(gate_json(result).dump()); }

TEST(GateJson, PassObeysTheSchema) { EXPECT_EQ(faults_of(passing_result()), ""); }

TEST(GateJson, EveryReasonOfFailingObeysTheSchema) {
  for (const GateReason reason : kFailingReasons) {
    EXPECT_EQ(faults_of(failing_result(reason)), "") << to_string(reason);
  }
}

TEST(GateJson, EveryOtherReasonObeysTheSchema) {
  for (const GateReason reason :
       {GateReason::Unchanged, GateReason::WithinLimits, GateReason::Improved,
        GateReason::Acknowledged, GateReason::TooNoisy, GateReason::NotRepeated}) {
    GateResult result = passing_result();
    result.cells[0].reason = reason;
    EXPECT_EQ(faults_of(result), "") << to_string(reason);
  }
}

TEST(GateJson, InconclusiveObeysTheSchema) { EXPECT_EQ(faults_of(inconclusive_result()), ""); }

TEST(GateJson, StoredBaselineWithoutTimesObeysTheSchema) {
  EXPECT_EQ(faults_of(stored_result()), "");
  const json document = parsed(stored_result());
  EXPECT_FALSE(document.contains("null_control"));
  EXPECT_FALSE(document["base"].contains("build"));
  EXPECT_FALSE(document["cells"][0].contains("efficiency_cpu_time"));
  EXPECT_FALSE(document["cells"][0].contains("cpu_time_ratio"));
}

TEST(GateJson, EmptyResultObeysTheSchema) {
  GateResult result;
  result.metric = "mse";
  EXPECT_EQ(faults_of(result), "");
}

TEST(GateJson, StatesAnEffectAsLogarithmRatioAndPercent) {
  GateResult result = passing_result();
  result.cells[1].efficiency = effect_of(0.9, 0.01);
  const json effect = parsed(result)["cells"][1]["efficiency"];
  EXPECT_DOUBLE_EQ(effect["log_ratio"].get<double>(), std::log(0.9));
  EXPECT_NEAR(effect["ratio"].get<double>(), 0.9, 1e-15);
  EXPECT_NEAR(effect["change_percent"].get<double>(), -10.0, 1e-13);
  EXPECT_NEAR(effect["ratio_lo"].get<double>(), 0.9 * std::exp(-0.02), 1e-15);
  EXPECT_NEAR(effect["ratio_hi"].get<double>(), 0.9 * std::exp(0.02), 1e-15);
  EXPECT_NEAR(effect["ratio_lower_bound"].get<double>(), 0.9 * std::exp(-0.03), 1e-15);
  EXPECT_NEAR(effect["ratio_upper_bound"].get<double>(), 0.9 * std::exp(0.03), 1e-15);
  EXPECT_DOUBLE_EQ(effect["standard_error"].get<double>(), 0.01);
  EXPECT_DOUBLE_EQ(effect["p_loss"].get<double>(), 0.001);
}

TEST(GateJson, SaysOfEveryCellWhatWasFound) {
  const json cell = parsed(failing_result(GateReason::MoreRays))["cells"][1];
  EXPECT_EQ(cell["name"], "s/B/sobol");
  EXPECT_EQ(cell["verdict"], "FAIL");
  EXPECT_EQ(cell["reason"], "more_rays");
  EXPECT_EQ(cell["sentence"], "sentence of s/B/sobol");
  EXPECT_EQ(cell["blocks"], 16);
  EXPECT_EQ(cell["confirmed"], true);
  EXPECT_EQ(cell["currency"], "instructions");
  EXPECT_DOUBLE_EQ(cell["detectable_loss_percent"].get<double>(), 3.1);
  const json counters = json::parse(R"([{"name": "rays", "base": 1000.0, "head": 1200.0,
                                        "ratio": 1.2}])");
  EXPECT_EQ(cell["counters_moved"], counters);
  EXPECT_DOUBLE_EQ(cell["bias"]["p_over_cells"].get<double>(), 0.8);
  EXPECT_DOUBLE_EQ(cell["bias"]["relative_hi"].get<double>(), 0.004);
}

TEST(GateJson, SaysWhyThereWasNoTestOfBias) {
  const json cells = parsed(failing_result(GateReason::Failed))["cells"];
  EXPECT_EQ(cells[0]["bias"]["tested"], false);
  EXPECT_EQ(cells[0]["bias"]["skipped"], "the images are those of base");
  EXPECT_EQ(cells[1]["bias"]["skipped"], "no blocks");
}

TEST(GateJson, ACellWithoutEfficiencyHasNoCurrency) {
  const json cells = parsed(failing_result(GateReason::Failed))["cells"];
  EXPECT_EQ(cells[0]["currency"], "instructions");
  EXPECT_FALSE(cells[1].contains("efficiency"));
  EXPECT_FALSE(cells[1].contains("currency"));
}

TEST(GateJson, HoldsBuildsAsObjects) {
  const json document = parsed(passing_result());
  EXPECT_EQ(document["base"]["build"]["commit"], "aaa");
  EXPECT_EQ(document["head"]["build"]["commit"], "bbb");
}

TEST(GateJson, KeepsABuildThatIsNoObjectAsText) {
  for (const std::string build : {"not JSON", "[1]", "{\"commit\": \"\xFF\"}"}) {
    GateResult result = passing_result();
    result.base.build = build;
    EXPECT_EQ(faults_of(result), "") << build;
    EXPECT_FALSE(parsed(result)["base"].contains("build")) << build;
    EXPECT_TRUE(parsed(result)["base"].contains("build_text")) << build;
  }
}

TEST(GateJson, NamesNumbersThatAreNotFinite) {
  GateResult result = passing_result();
  result.cells[0].error_ratio = kNan;
  result.cells[0].rays_ratio = kInf;
  result.cells[0].efficiency->log_ratio = -kInf;
  result.cells[0].efficiency->p_loss = kNan;
  result.cells[0].counters = {{"lit", 0, 12}};
  result.wall_s = kNan;
  EXPECT_EQ(faults_of(result), "");
  const json cell = parsed(result)["cells"][0];
  EXPECT_EQ(cell["error_ratio"], "nan");
  EXPECT_EQ(cell["rays_ratio"], "inf");
  EXPECT_EQ(cell["efficiency"]["log_ratio"], "-inf");
  EXPECT_EQ(cell["efficiency"]["ratio"], 0.0);
  EXPECT_EQ(cell["efficiency"]["p_loss"], "nan");
  EXPECT_EQ(cell["counters_moved"][0]["ratio"], "inf");
}

TEST(GateJson, HoldsNoNullWhateverIsMissing) {
  GateResult broken = stored_result();
  broken.cells.push_back(crashed_cell("s/C/sobol"));
  broken.cells[0].efficiency->standard_error = kNan;
  broken.suite.efficiency.reset();
  for (const GateResult& result : {passing_result(), broken, GateResult{}}) {
    EXPECT_EQ(gate_json(result).dump().find("null,"), std::string::npos);
    EXPECT_EQ(gate_json(result).dump().find("null}"), std::string::npos);
    EXPECT_EQ(gate_json(result).dump().find("null]"), std::string::npos);
  }
}

TEST(GateJson, ReplacesBytesThatAreNotUtf8) {
  GateResult result = passing_result();
  result.base.what = "build/\xFF/penumbra";
  result.cells[0].name = kAwkwardName;
  const json document = parsed(result);
  EXPECT_EQ(document["base"]["what"], "build/\xEF\xBF\xBD/penumbra");
  EXPECT_EQ(document["cells"][0]["name"], kAwkwardName);
}

/// The faults of a document after a change of it.
template <class Change>
std::string faults_after(Change change) {
  json document = parsed(passing_result());
  change(document);
  return faults_of(document.dump());
}

TEST(GateJson, SchemaRefusesUnknownKeysEverywhere) {
  for (const char* place :
       {"", "/config", "/suite", "/suite/efficiency", "/cells/1", "/cells/1/efficiency",
        "/cells/0/bias", "/cells/1/bias", "/cells/1/counters_moved/0", "/null_control", "/base"}) {
    const std::string faults =
        faults_after([&](json& document) { document[json::json_pointer(place)]["other"] = 1; });
    EXPECT_NE(faults.find("other"), std::string::npos) << place << ": " << faults;
  }
}

TEST(GateJson, SchemaRefusesMissingKeys) {
  for (const char* key : {"schema", "version", "verdict", "exit_code", "sentence", "cells", "suite",
                          "base", "head", "looks", "confidence", "metric"}) {
    const std::string faults = faults_after([&](json& document) { document.erase(key); });
    EXPECT_NE(faults.find(key), std::string::npos) << key << ": " << faults;
  }
}

TEST(GateJson, SchemaRefusesWrongValues) {
  const auto set = [](const char* place, const json& value) {
    return faults_after([&](json& document) { document[json::json_pointer(place)] = value; });
  };
  EXPECT_NE(set("/version", 2), "");
  EXPECT_NE(set("/schema", "penumbra"), "");
  EXPECT_NE(set("/verdict", "pass"), "");
  EXPECT_NE(set("/cells/0/reason", "worse"), "");
  EXPECT_NE(set("/exit_code", 2), "");
  EXPECT_NE(set("/cells/1/error_ratio", nullptr), "");
  EXPECT_NE(set("/cells/1/error_ratio", "1.2"), "");
  EXPECT_NE(set("/cells/1/efficiency/p_loss", 1.5), "");
  EXPECT_NE(set("/cells/1/blocks", -1), "");
  EXPECT_NE(set("/cells/1/bias/tested", false), "");
  EXPECT_NE(set("/suite/currency", "joules"), "");
  EXPECT_NE(set("/base/build", "text"), "");
  EXPECT_NE(faults_after([](json& document) { document["cells"][1].erase("currency"); }), "");
}

}  // namespace
}  // namespace penumbra
