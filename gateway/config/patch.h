// SPDX-License-Identifier: Apache-2.0
// Changes a device description to the state that the configuration gives the device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gateway/config/reader.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::config {

// Whether the object describes a PDO: a value written there changes how the line links it.
constexpr bool is_pdo_record(std::uint16_t index) {
  return od::objects::is_pdo_record(index);
}

// nullptr if there is no such object or sub-index.
od::VariableDescription* find_variable(od::DeviceDescription& device, od::Address address);

// Sets the value that the device has after its configuration. No effect without such a variable.
void set_value(od::DeviceDescription& device, od::Address address,
               const std::vector<std::byte>& value);

// Reports a valid COB-ID of a PDO that is not permitted: 000h or restricted (CiA 301 7.3.5).
void check_pdo_cob_id(Findings& findings, Place place, od::Address address,
                      const std::vector<std::byte>& value);

}  // namespace linegate::config
