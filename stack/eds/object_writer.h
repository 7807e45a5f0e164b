// SPDX-License-Identifier: Apache-2.0
// Writing one object of an EDS or DCF with all its sub-indices; private to stack/eds.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "stack/od/description.h"

namespace linegate::eds {

// Text of sections and keys.
class SectionText {
 public:
  void section(std::string_view name);
  void entry(std::string_view key, std::string_view value);  // made one line
  void entry(std::string_view key, std::uint64_t value);     // decimal
  void flag(std::string_view key, bool value);
  // Nothing if the value is empty.
  void text(std::string_view key, std::string_view value);

  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

struct WriteOptions {
  bool dcf = false;          // with configured values and what else only a DCF has
  std::uint8_t node_id = 0;  // what formulas were resolved with
};

// prefix: of the names of sections, "M1Fixed" or nothing. Arrays of equal elements become a
// CompactSubObj.
void write_object(SectionText& out, std::string_view prefix, const od::ObjectDescription& object,
                  const WriteOptions& options);

// The keys of a value, from ParameterName on, without section.
void write_variable(SectionText& out, const od::VariableDescription& variable,
                    const WriteOptions& options);

}  // namespace linegate::eds
