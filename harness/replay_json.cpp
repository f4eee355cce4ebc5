// A replayed pixel for programs.

#include <nlohmann/json.hpp>

#include "harness/config_values.h"
#include "harness/replay.h"

namespace penumbra {
namespace {

using Json = nlohmann::ordered_json;

template <typename Triple>
Json triple(const Triple& v) {
  return {number_to_json(static_cast<double>(v[0])), number_to_json(static_cast<double>(v[1])),
          number_to_json(static_cast<double>(v[2]))};
}

template <typename List>
Json numbers(const List& list) {
  Json result = Json::array();
  for (const auto value : list) result.push_back(number_to_json(static_cast<double>(value)));
  return result;
}

Json iterations_json(const EstimateRecord& record) {
  Json list = Json::array();
  for (const IterationRecord& iteration : record.iterations) {
    Json json = {{"counts", iteration.counts},
                 {"alpha", numbers(iteration.alpha)},
                 {"rays", iteration.rays},
                 {"hits", iteration.hits}};
    if (iteration.cone_angle > 0.0) {
      json["cone_axis"] = triple(iteration.cone_axis);
      json["cone_half_angle_rad"] = number_to_json(iteration.cone_angle);
    }
    list.push_back(std::move(json));
  }
  return list;
}

Json samples_json(const EstimateRecord& record) {
  Json list = Json::array();
  for (const SampleRecord& sample : record.samples) {
    list.push_back({{"iteration", sample.iteration},
                    {"component", record.components[static_cast<std::size_t>(sample.component)]},
                    {"wi", triple(sample.wi)},
                    {"own_pdf_w", number_to_json(static_cast<double>(sample.own_pdf))},
                    {"pdfs_w", numbers(sample.pdfs)},
                    {"f", triple(sample.f)},
                    {"weight_sr", number_to_json(sample.weight)},
                    {"fate", to_string(sample.fate)}});
  }
  return list;
}

Json estimate_json(const ReplayedEstimate& estimate) {
  Json json = {{"estimate", estimate.record.estimate},
               {"camera_sample", estimate.camera_sample},
               {"valid", estimate.point.valid()},
               {"value", triple(estimate.value)}};
  if (!estimate.point.valid()) return json;
  json["point"] = {{"position_world", triple(estimate.position_world)},
                   {"shading_normal", triple(estimate.point.shading_normal)},
                   {"geometric_normal", triple(estimate.point.geometric_normal)},
                   {"wo", triple(estimate.point.wo)},
                   {"material", estimate.material},
                   {"material_index", estimate.point.material}};
  json["recorded"] = estimate.recorded;
  if (!estimate.recorded) return json;
  json["components"] = estimate.record.components;
  json["iterations"] = iterations_json(estimate.record);
  json["samples"] = samples_json(estimate.record);
  json["notes"] = estimate.record.notes;
  json["weighted_sum"] = triple(estimate.weighted_sum);
  json["delta"] = triple(estimate.record.delta);
  json["control"] = triple(estimate.record.control);
  json["relative_difference"] = number_to_json(estimate.relative_difference());
  return json;
}

Json row_json(const StoredRow& stored) {
  const RunRow& row = stored.row();
  Json params = Json::object();
  for (const auto& [name, value] : stored.cell().params.values()) {
    params[name] = param_to_json(value);
  }
  return {{"run_id", row.run_id},
          {"scene", row.scene},
          {"label", row.label},
          {"estimator", row.estimator},
          {"params", params},
          {"sampler", row.sampler},
          {"quantity", to_string(stored.scene().points.quantity)},
          {"spp", row.spp},
          {"srl", row.srl},
          {"srl_initial", row.srl_initial},
          {"srl_adaptive", row.srl_adaptive},
          {"block", row.block},
          {"seed", row.seed},
          {"width", row.width},
          {"height", row.height},
          {"camera_samples", row.camera_samples},
          {"threads", row.threads},
          {"status", row.status == RunStatus::Ok ? "ok" : "failed"},
          {"failure", row.failure},
          {"cell", row.cell},
          {"image_hash", row.image_hash}};
}

Json stored_json(const PixelReplay& replay) {
  if (!replay.stored) return {{"compared", false}, {"reason", replay.why_not_stored}};
  return {{"compared", true},
          {"file", replay.stored->file.string()},
          {"value", triple(replay.stored->value)},
          {"same_bits", !replay.differs()}};
}

}  // namespace

std::string replay_json(const StoredRow& stored, const PixelReplay& replay, std::optional<int> only,
                        const std::optional<RowCheck>& check) {
  const TileRect& tile = replay.tile;
  Json json = {
      {"row", row_json(stored)},
      {"pixel", {{"x", replay.x}, {"y", replay.y}}},
      {"tile", {{"x0", tile.x0}, {"y0", tile.y0}, {"width", tile.width}, {"height", tile.height}}},
      {"mean", triple(replay.mean)},
      {"value", triple(replay.value)},
      {"stored", stored_json(replay)}};
  if (check) {
    json["verify"] = {{"stored_hash", check->stored},
                      {"rendered_hash", check->rendered},
                      {"same", check->same()}};
  }
  json["estimates"] = Json::array();
  for (const ReplayedEstimate& estimate : replay.estimates) {
    if (only && *only != estimate.record.estimate) continue;
    json["estimates"].push_back(estimate_json(estimate));
  }
  return json.dump(2) + "\n";
}

}  // namespace penumbra
