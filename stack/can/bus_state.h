// SPDX-License-Identifier: Apache-2.0
// Reports of a CAN controller and its driver about the bus itself.
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/base/time.h"

namespace linegate::can {

// Fault confinement states of ISO 11898-1, and states of an interface. New states are only
// appended, because these numbers are part of the DDS contract.
enum class BusState : std::uint8_t {
  unknown,        // not reported yet
  error_active,   // normal operation
  error_warning,  // an error counter above 95
  error_passive,  // an error counter above 127
  bus_off,        // transmit error counter above 255: the controller has left the bus
  stopped,        // the interface is down
  absent,         // there is no such interface
};

// "error-active" and so on.
std::string_view name(BusState state);

// Classes of CAN error frames, as bits.
enum BusErrorClass : std::uint32_t {
  kTxTimeout = 0x01,
  kLostArbitration = 0x02,
  kController = 0x04,
  kProtocol = 0x08,
  kTransceiver = 0x10,
  kNoAcknowledge = 0x20,
  kRestarted = 0x40,
};

// An observation of a bridge other than a frame.
struct BusEvent {
  enum class Kind : std::uint8_t {
    state,             // state is the new state; counters if known
    error,             // errors has BusErrorClass bits
    frames_lost,       // count: frames lost before the bridge could read them
    interface_failed,  // code is an errno
    interface_ready,
  };
  Kind kind = Kind::state;
  BusState state = BusState::unknown;
  std::uint8_t transmit_errors = 0;  // TEC
  std::uint8_t receive_errors = 0;   // REC
  std::uint32_t errors = 0;
  std::uint32_t count = 0;
  std::uint32_t code = 0;
  Instant time{};
};

}  // namespace linegate::can
