// SPDX-License-Identifier: Apache-2.0
// Frames that belong to no CANopen service: sent on command, and reported to listeners (CANopenIA
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

// bad_request if the frame is invalid: an identifier with too many bits, a length that the format
// does not have, or contradictory flags.
Error check_frame(const can::Frame& frame);

// Whether the node receives or sends frames with that identifier, or could: NMT, the default SDO
// channels, error control and LSS of all nodes, the identifiers that its services receive, each
// COB-ID of its dictionary, and of linked PDOs (which may have no object).
bool uses_identifier(node::Node& node, std::span<const pdo::LinkedPdo> linked,
                     const can::Frame& frame);

// CommandKind::can_send by that node: queues the frame behind all others.
Error send_generic(node::Node& node, const can::Frame& frame);

// The filters of listeners, and the limit of reported frames: a bus carries thousands of frames a
// second, which would displace all other events.
class Listening {
 public:
  static constexpr std::uint32_t kMostASecond = 50;
  static constexpr std::uint16_t kLongest = 3600;  // seconds that one request lasts at most
  static constexpr std::size_t kFilters = 16;      // filters at the same time
  static constexpr std::size_t kBytesAnEvent = event::CanFrame::kPieceBytes;

  // Executes a request. bad_request, or busy: kFilters exist.
  Error ask(const CanListen& request, Instant now);

  // Pass it each frame that no service uses. all: report it even if no filter matches.
  void hear(const can::Frame& frame, EventLog& events, bool all = false) {
    if (all || frame.time < end_) [[unlikely]] {
      match(frame, all, events);
    }
  }

 private:
  // Identifiers have bit 31 set if they are 29-bit ones.
  struct Filter {
    std::uint32_t id = 0;
    std::uint32_t mask = 0;
    Instant end{};
  };
  void match(const can::Frame& frame, bool all, EventLog& events);
  bool admit(Instant now);
  void report(const can::Frame& frame, EventLog& events);

  std::array<Filter, kFilters> filters_{};
  Instant end_{};  // of the filter that ends last
  Instant second_{};
  std::uint32_t reported_ = 0;
  std::uint32_t withheld_ = 0;
};

}  // namespace linegate::line
