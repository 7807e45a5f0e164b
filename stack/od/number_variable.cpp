// SPDX-License-Identifier: Apache-2.0
#include "stack/base/assert.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::od {

ObjectDescription catalogued_variable(std::uint16_t index, Access access, std::uint64_t value) {
  const objects::Entry& entry = objects::at(index);
  LINEGATE_ASSERT(entry.object == ObjectType::variable, "the object is a VAR");
  ObjectDescription out{.index = index, .name = std::string(entry.name)};
  out.variables.push_back(number_variable(0, out.name, entry.type, access, value));
  return out;
}

ObjectDescription identity_object(std::uint32_t vendor, std::uint32_t product,
                                  std::uint32_t revision, std::uint32_t serial) {
  using enum DataType;
  ObjectDescription out{.index = objects::kIdentity,
                        .name = std::string(objects::at(objects::kIdentity).name),
                        .type = ObjectType::record};
  out.variables = {
      number_variable(0, "Highest sub-index supported", unsigned8, Access::constant, 4),
      number_variable(1, "Vendor-ID", unsigned32, Access::ro, vendor),
      number_variable(2, "Product code", unsigned32, Access::ro, product),
      number_variable(3, "Revision number", unsigned32, Access::ro, revision),
      number_variable(4, "Serial number", unsigned32, Access::ro, serial)};
  return out;
}

}  // namespace linegate::od
