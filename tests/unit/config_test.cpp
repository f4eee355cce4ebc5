#include "harness/config.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "estimators/estimator.h"
#include "harness/project_root.h"
#include "scenes/core/error.h"
#include "tests/unit/config_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

class Config : public ConfigTest {};

TEST_F(Config, ReadsWhatIsGiven) {
  const ExperimentConfig config = load(small_config());
  EXPECT_EQ(config.name, "test");
  EXPECT_EQ(config.scenes[0].file, root_ / "scenes/checkerboard/scene.json");
  EXPECT_EQ(config.methods[1].srl, (std::vector<Srl>{{4, 12, true}}));
  EXPECT_EQ(config.methods[1].params.at("population"),
            (std::vector<ParamValue>{std::int64_t{8}, std::int64_t{16}}));
}

TEST_F(Config, FillsInDefaults) {
  const ExperimentConfig config = load(small_config());
  EXPECT_EQ(config.seed, 1u);
  EXPECT_EQ(config.tile, 16);
  EXPECT_EQ(config.quantity, Quantity::Radiance);
  EXPECT_EQ(config.samplers, std::vector<std::string>{"independent"});
  EXPECT_EQ(config.scenes[0].camera_samples, 4);
  EXPECT_EQ(config.scenes[0].reference.estimator, "mis");
  EXPECT_EQ(config.scenes[0].reference.type, ReferenceType::Auto);
  EXPECT_TRUE(config.images.runs);
  EXPECT_FALSE(config.budget.has_value());
}

TEST_F(Config, ResolvedConfigReadsBackToItself) {
  json given = small_config();
  given["budget"] = {{"time_cpu_s", 2}, {"solve_for", "srl"}};
  given["quantity"] = "irradiance";
  given["published_source"] = "Anyone 2014";
  given["methods"][1]["published"] = {{"checkerboard", 0.1}};
  given["images"] = {
      {"exposure", 0.1},
      {"crops", {{{"name", "a"}, {"scene", "checkerboard"}, {"rectangle", {0, 0, 8, 8}}}}}};
  const ExperimentConfig config = load(given);
  const ExperimentConfig again = load_config(write("configs/resolved.json", config.resolved_json));
  EXPECT_EQ(again.resolved_json, config.resolved_json);
  EXPECT_EQ(again.quantity, Quantity::Irradiance);
  EXPECT_EQ(again.published_source, "Anyone 2014");
  EXPECT_EQ(again.methods[1].published, (std::map<std::string, double>{{"checkerboard", 0.1}}));
}

TEST_F(Config, ResolvedConfigStatesDefaults) {
  const json resolved = json::parse(load(small_config()).resolved_json);
  EXPECT_EQ(resolved["blocks"], 5);
  EXPECT_EQ(resolved["methods"][0]["params"]["heuristic"], "balance");
  EXPECT_EQ(resolved["scenes"][0]["file"], "scenes/checkerboard/scene.json");
  EXPECT_EQ(resolved["images"]["exposure"], 0.0);
}

TEST_F(Config, TypeOfTheReferenceAndPicturesOfRunsReadBack) {
  json given = small_config();
  given["images"] = {{"runs", false}};
  for (const ReferenceType type :
       {ReferenceType::Auto, ReferenceType::Sampled, ReferenceType::ExactSum}) {
    given["scenes"][0]["reference"] = {{"type", to_string(type)}};
    const ExperimentConfig config = load(given);
    EXPECT_EQ(config.scenes[0].reference.type, type);
    EXPECT_FALSE(config.images.runs);
    const json resolved = json::parse(config.resolved_json);
    EXPECT_EQ(resolved["scenes"][0]["reference"]["type"], to_string(type));
    EXPECT_EQ(resolved["images"]["runs"], false);
  }
}

TEST_F(Config, RefusesAnUnknownTypeOfReference) {
  json given = small_config();
  given["scenes"][0]["reference"] = {{"type", "exact-sum"}};
  const std::string faults = faults_of(given);
  EXPECT_NE(faults.find("error: /scenes/0/reference/type: "), std::string::npos) << faults;
  EXPECT_NE(faults.find("exact_sum"), std::string::npos) << "lists what is allowed: " << faults;
}

TEST_F(Config, RefusesAnUnknownQuantity) {
  json given = small_config();
  given["quantity"] = "radiosity";
  EXPECT_NE(faults_of(given).find("error: /quantity: "), std::string::npos) << faults_of(given);
}

TEST_F(Config, PublishedFiguresAreOfScenesOfTheConfigAndPositive) {
  json given = small_config();
  given["methods"][1]["published"] = {{"checkerbord", 2.0}};
  expect_fault(given, "/methods/1/published/checkerbord",
               "unknown scene \"checkerbord\"; did you mean \"checkerboard\"?");
  given["methods"][1]["published"] = {{"small", 2.0}};
  expect_fault(given, "/methods/1/published/small", "unknown scene \"small\"");
  given["methods"][1]["published"] = {{"checkerboard", 0}};
  EXPECT_NE(faults_of(given).find("error: /methods/1/published/checkerboard: "), std::string::npos)
      << faults_of(given);
}

TEST_F(Config, ReportsFiveMistakesAtOnceWithTheirPlaces) {
  const std::string faults = faults_of_text(R"({
  "version": 1, "name": "test", "baseline": "MIS",
  "sede": 7,
  "spp": "eight",
  "blocks": 0,
  "scenes": [{"name": "checkerboard"}],
  "methods": [
    {"label": "MIS", "estimator": "miss", "srl": 16},
    {"label": "PMC-HI", "estimator": "pmc_hi", "srl": 16,
     "params": {"popluation": 8}}
  ]
})");
  const auto has = [&](const std::string& line) { return faults.find(line) != std::string::npos; };
  EXPECT_TRUE(has("c.json:3:3: error: /sede: unknown key \"sede\"; did you mean \"seed\"?"))
      << faults;
  EXPECT_TRUE(has("c.json:4:10: error: /spp: expected integer, found string \"eight\"")) << faults;
  EXPECT_TRUE(has("c.json:5:13: error: /blocks: expected an integer in [1, 10000], found 0"))
      << faults;
  EXPECT_TRUE(
      has("c.json:8:35: error: /methods/0/estimator: unknown estimator \"miss\"; did you mean "
          "\"mis\"?"))
      << faults;
  EXPECT_TRUE(
      has("c.json:10:17: error: /methods/1/params/popluation: unknown parameter \"popluation\"; "
          "did you mean \"population\"?"))
      << faults;
  EXPECT_EQ(std::count(faults.begin(), faults.end(), '\n'), 4) << faults;
}

TEST_F(Config, RefusesAnotherVersion) {
  json config = small_config();
  config["version"] = 2;
  expect_fault(config, "/version", "expected 1, found number 2");
}

TEST_F(Config, RefusesAValueThatAParameterDoesNotAllow) {
  json config = small_config();
  config["methods"][0]["params"] = {{"heuristic", {"balance", "power"}}};
  expect_fault(config, "/methods/0/params/heuristic/1",
               "unknown value \"power\"; did you mean \"power2\"?");
}

TEST_F(Config, RefusesASplitForAnEstimatorThatDoesNotAdapt) {
  json config = small_config();
  config["methods"][0]["srl"] = {"4-12", 8};
  expect_fault(config, "/methods/0/srl/0", "mis does not adapt");
}

TEST_F(Config, RefusesFewerShadowRaysThanTheEstimatorNeeds) {
  json config = small_config();
  config["methods"][1]["srl"] = 1;
  expect_fault(config, "/methods/1/srl", "pmc_hi needs at least 2 shadow rays per light, found 1");
}

TEST_F(Config, RefusesTheSameShadowRaysTwice) {
  json config = small_config();
  config["methods"][0]["srl"] = {16, "16"};
  expect_fault(config, "/methods/0/srl/1", "16 is listed twice");
}

TEST_F(Config, RefusesAMalformedSrl) {
  json config = small_config();
  config["methods"][1]["srl"] = "4:12";
  expect_fault(config, "/methods/1/srl", "expected shadow rays per light as a total \"16\"");
}

TEST_F(Config, RefusesTheSameLabelTwice) {
  json config = small_config();
  config["methods"][1]["label"] = "MIS";
  expect_fault(config, "/methods/1/label", "label \"MIS\" is used twice");
}

TEST_F(Config, RefusesALabelThatIsNoFileName) {
  json config = small_config();
  config["methods"][1]["label"] = "../x";
  expect_fault(config, "/methods/1/label", "expected a name of letters, digits");
}

TEST_F(Config, RefusesABaselineThatIsNoLabel) {
  json config = small_config();
  config["baseline"] = "mis";
  expect_fault(config, "/baseline",
               "unknown label \"mis\"; did you mean \"MIS\"? (allowed: MIS, PMC-HI)");
}

TEST_F(Config, RefusesATunedBaselineWithoutItsOwnSampler) {
  json config = small_config();
  config["tuned_baseline"] = "MIS";
  expect_fault(config, "/tuned_baseline", "method \"MIS\" must name one sampler");
}

TEST_F(Config, ListsTheScenesThatExist) {
  json config = small_config();
  config["scenes"][0]["name"] = "chekerboard";
  expect_fault(config, "/scenes/0/name",
               "unknown scene \"chekerboard\"; did you mean \"checkerboard\"? (allowed: "
               "checkerboard, small)");
}

TEST_F(Config, FindsASceneFileBesideTheConfig) {
  write("configs/own.json", "{}");
  json config = small_config();
  config["scenes"][0] = {{"name", "own"}, {"file", "own.json"}};
  EXPECT_EQ(load(config).scenes[0].file, root_ / "configs/own.json");
}

TEST_F(Config, NamesThePlacesWhereASceneFileIsNot) {
  json config = small_config();
  config["scenes"][0]["file"] = "nowhere.json";
  expect_fault(config, "/scenes/0/file", "scene file not found; looked for ");
}

TEST_F(Config, RefusesAReferenceByTheMethodUnderTest) {
  json config = small_config();
  config["scenes"][0]["reference"] = {{"estimator", "pmc_hi"}};
  expect_fault(
      config, "/scenes/0/reference/estimator",
      "pmc_hi may not make a reference: a method under test must not make its own reference");
}

TEST_F(Config, APresetSaysWhatTheMethodDoesNot) {
  json given = small_config();
  given["methods"][0] = {{"label", "MIS"},
                         {"estimator", "mis"},
                         {"preset", "tuned"},
                         {"params", {{"heuristic", "balance"}}}};
  const MethodConfig method = load(given).methods[0];
  EXPECT_EQ(method.samplers, std::vector<std::string>{"sobol"});
  using Values = std::vector<ParamValue>;
  EXPECT_EQ(method.params.at("light_sampling"), Values{std::string("solid_angle")});
  EXPECT_EQ(method.params.at("heuristic"), Values{std::string("balance")}) << "its own come first";
  given["methods"][0]["sampler"] = "stratified";
  EXPECT_EQ(load(given).methods[0].samplers, std::vector<std::string>{"stratified"});
}

TEST_F(Config, RefusesPresetsThatThereAreNot) {
  json given = small_config();
  given["methods"][0]["preset"] = "tunde";
  expect_fault(given, "/methods/0/preset",
               "unknown preset \"tunde\"; did you mean \"tuned\"? (allowed: paper, tuned)");
  given["methods"][0].erase("preset");
  given["methods"][1]["preset"] = "tuned";
  expect_fault(given, "/methods/1/preset", "pmc_hi has no presets");
}

TEST(Presets, HoldOnlyWhatTheirEstimatorsAndSamplersTake) {
  int count = 0;
  for (const EstimatorEntry* entry : all_estimators()) {
    for (const Preset& preset : presets_of(*entry)) {
      std::vector<ParamProblem> problems;
      resolve_params(entry->params(), preset.params, problems);
      EXPECT_TRUE(problems.empty()) << entry->name << ' ' << preset.name;
      EXPECT_TRUE(parse_sampler_kind(preset.sampler)) << entry->name << ' ' << preset.name;
      ++count;
    }
  }
  EXPECT_GE(count, 2);
}

TEST_F(Config, RefusesAReferenceWhosePixelsMayBeNegative) {
  json config = small_config();
  config["scenes"][0]["reference"] = {{"estimator", "optimal_mis"}};
  expect_fault(config, "/scenes/0/reference/estimator",
               "optimal_mis may not make a reference: its pixels may be negative");
}

TEST_F(Config, RefusesAnOddNumberOfReferenceSamples) {
  json config = small_config();
  config["scenes"][0]["reference"] = {{"spp", 65}};
  expect_fault(config, "/scenes/0/reference/spp", "expected a multiple of 2, found 65");
}

TEST_F(Config, RefusesAReferenceHalfThatMissesShadingPoints) {
  json config = small_config();
  config["scenes"][0]["reference"] = {{"spp", 6}};
  expect_fault(config, "/scenes/0/reference/spp", "each half of the reference needs an estimate");
}

TEST_F(Config, ChecksTheParametersOfAReference) {
  json config = small_config();
  config["scenes"][0]["reference"] = {{"params", {{"layout", "pear"}}}};
  expect_fault(config, "/scenes/0/reference/params/layout", "unknown value \"pear\"");
}

TEST_F(Config, RefusesATileThatIsNoMultipleOfEight) {
  json config = small_config();
  config["tile"] = 12;
  expect_fault(config, "/tile", "expected a multiple of 8, found 12");
}

TEST_F(Config, RefusesFewerEstimatesThanShadingPoints) {
  json config = small_config();
  config["spp"] = 2;
  expect_fault(config, "/spp", "every shading point needs an estimate");
}

TEST_F(Config, DoesNotLookAtSppThatTheBudgetSolvesFor) {
  json config = small_config();
  config["spp"] = 2;
  config["budget"] = {{"time_cpu_s", 1.5}};
  EXPECT_EQ(load(config).budget->solve_for, SolveFor::Spp);
}

TEST_F(Config, RefusesAListOfSrlThatTheBudgetSolvesFor) {
  json config = small_config();
  config["methods"][0]["srl"] = {8, 16};
  config["budget"] = {{"time_cpu_s", 1.5}, {"solve_for", "srl"}};
  expect_fault(config, "/methods/0/srl", "the budget solves for srl");
}

TEST_F(Config, RefusesACropOutsideTheImage) {
  json config = small_config();
  config["images"]["crops"] = {
      {{"name", "a"}, {"scene", "checkerboard"}, {"rectangle", {880, 0, 32, 32}}}};
  expect_fault(config, "/images/crops/0/rectangle",
               "reaches to (912, 32), outside the image of 900 x 600 pixels");
}

TEST_F(Config, MeasuresACropByTheConfigsResolution) {
  json config = small_config();
  config["scenes"][0]["resolution"] = {64, 64};
  config["images"]["crops"] = {
      {{"name", "a"}, {"scene", "checkerboard"}, {"rectangle", {32, 32, 33, 8}}}};
  expect_fault(config, "/images/crops/0/rectangle", "reaches to (65, 40)");
}

TEST_F(Config, RefusesACropOfAnUnknownScene) {
  json config = small_config();
  config["images"]["crops"] = {{{"name", "a"}, {"scene", "small"}, {"rectangle", {0, 0, 8, 8}}}};
  expect_fault(config, "/images/crops/0/scene", "unknown scene \"small\" (allowed: checkerboard)");
}

TEST_F(Config, ReportsAMissingKeyOnlyOnce) {
  json config = small_config();
  config["methods"][0].erase("estimator");
  expect_fault(config, "/methods/0", "missing key \"estimator\"");
}

TEST_F(Config, SurvivesWrongTypesEverywhere) {
  for (const char* key :
       {"name", "summary", "seed", "threads", "tile", "scenes", "methods", "baseline",
        "tuned_baseline", "samplers", "spp", "budget", "blocks", "relmse_epsilon", "images"}) {
    for (const json& wrong :
         {json(nullptr), json(-1.5), json("x y"), json::array({1, json::object()}), json{{"a", 1}},
          json::array({nullptr, json::array()})}) {
      json config = small_config();
      config[key] = wrong;
      if (std::string(key) == "summary" && wrong.is_string()) continue;
      if (std::string(key) == "name" && wrong.is_string()) continue;
      EXPECT_NE(faults_of(config), "no error") << key << " = " << wrong;
    }
  }
}

TEST(Srl, ReadsBothForms) {
  EXPECT_EQ(parse_srl("16"), (Srl{16, 0, false}));
  EXPECT_EQ(parse_srl("4-12"), (Srl{4, 12, true}));
}

TEST(Srl, WritesWhatWasRead) {
  EXPECT_EQ(parse_srl("16").text(), "16");
  EXPECT_EQ(parse_srl("4-12").text(), "4-12");
}

TEST(Srl, RefusesEverythingElse) {
  for (const char* text :
       {"", "-", "0", "-4", "4-", "0-4", "4-12-3", " 4", "4 -12", "1.5", "99999999999", "+4"}) {
    EXPECT_THROW(parse_srl(text), InputError) << text;
  }
}

TEST(ProjectRoot, RefusesAnEnvironmentVariableThatPointsNowhere) {
  ::setenv("PENUMBRA_ROOT", "/nonexistent", 1);
  EXPECT_THROW(project_root(), InputError);
  ::unsetenv("PENUMBRA_ROOT");
}

}  // namespace
}  // namespace penumbra
