// SPDX-License-Identifier: Apache-2.0
// Changing a device description to what the configuration will make of the device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gateway/config/reader.h"
#include "stack/od/description.h"

namespace linegate::config {

// Where PDOs are described: what is written there changes how the line links them.
constexpr bool is_pdo_record(std::uint16_t index) {
  return index >= 0x1400 && index <= 0x1BFF;
}

// nullptr if there is no such object or sub-index.
od::VariableDescription* find_variable(od::DeviceDescription& device, od::Address address);

// The value the device will have once it is configured. Nothing happens without such a variable.
void set_value(od::DeviceDescription& device, od::Address address,
               const std::vector<std::byte>& value);

// Reports a COB-ID of a PDO that is valid and not allowed: 000h or restricted (CiA 301 7.3.5).
void check_pdo_cob_id(Findings& findings, Place place, od::Address address,
                      const std::vector<std::byte>& value);

}  // namespace linegate::config
