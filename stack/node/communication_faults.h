// SPDX-License-Identifier: Apache-2.0
// Which communication errors of the node are present: an EMCY tells the beginning of each, and an
// error reset the end of the last.
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
  rpdo_too_long,  // number: PDO; its frames are used all the same
  rpdo_deadline,  // number: PDO
  sync_length,    // number: 0, as of all below
  life_guarding,
  node_id,  // another device has it
  passive,  // the CAN controller is error passive
  bus_off,
  overrun,  // frames were lost
  mpdo,     // number: PDO; what it names is not available
};
inline constexpr std::size_t kFaults = 11;

// The emergency error code of each.
constexpr std::uint16_t emergency_code(Fault fault) {
  constexpr std::array<std::uint16_t, kFaults> kCodes{
      emcy::kHeartbeatError, emcy::kPdoLength,      emcy::kPdoTooLong,     emcy::kRpdoTimeout,
      emcy::kSyncLength,     emcy::kHeartbeatError, emcy::kIdCollision,    emcy::kPassive,
      emcy::kBusOffLeft,     emcy::kOverrun,        emcy::kMpdoDestination};
  return kCodes[static_cast<std::size_t>(fault)];
}

class CommunicationFaults {
 public:
  // True if it was not present before. Numbers above 512 are not kept: never true.
  bool begin(Fault fault, std::uint16_t number) {
    if (number >= kNumbers || of(fault)[number]) {
      return false;
    }
    of(fault).set(number);
    return true;
  }

  // True if it was present before.
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
