// SPDX-License-Identifier: Apache-2.0
// CAN frames of no CANopen service as values of an object (CANopenIA manual 6.2, 5F0Ch): the
// sub-index is the number of data bytes, 1..8; the value U16 identifier of 11 bits, then the data.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/base/result.h"
#include "stack/can/frame.h"
#include "stack/od/description.h"

namespace linegate::diagnosis {

// OCTET_STRINGs. Sub-index 0 is the highest one, as in every record (CiA 301, 7.4.5.2), so that a
// frame without data has no place.
od::ObjectDescription frame_record(std::uint16_t index);

// The frame that is written. length_too_high, length_too_low; invalid_value for an identifier of
// more than 11 bits.
Result<can::Frame> frame_of(std::uint8_t sub, std::span<const std::byte> value);

// The last of each length that came.
class HeardFrames {
 public:
  // Frames that the record cannot hold (29 bits, remote, CAN FD) are left out.
  void note(const can::Frame& frame);
  // As the record holds it; empty if none came. length: 1..8.
  std::span<const std::byte> last(std::uint8_t length) const;

 private:
  struct Heard {
    std::array<std::byte, sizeof(std::uint16_t) + can::kMaxClassicData> bytes{};
    std::uint8_t size = 0;
  };
  std::array<Heard, can::kMaxClassicData + 1> heard_{};
};

}  // namespace linegate::diagnosis
