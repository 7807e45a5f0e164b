// SPDX-License-Identifier: Apache-2.0
#include "stack/od/description.h"

#include <algorithm>

namespace linegate::od {

const ObjectDescription* DeviceDescription::find(std::uint16_t index) const {
  const auto at =
      std::lower_bound(objects.begin(), objects.end(), index,
                       [](const ObjectDescription& o, std::uint16_t i) { return o.index < i; });
  return at != objects.end() && at->index == index ? &*at : nullptr;
}

const VariableDescription* DeviceDescription::find(Address address) const {
  const ObjectDescription* object = find(address.index);
  if (object == nullptr) {
    return nullptr;
  }
  const auto& variables = object->variables;
  const auto at =
      std::lower_bound(variables.begin(), variables.end(), address.sub,
                       [](const VariableDescription& v, std::uint8_t s) { return v.sub < s; });
  return at != variables.end() && at->sub == address.sub ? &*at : nullptr;
}

}  // namespace linegate::od
