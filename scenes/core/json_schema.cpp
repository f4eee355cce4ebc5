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

/// Divisors of "multipleOf" as real numbers: by an integer valijson divides what it has cast to
/// one, which is undefined for 1e30.
json with_real_divisors(json schema) {
  if (!schema.is_structured()) return schema;
  for (auto child = schema.begin(); child != schema.end(); ++child) {
    const bool is_divisor =
        schema.is_object() && child.key() == "multipleOf" && child->is_number_integer();
    *child = is_divisor ? json(child->get<double>()) : with_real_divisors(std::move(*child));
  }
  return schema;
}

}  // namespace

struct JsonSchema::Impl {
  json text;           ///< as it was given, which is what messages explain
  json compiled_text;  ///< as valijson has it
  valijson::Schema compiled;
};

JsonSchema::JsonSchema(std::string_view text) : impl_(std::make_unique<Impl>()) {
  try {
    impl_->text = json::parse(text);
    valijson::SchemaParser parser;
    impl_->compiled_text = with_real_divisors(impl_->text);
    parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(impl_->compiled_text),
                          impl_->compiled);
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
