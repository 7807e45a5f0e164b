// SPDX-License-Identifier: Apache-2.0
#include "stack/node/mandatory_objects.h"

#include <string>
#include <utility>

#include "stack/can/cob_id.h"
#include "stack/od/number_variable.h"

namespace linegate::node {
namespace {

od::ObjectDescription object(std::uint16_t index, std::string name, od::DataType type,
                             od::Access access, std::uint64_t value) {
  od::ObjectDescription out;
  out.index = index;
  out.name = name;
  out.variables.push_back(od::number_variable(0, std::move(name), type, access, value));
  return out;
}

od::ObjectDescription identity() {
  using enum od::DataType;
  od::ObjectDescription out;
  out.index = 0x1018;
  out.name = "Identity object";
  out.type = od::ObjectType::record;
  out.variables = {
      od::number_variable(0, "Highest sub-index supported", unsigned8, od::Access::constant, 4),
      od::number_variable(1, "Vendor-ID", unsigned32, od::Access::ro, 0),
      od::number_variable(2, "Product code", unsigned32, od::Access::ro, 0),
      od::number_variable(3, "Revision number", unsigned32, od::Access::ro, 0),
      od::number_variable(4, "Serial number", unsigned32, od::Access::ro, 0),
  };
  return out;
}

void add_missing(od::Dictionary& dictionary, const od::ObjectDescription& object) {
  if (!dictionary.has_object(object.index)) {
    (void)dictionary.add(object).ok();
  }
}

}  // namespace

void add_mandatory_objects(od::Dictionary& dictionary, std::uint8_t node_id) {
  using enum od::DataType;
  using enum od::Access;
  add_missing(dictionary, object(0x1000, "Device type", unsigned32, ro, 0));
  add_missing(dictionary, object(0x1001, "Error register", unsigned8, ro, 0));
  add_missing(dictionary, object(0x1014, "COB-ID EMCY", unsigned32, rw, can::kEmcyBase + node_id));
  add_missing(dictionary, object(0x1017, "Producer heartbeat time", unsigned16, rw, 0));
  add_missing(dictionary, identity());
}

}  // namespace linegate::node
