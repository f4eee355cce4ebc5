#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/core/located_json.h"

namespace penumbra {

/// Says in words what is wrong at a place that a validator found to be at fault; a part of
/// JsonSchema.
class SchemaExplainer {
 public:
  /// Both are referred to, not copied.
  SchemaExplainer(const nlohmann::json& schema, const LocatedJson& document);

  /// Adds one diagnostic per keyword that the value at the pointer itself breaks; none where only
  /// its parts are at fault.
  void explain(const std::string& pointer, DiagnosticList& diagnostics) const;

 private:
  using Schemas = std::vector<const nlohmann::json*>;

  /// The choice among the branches of a oneOf or anyOf.
  struct Choice {
    const nlohmann::json* branch{nullptr};  ///< null when no branch fits
    std::string discriminator;  ///< key whose constant names the branch; empty when there is none
    std::vector<std::string> names;  ///< its constants
    std::vector<std::string> types;  ///< JSON types of the branches
  };

  const nlohmann::json& resolve(const nlohmann::json& schema) const;
  Choice choose(const nlohmann::json& branches, const nlohmann::json& value) const;
  void collect(const nlohmann::json& schema, const nlohmann::json& value, Schemas& result) const;
  Schemas descend(const Schemas& schemas, const std::string& token,
                  const nlohmann::json& value) const;

  void explain_choice(const nlohmann::json& branches, const nlohmann::json& value,
                      const std::string& pointer, DiagnosticList& diagnostics) const;
  void explain_keys(const nlohmann::json& schema, const nlohmann::json& value,
                    const std::string& pointer, DiagnosticList& diagnostics) const;

  const nlohmann::json& schema_;
  const LocatedJson& document_;
};

}  // namespace penumbra
