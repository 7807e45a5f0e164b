// SPDX-License-Identifier: Apache-2.0
// One section that describes a value: a VAR, a sub-index, or the elements of a CompactSubObj;
// private to stack/eds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "stack/eds/fields.h"
#include "stack/od/description.h"

namespace linegate::eds {

// What the parts of the reader share.
struct Context {
  Report& report;
  std::uint8_t node_id = 0;           // 0: none is known
  bool is_dcf = false;                // the file configures one device
  bool missing_node_id_told = false;  // once is enough
  std::size_t expanded = 0;           // bytes that CompactSubObj made of few lines so far
};

// AccessType; ro, with a warning, if it is none.
od::Access read_access(const Entry& entry, Report& report);

// ParameterName; that of the section, with a warning, if it is missing.
std::string read_name(const Fields& fields, Context& context);

// Nothing if the data type cannot be told; that is an error if the section configures a value.
std::optional<od::VariableDescription> read_variable(const Section& section, std::uint8_t sub,
                                                     Context& context);

// Gives variable the value of the entry. A DefaultValue that is wrong is a warning, for the device
// knows its own; a configured value that is wrong is an error, for it would be written.
void read_value(const Entry& entry, bool configured, od::VariableDescription& variable,
                Context& context);

}  // namespace linegate::eds
