// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/error_state.h"

#include "stack/base/assert.h"
#include "stack/emcy/message.h"

namespace linegate::emcy {
namespace {

constexpr bool has(std::uint8_t bits, std::size_t bit) {
  return (bits >> bit & 1U) != 0;
}

constexpr bool is_communication(std::uint16_t code) {
  return code >> 8U == 0x81 || code >> 8U == 0x82;
}

}  // namespace

std::uint8_t register_of(std::uint16_t code) {
  switch (code >> 12U) {
    case 0x0:
      return code >> 8U == 0 ? std::uint8_t{0} : std::uint8_t{kGeneric};
    case 0x2:
      return kGeneric | kCurrent;
    case 0x3:
      return kGeneric | kVoltage;
    case 0x4:
      return kGeneric | kTemperature;
    case 0x8:
      return is_communication(code) ? std::uint8_t{kGeneric | kCommunication}
                                    : std::uint8_t{kGeneric};
    case 0xF:
      return code >> 8U == 0xFF ? std::uint8_t{kGeneric | kProfile} : std::uint8_t{kGeneric};
    default:
      return kGeneric;
  }
}

std::uint8_t ErrorState::begin(std::uint16_t code, std::uint8_t present) {
  return begin_bits(register_of(code), present);
}

std::uint8_t ErrorState::end(std::uint16_t code, std::uint8_t present) {
  return end_bits(register_of(code), present);
}

std::uint8_t ErrorState::begin_bits(std::uint8_t bits, std::uint8_t present) {
  ++errors_;
  for (std::size_t bit = 0; bit < needed_.size(); ++bit) {
    if (has(bits, bit) && needed_[bit]++ == 0 && !has(present, bit)) {
      ours_ = static_cast<std::uint8_t>(ours_ | 1U << bit);
    }
  }
  return present | bits;
}

std::uint8_t ErrorState::end_bits(std::uint8_t bits, std::uint8_t present) {
  LINEGATE_ASSERT(errors_ > 0, "an error that ends has begun");
  unsigned gone = 0;
  --errors_;
  for (std::size_t bit = 0; bit < needed_.size(); ++bit) {
    LINEGATE_ASSERT(!has(bits, bit) || needed_[bit] > 0, "an error of the class has begun");
    if (has(bits, bit) && --needed_[bit] == 0) {
      gone |= ours_ & 1U << bit;
    }
  }
  ours_ = static_cast<std::uint8_t>(ours_ & ~gone);
  return static_cast<std::uint8_t>(present & ~gone);
}

}  // namespace linegate::emcy
