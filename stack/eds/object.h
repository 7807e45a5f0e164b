// One object of an EDS with all its sub-indices; private to stack/eds.
#pragma once

#include <cstdint>
#include <optional>

#include "stack/eds/sections.h"
#include "stack/eds/variable.h"

namespace linegate::eds {

// Nothing if the object has no value of its own (NULL, data types below 1000h) or its description
// cannot be used; the latter is reported. sections.object must not be nullptr.
std::optional<od::ObjectDescription> read_object(std::uint16_t index,
                                                 const ObjectSections& sections, Context& context);

}  // namespace linegate::eds
