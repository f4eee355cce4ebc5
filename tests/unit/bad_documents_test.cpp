// Documents of the harness that are damaged or ask for the impossible: the exception that is
// announced, with file, place, what was found and what is allowed.

#include <limits>

#include "harness/exr.h"
#include "harness/plan.h"
#include "harness/reference.h"
#include "harness/reference_manifest.h"
#include "tests/unit/config_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

class BadDocuments : public ConfigTest {
 protected:
  template <class Fault, class Read>
  static void expect_refused(Read read, const std::vector<std::string>& parts) {
    try {
      read();
      ADD_FAILURE() << "accepted; expected \"" << parts.front() << "\"";
    } catch (const Fault& fault) {
      const std::string message = fault.what();
      for (const std::string& part : parts) {
        EXPECT_NE(message.find(part), std::string::npos)
            << "expected \"" << part << "\" in: " << message;
      }
    }
  }

  /// The small config with a method of these values.
  static json config_with(const json& values) {
    json config = small_config();
    config["methods"][1] = {{"label", "P"}, {"estimator", "pmc_hi"}, {"srl", "4-12"}};
    config["methods"][1].update(values);
    return config;
  }
};

TEST_F(BadDocuments, SweepsThatExplodeAreRefusedBeforeTheyAreExpanded) {
  const json counts = {{"from", 8}, {"to", 8000}, {"steps", 500}, {"scale", "linear"}};
  const json floors = {{"from", 0.001}, {"to", 0.1}, {"steps", 500}, {"scale", "linear"}};
  expect_fault(config_with({{"spp", counts}, {"params", {{"alpha_floor", floors}}}}), "/methods/1",
               "the axes of method \"P\" have more than 10000 combinations");
  const json wide = {{"from", 1}, {"to", 5000}, {"steps", 1000}, {"scale", "linear"}};
  expect_fault(config_with({{"srl", {{"initial", wide}, {"adaptive", wide}}}}), "/methods/1/srl",
               "makes 1000000 pairs; allowed: up to 1000");
  json list = json::array();
  for (int i = 1; i <= 1001; ++i) list.push_back(8 * i);
  expect_fault(config_with({{"spp", list}}), "/methods/1/spp",
               "has 1001 values; allowed: up to 1000");
}

TEST_F(BadDocuments, RangesBeyondTheirTypeAreRefused) {
  const auto range = [](double from, double to) {
    return json{{"from", from}, {"to", to}, {"steps", 2}, {"scale", "linear"}};
  };
  expect_fault(config_with({{"spp", range(8, 5e9)}}), "/methods/1/spp",
               "expected whole numbers from 1 to 1000000, found 5000000000");
  expect_fault(config_with({{"spp", range(8, 1e300)}}), "/methods/1/spp",
               "expected a range within -1e+15 and 1e+15");
  expect_fault(config_with({{"params", {{"alpha_floor", range(-1e308, 1e308)}}}}),
               "/methods/1/params/alpha_floor", "expected a range within");
}

TEST_F(BadDocuments, OverridesThatAreNotUtf8AreRefused) {
  EXPECT_NE(faults_of(small_config(), {"name=\xff"}).find("error: is not UTF-8"),
            std::string::npos);
  EXPECT_NE(faults_of(small_config(), {"na\xc3me=x"}).find("error: is not UTF-8"),
            std::string::npos);
  EXPECT_EQ(faults_of(small_config(), {"summary=\xc3\xa4"}), "no error");
}

TEST_F(BadDocuments, LongNamesAreNotComparedForEver) {
  const std::string name(1u << 20, 'x');
  json config = small_config();
  config["methods"][0]["estimator"] = name;
  EXPECT_NE(faults_of(config).find("unknown estimator"), std::string::npos);
}

TEST_F(BadDocuments, PlansNameTheValueThatIsNone) {
  const json cell = {{"id", "a"},      {"spp", 4},          {"srl", "4-12"},
                     {"fixed_s", 0.0}, {"per_unit_s", 0.0}, {"predicted_cpu_s", 0.0}};
  const json good = {{"machine", "m"}, {"core_version", 1}, {"cells", {cell}}};
  EXPECT_EQ(read_plan_file(write("plan.json", good.dump())).cells.at(0).spp, 4);
  struct Case {
    const char* pointer;
    json value;
    const char* message;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"/cells/0/spp", 1e300, "\"spp\" is 1e+300; expected a whole number from 1 to"},
           {"/cells/0/spp", 0, "\"spp\" is 0; expected"},
           {"/cells/0/spp", -5, "\"spp\" is -5; expected"},
           {"/cells/0/spp", std::uint64_t{4294967297}, "\"spp\" is 4294967297; expected"},
           {"/cells/0/spp", true, "\"spp\" is true; expected"},
           {"/cells/0/srl", "0", "found \"0\""},
           {"/cells/0/srl", 4, "not a plan"},
           {"/cells/0/id", nullptr, "not a plan"},
           {"/cells", 3, "not a plan"},
           {"/core_version", 1.5, "\"core_version\" is 1.5"},
           {"/scenes", {{"a", 1}}, "not a plan"}}) {
    json plan = good;
    plan[json::json_pointer(c.pointer)] = c.value;
    const fs::path file = write("plan.json", plan.dump());
    expect_refused<InputError>([&] { read_plan_file(file); }, {file.string(), c.message});
  }
  for (const char* text : {"", "[", "3", "{\"cells\": 1e999}"}) {
    const fs::path file = write("plan.json", text);
    expect_refused<InputError>([&] { read_plan_file(file); }, {file.string()});
  }
  expect_refused<InputError>([&] { read_plan_file(root_); }, {"is a folder"});
}

TEST_F(BadDocuments, ManifestsOfAnyShapeAreToldApart) {
  fs::create_directories(root_ / "references/small");
  const fs::path file = write("references/small/a-1.exr", "bytes");
  for (const char* text : {"", "{", "[]", "{\"references\": 3}"}) {
    write("references/manifest.json", text);
    expect_refused<ReferenceError>([&] { check_small_reference(file, "1"); },
                                   {"is not a manifest of references"});
  }
  for (const char* text :
       {"{\"references\": [3, null, [], {}]}", "{\"references\": [{\"file\": 7, \"id\": {}}]}"}) {
    write("references/manifest.json", text);
    expect_refused<ReferenceError>([&] { check_small_reference(file, "1"); }, {"has no entry in"});
  }
  write("references/manifest.json",
        "{\"references\": [{\"file\": \"small/a-1.exr\", \"id\": \"1\", \"xxh3_128\": 5}]}");
  expect_refused<ReferenceError>([&] { check_small_reference(file, "1"); },
                                 {"bytes have the hash"});
}

TEST_F(BadDocuments, ReferencesWithBadMetadataOrPixelsAreRefused) {
  const std::map<std::string, std::string> good{
      {"reference_id", "id"}, {"spp", "8"}, {"lineage", R"([{"estimator": "mis", "passes": 4}])"}};
  const fs::path file = root_ / "reference.exr";
  const Image one = make_image(2, 3, Rgb(1.0f));
  write_exr(file, {{"half_a", one}, {"half_b", one}}, good);
  EXPECT_EQ(read_reference(file, "id").spp, 8);
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases{
      {"spp", {"", "x", "0", "-2", "8.5", "99999999999"}},
      {"lineage",
       {"", "{", "3", "[3]", "[{}]", R"([{"estimator": 4, "passes": 4}])",
        R"([{"estimator": "mis", "passes": -1}])",
        R"([{"estimator": "mis", "passes": 4, "tile": "x"}])"}}};
  for (const auto& [key, values] : cases) {
    for (const std::string& value : values) {
      std::map<std::string, std::string> metadata = good;
      metadata[key] = value;
      write_exr(file, {{"half_a", one}, {"half_b", one}}, metadata);
      expect_refused<ReferenceError>([&] { read_reference(file, "id"); },
                                     {file.string(), "metadata \"" + key + "\""});
    }
  }
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0f}) {
    Image bad = one;
    bad.at(1, 2).y = value;
    write_exr(file, {{"half_a", one}, {"half_b", bad}}, good);
    expect_refused<ReferenceError>([&] { read_reference(file, "id"); },
                                   {"layer \"half_b\", pixel 1,2 is (1, "});
  }
  write_exr(file, {{"half_a", one}, {"half_b", make_scalar_image(2, 3)}}, good);
  expect_refused<ReferenceError>([&] { read_reference(file, "id"); }, {"a half of the reference"});
}

}  // namespace
}  // namespace penumbra
