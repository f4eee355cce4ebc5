#include "harness/config.h"

#include <charconv>

#include "harness/config_overrides.h"
#include "harness/config_reader.h"
#include "harness/config_resolved.h"
#include "harness/experiment_schema.h"
#include "scenes/core/error.h"
#include "scenes/core/json_schema.h"

namespace penumbra {

namespace {

/// More shadow rays per light than any budget pays for; keeps sums of counts inside an int.
constexpr int kMaxSrl = 1'000'000;

/// @return whether the whole text is an integer in [min, kMaxSrl]
bool parse_count(std::string_view text, int min, int& result) {
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, result);
  return error == std::errc() && end == last && result >= min && result <= kMaxSrl;
}

}  // namespace

std::string Srl::text() const {
  if (!split) return std::to_string(total());
  return std::to_string(initial) + "-" + std::to_string(adaptive);
}

Srl parse_srl(const std::string& text) {
  const std::string_view view = text;
  const std::size_t dash = view.find('-');
  Srl srl;
  bool valid = false;
  if (dash == std::string_view::npos) {
    valid = parse_count(view, 1, srl.initial);
  } else {
    srl.split = true;
    valid = parse_count(view.substr(0, dash), 1, srl.initial) &&
            parse_count(view.substr(dash + 1), 0, srl.adaptive);
  }
  if (valid) return srl;
  throw InputError(
      "expected shadow rays per light as a total \"16\" or as initial-adaptive \"4-12\", each up "
      "to " +
      std::to_string(kMaxSrl) + ", found \"" + text + "\"");
}

std::optional<Quantity> parse_quantity(std::string_view name) {
  for (const Quantity quantity : {Quantity::Radiance, Quantity::Irradiance}) {
    if (to_string(quantity) == name) return quantity;
  }
  return std::nullopt;
}

std::string_view to_string(ReferenceType type) {
  switch (type) {
    case ReferenceType::Sampled:
      return "sampled";
    case ReferenceType::ExactSum:
      return "exact_sum";
    case ReferenceType::Auto:
      break;
  }
  return "auto";
}

std::optional<ReferenceType> parse_reference_type(std::string_view name) {
  for (const ReferenceType type :
       {ReferenceType::Auto, ReferenceType::Sampled, ReferenceType::ExactSum}) {
    if (to_string(type) == name) return type;
  }
  return std::nullopt;
}

ExperimentConfig load_config(const std::filesystem::path& file,
                             const std::vector<std::string>& overrides) {
  static const JsonSchema schema(kExperimentSchemaJson);
  LocatedJson document = LocatedJson::parse_file(file);
  DiagnosticList faults;
  apply_overrides(overrides, document, faults);
  schema.validate(document, faults);
  ExperimentConfig config = ConfigReader(document, file, faults).read();
  faults.throw_if_any();
  config.resolved_json = resolved_json(config);
  return config;
}

}  // namespace penumbra
