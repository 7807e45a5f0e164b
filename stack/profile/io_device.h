// SPDX-License-Identifier: Apache-2.0
// A generic I/O module (CiA 401) as a plain description, equivalent to an EDS file.
#pragma once

#include <cstdint>
#include <string>

#include "stack/od/description.h"

namespace linegate::profile {

// The inputs and outputs of the module; each 0..254, not all 0.
struct IoBlocks {
  unsigned digital_inputs = 0;    // 8-bit blocks: 6000h
  unsigned digital_outputs = 0;   // 8-bit blocks: 6200h
  unsigned analogue_inputs = 0;   // 16-bit channels: 6401h
  unsigned analogue_outputs = 0;  // 16-bit channels: 6411h
};
inline constexpr unsigned kMostIoBlocks = 254;

// The low word of 1000h.
inline constexpr std::uint16_t kIoProfile = 401;

// Returns a device with the default PDO mapping of CiA 401: TPDO 1 has the first 8 digital inputs,
// TPDO 2 to 4 have analogue inputs 1 to 4, 5 to 8 and 9 to 12; RPDO 1 to 4 have the outputs
// likewise. PDOs without objects to map are invalid (bit 31 of the COB-ID). All are event-driven;
// the master may change the mapping. name: 1008h. node_id: 1..127. stores: with 1010h, 1011h and
// 1020h.
od::DeviceDescription make_io_device(const IoBlocks& blocks, const std::string& name,
                                     std::uint8_t node_id, bool stores = false);

}  // namespace linegate::profile
