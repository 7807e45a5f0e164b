// SPDX-License-Identifier: Apache-2.0
// Another NMT master on the line of a manager: two of them start and reset each other's nodes.
#pragma once

#include <cstdint>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"

namespace linegate::diagnosis {

// EventKind::foreign_manager: code.
inline constexpr std::uint32_t kForeignCommand = 1;      // an NMT command
inline constexpr std::uint32_t kForeignNegotiation = 2;  // a message of flying masters, CiA 302-2

// Sees the frames that only a master sends: node control on 000h, and 071h to 076h.
class ForeignManager {
 public:
  // As long as the other goes on it is told so often, once for each code.
  static constexpr Duration kInterval = std::chrono::seconds(10);

  // Registers 071h to 076h as Service::nmt with their identifier as index; 000h is the node's.
  // Both must outlive it.
  ForeignManager(can::Dispatch& dispatch, EventLog& events);

  // A frame that the own master has not sent, as Service::nmt with that index.
  void receive(std::uint16_t index, const can::Frame& frame);

 private:
  void tell(std::uint32_t code, std::uint32_t value, std::uint8_t addressed, Instant now);

  EventLog& events_;
  Instant told_[3]{};  // by code
};

}  // namespace linegate::diagnosis
