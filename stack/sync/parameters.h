// SPDX-License-Identifier: Apache-2.0
// The objects of SYNC (CiA 301, 7.5.2.5, 7.5.2.6, 7.5.2.22) as plain values, and the rules for
// writing them.
//   1005h  U32  COB-ID SYNC: bit 30 produce, bit 29 frame format, bits 0..28 CAN-ID
//   1006h  U32  communication cycle period in us, 0 = off
//   1007h  U32  synchronous window length in us, 0 = no window
//   1019h  U8   synchronous counter overflow value: 0 = no counter, 2..240
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/od/dictionary.h"

namespace linegate::sync {

struct Parameters {
  bool exists = false;  // object 1005h exists: the device supports SYNC
  can::CobId cob_id;
  Duration period{};
  std::uint8_t overflow = 0;
  Duration window{};

  // Bit 30 makes a producer, which sends if there is a period; other devices consume.
  bool is_producer() const { return exists && (cob_id.raw & can::CobId::kProducerBit) != 0; }
  // Length of a SYNC message in bytes: 1 with a counter, 0 without.
  std::uint8_t length() const { return overflow == 0 ? 0 : 1; }
};

// Missing objects count as 0.
Parameters read_parameters(const od::Dictionary& dictionary);

// Checks a value of the right size for one of the objects. Errors:
//   1005h  invalid_value: a restricted CAN-ID, more than 11 bits without bit 29, or another CAN-ID
//          while the device is a producer
//   1019h  invalid_value: 1 or above 240; device_state: a change while there is a period
AbortCode check_write(const Parameters& present, od::Address address,
                      std::span<const std::byte> value);

}  // namespace linegate::sync
