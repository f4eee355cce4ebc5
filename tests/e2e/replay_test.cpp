// `penumbra replay`: the same bits as the run, every sample accounted for, and refusals.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "harness/exr.h"
#include "harness/run_row.h"
#include "tests/e2e/command_line_fixture.h"

namespace penumbra {
namespace {

using nlohmann::json;

// Relative tolerance of sums made again: a sum in double of floats is rounded to float once per
// estimate, 6e-8, and once more where delta lights are added.
constexpr double kRelative = 1e-6;

class Replay : public CommandLine {
 protected:
  // MIS and PMC-HI with two samplers and two blocks on a small Checkerboard: 8 rows.
  void run_checkerboard() {
    const json config = json::parse(R"({
      "version": 1, "name": "replay", "baseline": "MIS", "spp": 5, "blocks": 2, "seed": 11,
      "samplers": ["independent", "stratified"],
      "scenes": [{"name": "checkerboard", "resolution": [40, 24], "camera_samples": 2,
                  "reference": {"spp": 8, "srl": 8}}],
      "methods": [{"label": "MIS", "estimator": "mis", "srl": 9},
                  {"label": "PMC-HI", "estimator": "pmc_hi", "srl": "4-12"}]
    })");
    write_file("replay.json", config.dump());
    const Outcome outcome = run("run replay.json --out out --threads 2");
    ASSERT_EQ(outcome.code, 0) << outcome.output;
    rows_ = read_run_rows(root_ / "out/measurements.csv").rows;
    ASSERT_EQ(rows_.size(), 8u);
  }

  RunRow row(const std::string& label, const std::string& sampler, int block) const {
    for (const RunRow& row : rows_) {
      if (row.label == label && row.sampler == sampler && row.block == block) return row;
    }
    ADD_FAILURE() << "no row " << label;
    return {};
  }

  fs::path picture_of(const RunRow& row) const {
    for (const fs::directory_entry& entry : fs::directory_iterator(root_ / "out/images")) {
      const std::string name = entry.path().filename().string();
      if (entry.path().extension() == ".exr" && !name.ends_with("-stddev.exr") &&
          name.find(row.cell.substr(0, 6)) != std::string::npos) {
        return entry.path();
      }
    }
    ADD_FAILURE() << "no picture of " << row.run_id;
    return {};
  }

  Outcome replay(const RunRow& row, const std::string& arguments) const {
    return run("replay out --row " + row.run_id + " " + arguments);
  }

  void write_rows(const std::vector<RunRow>& rows) const {
    std::string text = csv_line(run_columns());
    for (const RunRow& row : rows) text += csv_line(run_record(row));
    write_file("out/measurements.csv", text);
  }

  void expect_refused(const RunRow& row, const std::string& message) const {
    const Outcome refused = replay(row, "--pixel 4,4");
    EXPECT_EQ(refused.code, 5) << refused.output;
    EXPECT_NE(refused.output.find(message), std::string::npos) << refused.output;
  }

  std::vector<RunRow> rows_;
};

std::string place_text(const RunRow& row, int x, int y) {
  return row.label + " " + row.sampler + " pixel " + std::to_string(x) + "," + std::to_string(y) +
         "\n";
}

double number(const json& value) { return value.get<double>(); }

// The estimate's value again, from its samples alone.
void expect_sum_of_samples(const json& estimate, const std::string& where) {
  if (!estimate.at("valid").get<bool>()) return;
  ASSERT_TRUE(estimate.at("recorded").get<bool>()) << where;
  double largest = 0.0;
  for (const json& channel : estimate.at("value")) largest = std::max(largest, number(channel));
  for (std::size_t c = 0; c < 3; ++c) {
    double sum = number(estimate.at("delta")[c]) + number(estimate.at("control")[c]);
    for (const json& sample : estimate.at("samples")) {
      sum += number(sample.at("weight_sr")) * number(sample.at("f")[c]);
    }
    EXPECT_NEAR(sum, number(estimate.at("value")[c]), kRelative * largest) << where;
  }
}

TEST_F(Replay, PixelsHaveTheBitsOfThePictureAndTheirSamplesAddUp) {
  run_checkerboard();
  bool any_light = false;
  for (const RunRow& row : rows_) {
    if (row.block != 0) continue;
    const ExrFile picture = read_exr(picture_of(row));
    for (const auto& [x, y] : {std::pair(0, 23), std::pair(17, 20), std::pair(39, 12)}) {
      const std::string where = place_text(row, x, y);
      const Outcome outcome =
          replay(row, "--json --pixel " + std::to_string(x) + "," + std::to_string(y));
      ASSERT_EQ(outcome.code, 0) << where << outcome.output;
      const json result = json::parse(outcome.output);
      EXPECT_TRUE(result.at("stored").at("same_bits").get<bool>()) << where;
      ASSERT_EQ(result.at("estimates").size(), 5u) << where;
      // Camera sample 0 has estimates 0, 2, 4; sample 1 has 1, 3.
      const Rgb stored = picture.image("reflected").pixels[static_cast<std::size_t>(y * 40 + x)];
      for (std::size_t c = 0; c < 3; ++c) {
        std::array<double, 5> v{};
        for (std::size_t e = 0; e < 5; ++e) v[e] = number(result["estimates"][e]["value"][c]);
        const double mean = ((v[0] + v[2] + v[4]) / 3.0 + (v[1] + v[3]) / 2.0) / 2.0;
        const float pixel = stored[static_cast<int>(c)];
        EXPECT_NEAR(mean, static_cast<double>(pixel), kRelative * mean) << where;
        any_light = any_light || mean > 0.0;
      }
      for (const json& estimate : result.at("estimates")) expect_sum_of_samples(estimate, where);
    }
  }
  EXPECT_TRUE(any_light);
}

TEST_F(Replay, WholeRowIsReproducedOnAnotherNumberOfThreads) {
  run_checkerboard();
  for (const char* label : {"MIS", "PMC-HI"}) {
    const RunRow later = row(label, "stratified", 1);
    ASSERT_EQ(later.threads, 2);
    const Outcome outcome = replay(later, "--pixel 3,4 --verify --threads 1");
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("row reproduced to the bit"), std::string::npos);
    EXPECT_NE(outcome.output.find("pictures are of block 0"), std::string::npos) << outcome.output;
  }
}

TEST_F(Replay, TextFitsIn120Columns) {
  run_checkerboard();
  const Outcome outcome = replay(row("PMC-HI", "independent", 0), "--pixel 17,20 --estimate 2");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  std::istringstream lines(outcome.output);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120u) << line;
  EXPECT_NE(outcome.output.find("same bits as images/"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("\nestimate 2 "), std::string::npos);
  EXPECT_EQ(outcome.output.find("\nestimate 1 "), std::string::npos);
}

TEST_F(Replay, FaultsOfTheCommandLineAreNamed) {
  run_checkerboard();
  const std::string id = rows_[0].run_id;
  const std::pair<std::string, std::string> faults[] = {
      {"replay out --row nothing --pixel 1,1", rows_[0].run_id},
      {"replay out --row '' --pixel 1,1", rows_[0].run_id},
      {"replay out --row " + id + " --pixel 40,1", "outside the image of 40 x 24"},
      {"replay out --row " + id + " --pixel=1,-1", "outside the image of 40 x 24"},
      {"replay out --row " + id + " --pixel 1:1", "expected X,Y"},
      {"replay out --row " + id + " --pixel 1,", "expected X,Y"},
      {"replay out --row " + id + " --pixel 1,2,3", "expected X,Y"},
      {"replay out --row " + id + " --pixel 1,1 --estimate 5", "expected 0 to 4, found 5"},
      {"replay nowhere --row " + id + " --pixel 1,1", "nowhere"}};
  for (const auto& [command, message] : faults) {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.code, 2) << command << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find(message), std::string::npos) << command << "\n" << outcome.output;
  }
  EXPECT_EQ(run("replay out --row " + id.substr(0, 12) + " --pixel 1,1").code, 0);
}

TEST_F(Replay, OneChangedBitOfPictureOrHashIsAFaultOfCorrectness) {
  run_checkerboard();
  const RunRow victim = row("MIS", "stratified", 0);
  const fs::path file = picture_of(victim);
  ExrFile picture = read_exr(file);
  for (ExrLayer& layer : picture.layers) {
    if (layer.name != "reflected") continue;
    Rgb& pixel = std::get<Image>(layer.content).pixels[20 * 40 + 17];
    pixel.y = std::nextafter(pixel.y, 1e9f);
  }
  write_exr(file, picture.layers, picture.metadata);
  const Outcome changed = replay(victim, "--pixel 17,20");
  EXPECT_EQ(changed.code, 6) << changed.output;
  EXPECT_NE(changed.output.find("DIFFERS from images/"), std::string::npos) << changed.output;
  EXPECT_EQ(replay(victim, "--pixel 18,20").code, 0);

  std::string rows = read_text(root_ / "out/measurements.csv");
  const std::size_t place = rows.find(victim.image_hash);
  ASSERT_NE(place, std::string::npos);
  rows[place] = rows[place] == '0' ? '1' : '0';
  write_file("out/measurements.csv", rows);
  EXPECT_EQ(replay(victim, "--pixel 18,20").code, 0);
  EXPECT_EQ(replay(victim, "--pixel 18,20 --verify").code, 6);
}

TEST_F(Replay, WhatChangedSinceTheRunIsNamed) {
  json scene = json::parse(read_text(fs::path(PENUMBRA_SOURCE_DIR) / "scenes/furnace/scene.json"));
  write_file("mine.json", scene.dump());
  write_file("changing.json", R"({
    "version": 1, "name": "changing", "baseline": "PMC-HI", "spp": 2, "blocks": 1,
    "scenes": [{"name": "mine", "file": "mine.json", "resolution": [8, 8], "camera_samples": 1,
                "reference": {"spp": 2, "srl": 4}}],
    "methods": [{"label": "PMC-HI", "estimator": "pmc_hi", "srl": "4-12"}]
  })");
  const Outcome outcome = run("run changing.json --out out");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  const RunRow only = read_run_rows(root_ / "out/measurements.csv").rows.at(0);
  EXPECT_EQ(replay(only, "--pixel 4,4").code, 0);

  const std::string resolved = read_text(root_ / "out/config.resolved.json");
  const std::pair<const char*, const char*> changes[] = {
      {"/methods/0/params/n_min", "parameters \"\" are \"n_min=2\""},
      {"/quantity", "quantity"},
      {"/spp", "budget, SPP or SRL"}};
  for (const auto& [pointer, message] : changes) {
    json config = json::parse(resolved);
    json& value = config.at(json::json_pointer(pointer));
    value = value.is_string() ? json("irradiance") : json(value.get<int>() + 1);
    write_file("out/config.resolved.json", config.dump());
    expect_refused(only, message);
  }
  write_file("out/config.resolved.json", resolved);

  const std::string plan = read_text(root_ / "out/plan.lock.json");
  json other_plan = json::parse(plan);
  other_plan["cells"][0]["spp"] = 3;
  write_file("out/plan.lock.json", other_plan.dump());
  expect_refused(only, "plan.lock.json gives SPP 3");
  write_file("out/plan.lock.json", plan);

  RunRow other = only;
  other.estimator = "pmc_gone";
  write_rows({other});
  expect_refused(only, "no estimator \"pmc_gone\"");
  other = only;
  other.cell = "0123456789abcdef";
  write_rows({other});
  other_plan = json::parse(plan);
  other_plan["core_version"] = -1;
  write_file("out/plan.lock.json", other_plan.dump());
  expect_refused(only, "core version -1 is ");
  write_file("out/plan.lock.json", plan);
  write_rows({only});

  scene["materials"]["white"]["reflectance"] = 0.25;
  write_file("mine.json", scene.dump());
  expect_refused(only, "content of scene \"mine\"");
}

}  // namespace
}  // namespace penumbra
