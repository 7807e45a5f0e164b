// SPDX-License-Identifier: Apache-2.0
// Limits the rate of the frames that requests of clients cause: SDO transfers, and the procedures
// that a command of a client started.
#pragma once

#include <cstdint>

#include "stack/can/frame.h"

namespace linegate::sdo {

// Clients have the numbers of line::Command::client; 0 = no client. Frames without a client are
// neither limited nor counted.
class Pace {
 public:
  Pace() = default;
  Pace(const Pace&) = delete;
  Pace& operator=(const Pace&) = delete;
  virtual ~Pace() = default;

  // Whether a frame of this client, not 0, may be sent now. If not, it is tried again after
  // Outbox::kRetry, and the time-out of its response begins when it is sent. awaited: another
  // client waits for the end of the transfer.
  virtual bool permits(std::uint32_t client, bool awaited) const = 0;
  // A frame that this client, not 0, caused was queued for the bus, or received.
  virtual void count(std::uint32_t client, const can::Header& frame) = 0;
  // The same for a classical frame with 8 bytes.
  void count(std::uint32_t client) { count(client, {.length = can::kMaxClassicData}); }
};

}  // namespace linegate::sdo
