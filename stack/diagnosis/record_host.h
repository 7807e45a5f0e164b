// SPDX-License-Identifier: Apache-2.0
// What the CANopenIA records ask of the line, and order of it.
#pragma once

#include <cstdint>

#include "stack/base/abort_code.h"
#include "stack/can/frame.h"

namespace linegate::diagnosis {

class RecordHost {
 public:
  virtual ~RecordHost() = default;

  struct Transmission {
    bool fd = false;       // the interface is one of CAN FD
    bool waiting = false;  // something waits for the bus, or for its inhibit time
    bool overrun = false;  // a queue was too full for a frame since the line was made
  };
  virtual Transmission transmission() const = 0;

  // Whether the node, 1..127, can be scanned now, and the TPDO triggered that is RPDO `number` of
  // the node: none; invalid_value for what is not there; local_control if the line does not manage;
  // device_state if it is not the time for it.
  virtual AbortCode may_scan(std::uint8_t node) const = 0;
  virtual AbortCode may_trigger(std::uint8_t node, std::uint8_t number) const = 0;

  // Sends a frame behind all else. local_control if a service uses its identifier, device_state if
  // there is no bus or no room.
  virtual AbortCode transmit(const can::Frame& frame) = 0;
};

}  // namespace linegate::diagnosis
