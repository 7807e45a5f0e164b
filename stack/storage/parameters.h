// SPDX-License-Identifier: Apache-2.0
// The values of a dictionary that are parameters to store, and the parameters that a sub-index of
// 1010h and 1011h refers to (CiA 301, 7.5.2.13).
#pragma once

#include <cstdint>

#include "stack/od/description.h"

namespace linegate::storage {

// Sub-indices of 1010h and 1011h. From 4 on they are manufacturer-specific: here 4 is 2000h to
// 5FFFh.
inline constexpr std::uint8_t kAll = 1;
inline constexpr std::uint8_t kCommunication = 2;  // 1000h to 1FFFh
inline constexpr std::uint8_t kApplication = 3;    // 6000h to 9FFFh
inline constexpr std::uint8_t kManufacturer = 4;   // 2000h to 5FFFh

constexpr bool is_group(std::uint8_t sub) {
  return sub >= kAll && sub <= kManufacturer;
}
bool covers(std::uint8_t group, std::uint16_t index);

// Whether a value is a parameter by rule, for descriptions that cannot specify it (EDS files):
// readable and writable, not a DOMAIN, and
//   1000h to 1FFFh  all except 1003h, 1010h, 1011h, 1013h, 1021h to 1026h, and of CiA 302 the DCFs
//                   and program objects (1F20h to 1F7Fh) and the requests 1F82h and 1F83h
//   2000h to 9FFFh  values that cannot be mapped into a PDO: process data are not parameters
bool is_parameter(std::uint16_t index, const od::VariableDescription& variable);

// Sets the store flag of all parameters by that rule.
void mark_parameters(od::DeviceDescription& device);

}  // namespace linegate::storage
