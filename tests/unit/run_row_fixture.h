#pragma once

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

inline TableOptions options(const std::string& baseline = "mis") {
  TableOptions o;
  o.baseline = baseline;
  return o;
}

}  // namespace penumbra
