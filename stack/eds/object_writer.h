// SPDX-License-Identifier: Apache-2.0
// Writes one object of an EDS or DCF with all its sub-indices; private to stack/eds.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "stack/od/description.h"

namespace linegate::eds {

// The text of sections and keys.
class SectionText {
 public:
  void section(std::string_view name);
  void entry(std::string_view key, std::string_view value);  // converted to one line
  void entry(std::string_view key, std::uint64_t value);     // decimal
  void flag(std::string_view key, bool value);
  // Writes nothing if the value is empty.
  void text(std::string_view key, std::string_view value);

  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

struct WriteOptions {
  bool dcf = false;          // include configured values and the other keys that only a DCF has
  std::uint8_t node_id = 0;  // node-ID used to resolve the formulas
};

// prefix: prefix of the section names, "M1Fixed" or empty. Arrays of equal elements become a
// CompactSubObj.
void write_object(SectionText& out, std::string_view prefix, const od::ObjectDescription& object,
                  const WriteOptions& options);

// The keys of a value, from ParameterName on, without the section header.
void write_variable(SectionText& out, const od::VariableDescription& variable,
                    const WriteOptions& options);

}  // namespace linegate::eds
