// SPDX-License-Identifier: Apache-2.0
// The length of a frame on the wire (ISO 11898-1): bits with stuffing and CRC, and their time.
#pragma once

#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::can {

inline constexpr unsigned kIntermissionBits = 3;

// Bits of a frame from start of frame to the last bit of end of frame, without the intermission.
struct WireBits {
  unsigned nominal = 0;  // sent at the nominal bit rate
  unsigned data = 0;     // sent at the data bit rate: only FD frames with bit rate switch
};

// Exact for classical frames: the CRC-15 is computed and the stuff bits of the actual bytes are
// counted. In FD frames the stuff bits up to the end of the data are counted, and those of the CRC
// field have fixed places; the two bits in which the bit rate changes (BRS, CRC delimiter) count as
// nominal. Precondition: length is valid for the frame format.
WireBits wire_bits(const Frame& frame);

// Time from start of frame to the last bit, each phase rounded to a nanosecond. Bit rates in bit/s,
// > 0; data_bit_rate is used only for FD frames with bit rate switch.
Duration wire_time(const Frame& frame, std::uint32_t bit_rate, std::uint32_t data_bit_rate);

// The duration of `bits` bits, rounded to a nanosecond. bit_rate > 0.
Duration bit_time(unsigned bits, std::uint32_t bit_rate);

// CRC-15 of a classical frame, over the unstuffed bits from start of frame to the end of the data.
std::uint16_t crc15(const Frame& frame);

}  // namespace linegate::can
