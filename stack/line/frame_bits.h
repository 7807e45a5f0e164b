// SPDX-License-Identifier: Apache-2.0
// How long a frame occupies the bus (ISO 11898-1): start of frame to intermission.
#pragma once

#include <cstdint>

#include "stack/can/frame.h"

namespace linegate::line {

struct BitRates {
  std::uint32_t nominal = 0;  // bit/s; 0 = unknown
  std::uint32_t data = 0;     // of the data phase of FD frames with bit rate switch; 0 = unknown

  bool operator==(const BitRates&) const = default;
};

// Without stuff bits: those of a frame without data, standard and extended.
inline constexpr std::uint64_t kStandardBits = 47;
inline constexpr std::uint64_t kExtendedBits = 67;
// Bits of an FD frame with standard identifier at the nominal bit rate: from start of frame to BRS,
// and from the CRC delimiter to the intermission.
inline constexpr std::uint64_t kFdArbitrationBits = 30;

// Bits of the data phase of an FD frame: ESI, DLC, data, stuff count and CRC with its fixed stuff
// bits. Without the stuff bits of the data.
std::uint64_t data_phase_bits(std::uint8_t length);

// The bits of a frame on the bus with the mean of stuff bits, a tenth, in bit times of the nominal
// bit rate. A data phase at an unknown bit rate counts as one at the nominal bit rate.
std::int64_t bits_on_bus(const can::Header& header, const BitRates& rates = {});

}  // namespace linegate::line
