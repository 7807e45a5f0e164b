// SPDX-License-Identifier: Apache-2.0
// Which values of a dictionary are parameters to be stored, and which of them a sub-index of 1010h
// and 1011h means (CiA 301, 7.5.2.13).
#pragma once

#include <cstdint>

#include "stack/od/description.h"

namespace linegate::storage {

// Sub-indices of 1010h and 1011h. From 4 on they are the manufacturer's: 4 means 2000h to 5FFFh.
inline constexpr std::uint8_t kAll = 1;
inline constexpr std::uint8_t kCommunication = 2;  // 1000h to 1FFFh
inline constexpr std::uint8_t kApplication = 3;    // 6000h to 9FFFh
inline constexpr std::uint8_t kManufacturer = 4;   // 2000h to 5FFFh

constexpr bool is_group(std::uint8_t sub) {
  return sub >= kAll && sub <= kManufacturer;
}
bool covers(std::uint8_t group, std::uint16_t index);

// Whether a value is a parameter by rule, for descriptions that do not say it (EDS files cannot):
// readable and writable, no DOMAIN, and
//   1000h to 1FFFh  all but what is no parameter: 1003h, 1010h, 1011h, 1013h, 1023h to 1026h, and
//                   the commands and program objects of CiA 302 from 1F20h on but for 1F80h to
//                   1F8Ah and 1F90h
//   2000h to 9FFFh  what cannot be mapped into a PDO: process data are no parameters
bool is_parameter(std::uint16_t index, const od::VariableDescription& variable);

// Sets the store flag of all parameters by that rule.
void mark_parameters(od::DeviceDescription& device);

}  // namespace linegate::storage
