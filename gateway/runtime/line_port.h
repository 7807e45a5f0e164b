// SPDX-License-Identifier: Apache-2.0
// What one line and the rest of the gateway hand each other. Each member has one producing and one
// consuming thread.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "bridges/can/controller_setup.h"
#include "gateway/exchange/cell.h"
#include "gateway/exchange/handover.h"
#include "gateway/exchange/ring.h"
#include "gateway/runtime/scan_taker.h"
#include "stack/base/event.h"
#include "stack/image/snapshot.h"
#include "stack/line/command.h"
#include "stack/line/config.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/pdo/reception.h"
#include "stack/routing/table.h"

namespace linegate::gateway {

// What waits where. Counted outside the line, which knows no queue but its own.
struct QueueDepths {
  // Frames: the most that one turn of the executor found in the interface since the last status.
  std::uint32_t receive_peak = 0;
  std::uint32_t transmit = 0;         // frames taken out of the line, not taken by the interface
  std::uint64_t transmit_stalls = 0;  // times the interface did not take all: back-pressure
  std::uint32_t events = 0;           // for the publisher
  std::uint64_t route_stalls = 0;     // times that a link to another line was full

  // An earlier one that nobody has seen: its peak counts too.
  void merge(const QueueDepths& earlier) {
    receive_peak = std::max(receive_peak, earlier.receive_peak);
  }
};

struct LineStatus {
  line::LineState state;
  QueueDepths queues;
  can_bridge::ControllerSetup controller;  // what it is set to, where that is known
  Duration sync_period{};                  // of the SYNC that the own node produces; 0 = none
  Instant time{};
};

struct NodeStatus {
  line::NodeState state;
  std::optional<line::OwnDevice> own{};  // if it is a device of the line's own
  Instant time{};
};

// Of each group.
struct OutputStatus {
  std::vector<line::OutputState> groups;
  Instant time{};
};

// Places of LinePort::receptions, for a line with that configuration.
inline std::size_t room_for_receptions(const line::LineConfig& config) {
  const std::size_t longest = line::longest_queue(config);
  return longest == 0 ? 0 : std::clamp<std::size_t>(4 * longest, 256, 4096);
}

struct LinePort {
  // queued: receptions of PDOs that wait for the publisher at the most.
  explicit LinePort(std::size_t queued = 0) : receptions(queued) {}

  // Executor to publisher. A full ring makes the line wait, whose own log counts what is lost.
  exchange::Ring<Event> events{8192};
  exchange::Ring<line::Reply> replies{1024};
  exchange::Ring<NodeStatus> nodes{256};
  exchange::Ring<pdo::Reception> receptions;  // full: they wait in the line
  exchange::Handover<LineStatus> status;
  exchange::Handover<OutputStatus> outputs_status;  // with the status of a line that has outputs
  std::array<exchange::Handover<image::Snapshot>, 2> images;  // by image::Direction
  // Those in force, and only when they have become other ones.
  exchange::Handover<std::vector<routing::Route>> routes;
  // Both, and only when they have become other ones; handed over before the first of their images.
  exchange::Handover<std::array<image::Layout, 2>> layouts;

  // Executor to main thread.
  exchange::Ring<TakenScan> scans{4};

  // Request receiver to executor. A full ring is answered with Refusal::busy, or counted.
  exchange::Ring<line::Command> commands{256};
  exchange::Ring<line::OutputWrite> outputs{256};
  exchange::Ring<Event> notices{256};  // what the line shall report: refusals
  exchange::Counter requests_lost;     // outputs and notices that found their ring full

  exchange::Handover<image::Snapshot>& image(image::Direction direction) {
    return images[static_cast<std::size_t>(direction)];
  }
};

}  // namespace linegate::gateway
