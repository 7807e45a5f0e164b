// SPDX-License-Identifier: Apache-2.0
// The emergency message (CiA 301, 7.2.7): 8 bytes on CAN-ID 80h + node-ID.
//   bytes 0..1  emergency error code
//   byte 2      error register, object 1001h
//   bytes 3..7  manufacturer-specific error code
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "stack/base/event.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"

namespace linegate::emcy {

// Bits of the error register, object 1001h.
enum ErrorRegister : std::uint8_t {
  kGeneric = 0x01,
  kCurrent = 0x02,
  kVoltage = 0x04,
  kTemperature = 0x08,
  kCommunication = 0x10,
  kProfile = 0x20,
  kManufacturer = 0x80,
};

// Emergency error codes of the stack itself.
inline constexpr std::uint16_t kErrorReset = 0x0000;
inline constexpr std::uint16_t kDataSet = 0x6300;  // stored parameters cannot be used
inline constexpr std::uint16_t kOverrun = 0x8110;  // frames were lost
inline constexpr std::uint16_t kPassive = 0x8120;
inline constexpr std::uint16_t kHeartbeatError = 0x8130;  // heartbeat or life guarding
inline constexpr std::uint16_t kBusOffLeft = 0x8140;
inline constexpr std::uint16_t kIdCollision = 0x8150;
inline constexpr std::uint16_t kPdoLength = 0x8210;        // the PDO was not processed
inline constexpr std::uint16_t kPdoTooLong = 0x8220;       // the first bytes were used
inline constexpr std::uint16_t kMpdoDestination = 0x8230;  // destination of an MPDO not available
inline constexpr std::uint16_t kSyncLength = 0x8240;       // unexpected SYNC data length
inline constexpr std::uint16_t kRpdoTimeout = 0x8250;

using ManufacturerInfo = std::array<std::byte, 5>;

struct Message {
  std::uint16_t code = kErrorReset;
  std::uint8_t error_register = 0;
  ManufacturerInfo info{};

  friend bool operator==(const Message&, const Message&) = default;
};

can::Frame encode(const Message& message, can::CobId cob_id);
// Returns nothing if the frame does not have 8 bytes.
std::optional<Message> decode(const can::Frame& frame);

// Data: event::Emcy or event::EmcySent.
template <class Data>
Data to_event(const Message& message) {
  return {
      .code = message.code, .error_register = message.error_register, .manufacturer = message.info};
}

}  // namespace linegate::emcy
