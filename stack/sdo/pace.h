// SPDX-License-Identifier: Apache-2.0
// Limits the rate of SDO frames that the transfers of clients send.
#pragma once

#include <cstdint>

namespace linegate::sdo {

class Pace {
 public:
  Pace() = default;
  Pace(const Pace&) = delete;
  Pace& operator=(const Pace&) = delete;
  virtual ~Pace() = default;

  // Whether a request to the server of this node may be sent now. If not, it is tried again after
  // Outbox::kRetry, and the time-out of its response begins when it is sent.
  virtual bool permits(std::uint8_t node) const = 0;
  // A frame of a transfer with this node was queued for the bus, or received.
  virtual void count(std::uint8_t node) = 0;
};

}  // namespace linegate::sdo
