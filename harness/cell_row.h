#pragma once

#include <string>

#include "harness/plan.h"

namespace penumbra {

/// Writes what tells a cell apart into a row of any table that has such columns.
/// @param scene  its name
template <class Row>
void put_cell(const Cell& cell, const std::string& scene, Row& row) {
  row.scene = scene;
  row.label = cell.label;
  row.estimator = std::string(cell.estimator->name);
  row.sampler = std::string(to_string(cell.sampler));
  row.params = cell.params_text;
  row.spp = cell.spp;
  row.srl = cell.srl.total();
  row.srl_initial = cell.srl.initial;
  row.srl_adaptive = cell.srl.adaptive;
  if (cell.params.values().count("population") != 0) {
    row.population = cell.params.integer("population");
  }
  row.budget_s = cell.budget_s;
  row.cell = cell.id;
}

}  // namespace penumbra
