// SPDX-License-Identifier: Apache-2.0
// Detects another NMT master on the line of a manager: two masters start and reset each other's
// nodes.
#pragma once

#include <cstdint>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"

namespace linegate::diagnosis {

// Receives the frames that only a master sends: node control on 000h, and 071h to 076h.
class ForeignManager {
 public:
  // Shortest interval between two reports of the same evidence.
  static constexpr Duration kInterval = std::chrono::seconds(10);

  // Registers 071h to 076h as Service::nmt with their identifier as index; the node itself
  // registers 000h. Both references must outlive this object.
  ForeignManager(can::Dispatch& dispatch, EventLog& events);

  // Processes a frame of Service::nmt with that index that the own master did not send.
  void receive(std::uint16_t index, const can::Frame& frame);

 private:
  void report(const event::ForeignManager& what, Instant now);

  EventLog& events_;
  Instant reported_[3]{};  // time of the last report, by event::ManagerEvidence
};

}  // namespace linegate::diagnosis
