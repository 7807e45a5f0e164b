// SPDX-License-Identifier: Apache-2.0
#include "stack/od/description.h"

#include <algorithm>

namespace linegate::od {

namespace {

// objects: the objects of a device, ascending by index. Returns nullptr if the index does not
// exist.
template <class Objects>
auto* object_at(Objects& objects, std::uint16_t index) {
  const auto at = std::ranges::lower_bound(objects, index, {}, &ObjectDescription::index);
  return at != objects.end() && at->index == index ? &*at : nullptr;
}

template <class Objects>
auto* variable_at(Objects& objects, Address address) {
  auto* const object = object_at(objects, address.index);
  using Variable = decltype(object->variables.data());
  if (object == nullptr) {
    return Variable{};
  }
  auto& variables = object->variables;
  const auto at = std::ranges::lower_bound(variables, address.sub, {}, &VariableDescription::sub);
  return at != variables.end() && at->sub == address.sub ? &*at : Variable{};
}

}  // namespace

const ObjectDescription* DeviceDescription::find(std::uint16_t index) const {
  return object_at(objects, index);
}

const VariableDescription* DeviceDescription::find(Address address) const {
  return variable_at(objects, address);
}

VariableDescription* DeviceDescription::find(Address address) {
  return variable_at(objects, address);
}

}  // namespace linegate::od
