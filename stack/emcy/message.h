// SPDX-License-Identifier: Apache-2.0
// The emergency message (CiA 301, 7.2.7): 8 bytes on CAN-ID 80h + node-ID.
//   bytes 0..1  emergency error code
//   byte 2      error register, object 1001h
//   bytes 3..7  manufacturer-specific error code
//
// CiA 1301 gives the EMCY of CANopen FD more fields, and its layout is not public. OWN definition,
// in an FD frame of 20 bytes with the same CAN-ID:
//   bytes 0..2    as above
//   byte 3        logical device, 1..8; 0 = all
//   bytes 4..5    number of the CiA profile
//   byte 6        status: bit 0 the error is active, bit 1 it needs a reset, bits 4..7 its class
//   bytes 8..13   TIME_OF_DAY of the error; all 0: not known
//   bytes 14..18  manufacturer-specific error code
//   bytes 7, 19   0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "stack/base/event.h"
#include "stack/base/events.h"
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
  event::FdEmcy fd{};

  friend bool operator==(const Message&, const Message&) = default;
};

// Bits of FdEmcy::status.
inline constexpr std::uint8_t kStatusActive = 0x01;
inline constexpr std::uint8_t kStatusNeedsReset = 0x02;

// An FD frame if message.fd has any.
can::Frame encode(const Message& message, can::CobId cob_id);
// Returns nothing if the frame does not have 8 bytes.
std::optional<Message> decode(const can::Frame& frame);
// Returns nothing if it is no FD frame of 20 bytes. Reserved bytes and bits are ignored.
std::optional<Message> decode_fd(const can::Frame& frame);

// ", logical device 1, profile 402, active, class 3, at 2026-11-30 12:00:00.250": what is there.
std::string fd_text(const event::FdEmcy& fields);

// Data: event::Emcy or event::EmcySent.
template <class Data>
Data to_event(const Message& message) {
  return {.code = message.code,
          .error_register = message.error_register,
          .manufacturer = message.info,
          .fd = message.fd};
}

}  // namespace linegate::emcy
