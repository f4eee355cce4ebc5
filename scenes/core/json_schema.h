#pragma once

#include <memory>
#include <string_view>

#include "scenes/core/located_json.h"

/// Validation against a JSON Schema with messages for people.
namespace penumbra {

/// A compiled JSON Schema, draft 7.
///
/// valijson decides what is valid and which places are at fault; the message of a place is made
/// from the schema's keywords there (type, enum, const, pattern, bounds, sizes, required,
/// additionalProperties, uniqueItems). Where alternatives (oneOf, anyOf) exist, messages are about
/// one of them: the one whose constant key, such as "type", has the value given, else the one of
/// the same JSON type.
class JsonSchema {
 public:
  /// @param text  the schema; a fault in it is the programmer's and stops the program
  explicit JsonSchema(std::string_view text);
  ~JsonSchema();

  /// Adds one diagnostic per fault; nothing when the document is valid.
  void validate(const LocatedJson& document, DiagnosticList& diagnostics) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace penumbra
