#include "scenes/core/json_schema.h"

#include <exception>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>
#include <vector>

#include "scenes/core/error.h"
#include "scenes/core/json_schema_explain.h"

namespace penumbra {

using nlohmann::json;

namespace {

/// valijson's path is "<root>", "[key]", "[3]", ...
std::string pointer_of(const std::vector<std::string>& context) {
  std::string pointer;
  for (std::size_t i = 1; i < context.size(); ++i) {
    const std::string_view token = context[i];
    pointer = child_pointer(pointer, token.substr(1, token.size() - 2));
  }
  return pointer;
}

}  // namespace

struct JsonSchema::Impl {
  json text;
  valijson::Schema compiled;
};

JsonSchema::JsonSchema(std::string_view text) : impl_(std::make_unique<Impl>()) {
  try {
    impl_->text = json::parse(text);
    valijson::SchemaParser parser;
    parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(impl_->text), impl_->compiled);
  } catch (const std::exception& e) {
    PN_CHECK(false, e.what());
  }
}

JsonSchema::~JsonSchema() = default;

void JsonSchema::validate(const LocatedJson& document, DiagnosticList& diagnostics) const {
  valijson::ValidationResults results;
  const valijson::adapters::NlohmannJsonAdapter target(document.root());
  if (valijson::Validator().validate(impl_->compiled, target, &results)) return;

  // valijson also reports every parent of a fault, and the faults of alternatives that were not
  // meant. Only a place that breaks a keyword of its own schema is explained, so those drop out.
  std::set<std::string> places;
  for (const auto& error : results) places.insert(pointer_of(error.context));
  DiagnosticList found;
  const SchemaExplainer explainer(impl_->text, document);
  for (const std::string& place : places) explainer.explain(place, found);

  // A keyword that the explainer does not know must not let an invalid document pass.
  if (found.empty()) {
    const auto& error = *results.begin();
    const std::string pointer = pointer_of(error.context);
    found.add(document.value_at(pointer), pointer, error.description);
  }
  for (const Diagnostic& d : found.all()) diagnostics.add(d.location, d.pointer, d.message);
}

}  // namespace penumbra
