// SPDX-License-Identifier: Apache-2.0
// Frames of no CANopen service: sent as they are asked for, and told of to who listens (CANopenIA
// manual 6.2, 5F01h:0Bh). Private to stack/line.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/base/event_log.h"
#include "stack/base/result.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/line/command.h"
#include "stack/node/node.h"
#include "stack/pdo/link.h"

namespace linegate::line {

// The frame that a CommandKind::can_send means; bad_request if there is none such.
Error generic_frame(const Command& command, can::Frame& out);

// Whether the node receives or sends frames of that identifier, or would: NMT, the default SDO
// channels, error control and LSS of all nodes, what its services listen to, each COB-ID of its
// dictionary, and of linked PDOs (which need not have an object).
bool uses_identifier(node::Node& node, std::span<const pdo::LinkedPdo> linked,
                     const can::Frame& frame);

// CommandKind::can_send by that node: the frame waits for the bus behind everything else.
Error send_generic(node::Node& node, const can::Frame& frame);

// Who listens to what, and how many frames are told: a bus has room for thousands a second, which
// would drown everything else that happens.
class Listening {
 public:
  static constexpr std::uint32_t kMostASecond = 50;
  static constexpr std::uint16_t kLongest = 3600;  // seconds that one request is good for
  static constexpr std::size_t kFilters = 16;      // at a time
  static constexpr std::size_t kBytesAnEvent = 16;

  // A CommandKind::can_listen. bad_request, or busy: there are kFilters.
  Error ask(const Command& command, Instant now);

  // A frame that no service wanted. all: it is told although nobody asked for it.
  void hear(const can::Frame& frame, EventLog& events, bool all = false) {
    if (all || frame.time < end_) [[unlikely]] {
      match(frame, all, events);
    }
  }

 private:
  // Identifiers with bit 31 for 29-bit ones.
  struct Filter {
    std::uint32_t id = 0;
    std::uint32_t mask = 0;
    Instant end{};
  };
  void match(const can::Frame& frame, bool all, EventLog& events);
  bool admit(Instant now);
  void tell(const can::Frame& frame, EventLog& events);

  std::array<Filter, kFilters> filters_{};
  Instant end_{};  // of the last one
  Instant second_{};
  std::uint32_t told_ = 0;
  std::uint32_t withheld_ = 0;
};

}  // namespace linegate::line
