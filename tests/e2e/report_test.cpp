// `penumbra report` and `penumbra figure` on folders of runs, whole and partial.

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

#include "harness/run_row.h"
#include "harness/stage_table.h"
#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

class ReportCommand : public CommandLine {
 protected:
  static constexpr const char* kSummary = "a </script><b> & \"study\" <!-- of it";

  void run_checkerboard(const std::string& name) {
    const json config = {
        {"version", 1},
        {"name", name},
        {"summary", kSummary},
        {"baseline", "MIS"},
        {"spp", 2},
        {"blocks", 2},
        {"scenes",
         {{{"name", "checkerboard"},
           {"resolution", {40, 24}},
           {"camera_samples", 2},
           {"reference", {{"spp", 8}, {"srl", 8}}}}}},
        {"methods",
         {{{"label", "MIS"}, {"estimator", "mis"}, {"srl", 4}},
          {{"label", "PMC-HI"}, {"estimator", "pmc_hi"}, {"srl", "2-4"}}}},
        {"images",
         {{"crops",
           {{{"name", "squares"}, {"scene", "checkerboard"}, {"rectangle", {4, 8, 16, 12}}}}}}}};
    write_file("report.json", config.dump());
    const Outcome outcome = run("run report.json --out out");
    ASSERT_EQ(outcome.code, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("report: "), std::string::npos) << outcome.output;
  }

  json page_data() const {
    const std::string page = read_text(root_ / "out/report.html");
    const std::string begin = "<script id=\"data\" type=\"application/json\">";
    const std::size_t at = page.find(begin);
    EXPECT_NE(at, std::string::npos);
    const std::size_t end = page.find("</script>", at);
    return json::parse(page.substr(at + begin.size(), end - at - begin.size()));
  }
};

TEST_F(ReportCommand, PageHasTheTablesAndPicturesWhateverTheSummarySays) {
  run_checkerboard("page");
  const json data = page_data();
  EXPECT_EQ(data["name"], "page");
  EXPECT_EQ(data["summary"], kSummary);
  EXPECT_EQ(data["efficiency"]["rows"].size(), 2u);
  EXPECT_EQ(data["runs"]["rows"].size(), 4u);
  EXPECT_EQ(data["missing"], json::array());
  EXPECT_EQ(data["crops"][0]["name"], "squares");
  int references = 0;
  int maps = 0;
  for (const json& image : data["images"]) {
    references += image["label"] == "";
    maps += image["channels"] == 1;
    EXPECT_TRUE(fs::exists(root_ / "out" / image["script"].get<std::string>())) << image;
  }
  EXPECT_EQ(references, 1);
  EXPECT_GT(maps, 0) << "PMC-HI has maps of its mixture";
  EXPECT_EQ(read_text(root_ / "out/report.html").find("<b> &"), std::string::npos);
}

TEST_F(ReportCommand, SharesOfTheStagesAreMeasuredOncePerCell) {
  run_checkerboard("stages");
  const fs::path file = root_ / "out/stages.csv";
  const std::vector<StageRow> rows = read_stage_rows(file);
  ASSERT_EQ(rows.size(), 2u);
  for (const StageRow& row : rows) {
    double sum = 0.0;
    for (const double share :
         {row.trace, row.sample, row.weigh, row.adapt, row.set_up, row.outside}) {
      EXPECT_GE(share, 0.0) << row.label;
      sum += share;
    }
    EXPECT_NEAR(sum, 1.0, 1e-12) << row.label;
    EXPECT_GT(row.trace, 0.0) << row.label;
    EXPECT_GT(row.ns, 0.0) << row.label;
    EXPECT_GT(row.rays, 0.0) << row.label;
  }
  EXPECT_EQ(rows[0].label, "MIS");
  EXPECT_EQ(rows[0].adapt, 0.0) << "nothing adapts";
  EXPECT_GT(rows[1].adapt, 0.0) << "PMC-HI does";
  EXPECT_EQ(page_data()["stages"]["rows"].size(), 2u);

  // Times of another measurement would differ.
  const std::string before = read_text(file);
  ASSERT_EQ(run("run report.json --out out").code, 0);
  EXPECT_EQ(read_text(file), before);
  std::ofstream(file) << to_csv(std::span(rows).first(1));
  ASSERT_EQ(run("run report.json --out out").code, 0);
  const std::vector<StageRow> again = read_stage_rows(file);
  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[0], rows[0]) << "kept";
  EXPECT_EQ(again[1].cell, rows[1].cell) << "measured again";
}

TEST_F(ReportCommand, ReportWithoutStagesSaysSo) {
  run_checkerboard("no stages");
  fs::remove(root_ / "out/stages.csv");
  const Outcome outcome = run("report out");
  EXPECT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("stages.csv: where the time of estimates goes is not known"),
            std::string::npos)
      << outcome.output;
  EXPECT_NE(page_data()["missing"].dump().find("stages.csv"), std::string::npos);
  EXPECT_EQ(page_data()["efficiency"]["rows"].size(), 2u);

  std::ofstream(root_ / "out/stages.csv") << "scene,label\n";
  EXPECT_EQ(run("report out").code, 0);
  EXPECT_NE(page_data()["missing"].dump().find("missing columns"), std::string::npos);
  EXPECT_EQ(run("run report.json --out out").code, 2) << "nothing is overwritten";
}

TEST_F(ReportCommand, PartialAndMalformedFoldersSayWhatIsMissing) {
  run_checkerboard("partial");
  fs::remove(root_ / "out/plan.lock.json");
  fs::remove_all(root_ / "out/images");
  std::ofstream(root_ / "out/config.resolved.json") << "{\"version\": 1";
  std::ofstream(root_ / "out/environment.json") << "]";
  const Outcome outcome = run("report out");
  EXPECT_EQ(outcome.code, 0) << outcome.output;
  const json data = page_data();
  EXPECT_EQ(data["name"], "out") << "the folder's";
  EXPECT_EQ(data["baseline"], "MIS");
  EXPECT_EQ(data["efficiency"]["rows"].size(), 2u);
  EXPECT_TRUE(data["environment"].is_null());
  const std::string missing = data["missing"].dump();
  for (const char* part :
       {"plan.lock.json", "config.resolved.json", "picture of checkerboard, MIS"}) {
    EXPECT_NE(missing.find(part), std::string::npos) << part << " in " << missing;
    EXPECT_TRUE(std::string(part).find("picture") == 0 ||
                outcome.output.find(part) != std::string::npos)
        << outcome.output;
  }
}

TEST_F(ReportCommand, MeasurementsThatCannotBeReadLeaveAPage) {
  run_checkerboard("broken");
  std::ofstream(root_ / "out/measurements.csv") << "run_id,scene\nx\n";
  EXPECT_EQ(run("report out").code, 0);
  EXPECT_EQ(page_data()["efficiency"]["rows"].size(), 0u);
  EXPECT_NE(page_data()["missing"].dump().find("measurements.csv: nothing was measured"),
            std::string::npos);
}

TEST_F(ReportCommand, JsonIsAllThatMachinesRead) {
  run_checkerboard("json");
  const Outcome outcome = run_shell("'" PENUMBRA_EXECUTABLE "' report out --json 2>/dev/null");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(json::parse(outcome.output)["rows"].size(), 2u);
  const Outcome again =
      run_shell("'" PENUMBRA_EXECUTABLE "' run report.json --out out --json 2>/dev/null");
  EXPECT_EQ(json::parse(again.output), json::parse(outcome.output));
}

TEST_F(ReportCommand, StabilitySuiteIsShownWithoutARun) {
  const Outcome suite = run("stability --quick --case small_light --estimator mis --out out");
  ASSERT_EQ(suite.code, 0) << suite.output;
  const Outcome outcome = run("report out");
  EXPECT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_FALSE(fs::exists(root_ / "out/efficiency.csv")) << "nothing was run";
  const json rows = page_data()["stability"]["rows"];
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(rows[0]["case"], "small_light");
  std::ofstream(root_ / "out/stability.json") << R"({"rows": [{"case": 1}]})";
  EXPECT_EQ(run("report out").code, 0);
  EXPECT_TRUE(page_data()["stability"].is_null()) << "not of a suite";
}

TEST_F(ReportCommand, OtherFoldersAreRefused) {
  fs::create_directory(root_ / "other");
  const Outcome outcome = run("report other");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.output.find("found none of their files"), std::string::npos) << outcome.output;
  EXPECT_FALSE(fs::exists(root_ / "other/report.html"));
}

// The issue's own size. No time is asserted; the page's is seen in the test's duration.
TEST_F(ReportCommand, TwoHundredCellsGiveAPage) {
  run_checkerboard("large");
  const std::vector<RunRow> rows = read_run_rows(root_ / "out/measurements.csv").rows;
  std::string text = csv_line(run_columns());
  for (int copy = 0; copy < 100; ++copy) {
    for (RunRow row : rows) {
      row.run_id += std::to_string(copy);
      row.scene += std::to_string(copy / 5);
      row.label += copy % 5 == 0 ? "" : std::to_string(copy % 5);
      text += csv_line(run_record(row));
    }
  }
  std::ofstream(root_ / "out/measurements.csv") << text;
  const Outcome outcome = run("report out");
  EXPECT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_EQ(page_data()["efficiency"]["rows"].size(), 200u);
}

TEST_F(ReportCommand, FigureIsAPngSvgOrPdf) {
  run_checkerboard("figure");
  const std::vector<std::pair<std::string, std::string>> heads = {
      {"png", "\x89PNG"}, {"svg", "<?xml"}, {"pdf", "%PDF"}};
  fs::remove_all(root_ / "out/images");
  EXPECT_EQ(run("figure out --scene checkerboard -o f.png").code, 2) << "no pictures";
  EXPECT_FALSE(fs::exists(root_ / "out/images")) << "a figure writes itself only";
  ASSERT_EQ(run("run report.json --out out").code, 0);
  for (const auto& [extension, head] : heads) {
    const Outcome outcome =
        run("figure out --scene checkerboard --crop squares --crop 0,0,20,10 -o f." + extension);
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    EXPECT_EQ(read_text(root_ / ("f." + extension)).substr(0, head.size()), head);
  }
}

TEST_F(ReportCommand, FigureNamesWhatItCannotFind) {
  run_checkerboard("figure");
  const auto refused = [&](const std::string& arguments, const std::string& message) {
    const Outcome outcome = run("figure out " + arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_NE(outcome.output.find(message), std::string::npos) << outcome.output;
  };
  refused("--scene attic -o f.png", "there are pictures of: checkerboard");
  refused("--scene checkerboard --method Mis -o f.png", "there are: MIS, PMC-HI");
  refused("--scene checkerboard --crop 30,0,20,10 -o f.png", "inside 40 x 24 pixels");
  refused("--scene checkerboard --crop 1,2,3 -o f.png", "or a crop of the config: squares");
  refused("--scene checkerboard -o f.jpg", "ends in .png, .svg or .pdf");
  EXPECT_FALSE(fs::exists(root_ / "f.png"));
}

}  // namespace
}  // namespace penumbra
