// SPDX-License-Identifier: Apache-2.0
// One object of an EDS with all its sub-indices; private to stack/eds.
#pragma once

#include <cstdint>
#include <optional>

#include "stack/eds/sections.h"
#include "stack/eds/variable.h"

namespace linegate::eds {

inline constexpr std::uint8_t kMostElements = 254;  // sub-indices of an object, without 0

// Whether the object has sub-indices of its own: an array, a record or a DEFSTRUCT.
bool has_subs(od::ObjectType type);

// Nothing if the object has no value of its own (NULL, data types below 1000h) or its description
// cannot be used; the latter is reported. sections.object must not be nullptr.
std::optional<od::ObjectDescription> read_object(std::uint16_t index,
                                                 const ObjectSections& sections, Context& context);

// Sub-index 0 of an object whose highest sub-index is value.
od::VariableDescription count_variable(std::uint8_t value, std::uint32_t line);

// False, and one error for the file, if count elements more like pattern make too much of too
// little text.
bool charge(Context& context, const od::VariableDescription& pattern, unsigned count, Place place);

}  // namespace linegate::eds
