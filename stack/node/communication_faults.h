// SPDX-License-Identifier: Apache-2.0
// The communication errors that are present in the node: the beginning of each causes an EMCY, the
// end of the last one an error reset.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>

#include "stack/emcy/message.h"

namespace linegate::node {

enum class Fault : std::uint8_t {
  heartbeat,      // number: node-ID
  rpdo_length,    // number: PDO
  rpdo_too_long,  // number: PDO; its frames are used nevertheless
  rpdo_deadline,  // number: PDO
  sync_length,    // number: 0, also for those below
  life_guarding,
  node_id,  // another device has this node's node-ID
  passive,  // the CAN controller is error passive
  bus_off,
  overrun,  // frames were lost
  mpdo,     // number: PDO; its MPDO addresses an unavailable object
};
inline constexpr std::size_t kFaults = 11;

// Emergency error code (CiA 301 7.2.7.1).
constexpr std::uint16_t emergency_code(Fault fault) {
  constexpr std::array<std::uint16_t, kFaults> kCodes{
      emcy::kHeartbeatError, emcy::kPdoLength,      emcy::kPdoTooLong,     emcy::kRpdoTimeout,
      emcy::kSyncLength,     emcy::kHeartbeatError, emcy::kIdCollision,    emcy::kPassive,
      emcy::kBusOffLeft,     emcy::kOverrun,        emcy::kMpdoDestination};
  return kCodes[static_cast<std::size_t>(fault)];
}

class CommunicationFaults {
 public:
  // Returns true if the error was not present before. Numbers above 512 are not stored: false.
  bool begin(Fault fault, std::uint16_t number) {
    if (number >= kNumbers || of(fault)[number]) {
      return false;
    }
    of(fault).set(number);
    return true;
  }

  // Returns true if the error was present before.
  bool end(Fault fault, std::uint16_t number) {
    if (number >= kNumbers || !of(fault)[number]) {
      return false;
    }
    of(fault).reset(number);
    return true;
  }

  bool any(Fault fault) const { return faults_[static_cast<std::size_t>(fault)].any(); }
  void clear() { *this = CommunicationFaults{}; }

 private:
  static constexpr std::size_t kNumbers = 513;

  std::bitset<kNumbers>& of(Fault fault) { return faults_[static_cast<std::size_t>(fault)]; }

  std::array<std::bitset<kNumbers>, kFaults> faults_{};
};

}  // namespace linegate::node
