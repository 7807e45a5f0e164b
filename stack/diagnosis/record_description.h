// SPDX-License-Identifier: Apache-2.0
// Descriptions of the records in this folder. Private to stack/diagnosis.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "stack/od/description.h"

namespace linegate::diagnosis {

// Adds sub-index 0, the highest sub-index.
inline od::ObjectDescription record(std::uint16_t index, std::string name,
                                    std::vector<od::VariableDescription> members) {
  od::ObjectDescription out{
      .index = index, .name = std::move(name), .type = od::ObjectType::record};
  out.variables = std::move(members);
  const std::uint8_t highest = out.variables.back().sub;
  out.variables.insert(out.variables.begin(),
                       od::number_variable(0, "Highest sub-index", od::DataType::unsigned8,
                                           od::Access::constant, highest));
  return out;
}

}  // namespace linegate::diagnosis
