#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "harness/efficiency.h"

/// What the tests of rows and of the efficiency table share.
namespace penumbra {

/// A complete run; tests change what they are about.
inline RunRow run(const std::string& label, int block, double cpu_s, double mse) {
  RunRow row;
  row.run_id = label + "-" + std::to_string(block);
  row.scene = "checkerboard";
  row.label = label;
  row.estimator = label;
  row.sampler = "independent";
  row.spp = 8;
  row.camera_samples = 1;
  row.srl = row.srl_initial = 16;
  row.block = block;
  row.rays = 1000;
  row.time_cpu_s = cpu_s;
  row.time_wall_s = 2 * cpu_s;
  row.mse = mse;
  row.mse_naive = mse + 0.001;
  row.relmse = 0.5;
  row.mean_error = block % 2 == 0 ? 0.01 : -0.01;
  row.p_eff = 1000;
  row.reference_id = "r1";
  row.reference_mean = 2;
  row.reference_mean_se = 0;
  return row;
}

/// "mis" and "pmc" in 4 blocks; pmc takes as long and errs half as much, with the same small
/// spread.
inline std::vector<RunRow> two_methods() {
  std::vector<RunRow> rows;
  for (int block = 0; block < 4; ++block) {
    const double spread = 1 + 0.01 * block;
    rows.push_back(run("pmc", block, 1.0, 0.5 * spread));
    rows.push_back(run("mis", block, 1.0, 1.0 * spread * (block % 2 == 0 ? 1.01 : 0.99)));
  }
  return rows;
}

/// A scene at several budgets of 1, 2, 4 and 8 s: errors scale / time, with a small spread over 4
/// blocks that differs between labels and budgets.
inline std::vector<RunRow> budget_rows(const std::string& scene, const std::string& label,
                                       double scale) {
  std::vector<RunRow> rows;
  for (const double budget : {1.0, 2.0, 4.0, 8.0}) {
    for (int block = 0; block < 4; ++block) {
      const double phase = static_cast<double>(label.size()) + budget + 1.7 * block;
      RunRow row = run(label, block, budget, scale / budget * (1 + 0.01 * std::sin(phase)));
      row.run_id = scene + row.run_id + "-" + std::to_string(budget);
      row.scene = scene;
      row.reference_id = "r-" + scene;
      row.budget_s = budget;
      row.relmse = *row.mse / 4;
      row.spp = static_cast<int>(8 * budget);
      rows.push_back(row);
    }
  }
  return rows;
}

inline void append(std::vector<RunRow>& rows, const std::vector<RunRow>& more) {
  rows.insert(rows.end(), more.begin(), more.end());
}

inline TableOptions options(const std::string& baseline = "mis") {
  TableOptions o;
  o.baseline = baseline;
  return o;
}

/// The row of a label and sampler; a failure of the test where there is none.
inline EfficiencyRow find(const std::vector<EfficiencyRow>& rows, const std::string& label,
                          const std::string& sampler = "independent") {
  for (const EfficiencyRow& row : rows) {
    if (row.label == label && row.sampler == sampler) return row;
  }
  ADD_FAILURE() << "no row " << label;
  return {};
}

}  // namespace penumbra
