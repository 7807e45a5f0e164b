// SPDX-License-Identifier: Apache-2.0
// The data that a line and the other threads of the gateway exchange. Each member has one producing
// and one consuming thread.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "bridges/can/controller_setup.h"
#include "bridges/request/request.h"
#include "gateway/exchange/cell.h"
#include "gateway/exchange/handover.h"
#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/runtime/direct_images.h"
#include "gateway/runtime/scan_applier.h"
#include "stack/base/event.h"
#include "stack/image/snapshot.h"
#include "stack/line/command.h"
#include "stack/line/config.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/pdo/reception.h"
#include "stack/routing/gateway_request.h"
#include "stack/routing/message.h"
#include "stack/routing/table.h"

namespace linegate::gateway {

// Queue depths. Counted outside the line, which can only observe its own queues.
struct QueueDepths {
  // Frames: the largest number that one round of the executor found in the interface since the last
  // status.
  std::uint32_t receive_peak = 0;
  std::uint32_t transmit = 0;  // frames taken from the line and not yet accepted by the interface
  // Number of times that the interface did not accept all frames: back-pressure
  std::uint64_t transmit_stalls = 0;
  std::uint32_t events = 0;        // waiting for the publisher
  std::uint64_t route_stalls = 0;  // number of times that a link to another line was full

  // Includes an earlier status that was not read: its peak counts, too.
  void merge(const QueueDepths& earlier) {
    receive_peak = std::max(receive_peak, earlier.receive_peak);
  }
};

struct LineStatus {
  line::LineState state;
  QueueDepths queues;
  can_bridge::ControllerSetup controller;  // its present settings, as far as known
  Duration sync_period{};                  // of the SYNC that the own node produces; 0 = none
  Instant time{};
};

struct NodeStatus {
  line::NodeState state;
  std::optional<line::OwnDevice> own{};  // if it is one of the line's own devices
  Instant time{};
};

// The state of each group.
struct OutputStatus {
  std::vector<line::OutputState> groups;
  Instant time{};
};

// Capacity of LinePort::receptions for a line with that configuration.
inline std::size_t room_for_receptions(const line::LineConfig& config) {
  const std::size_t longest = line::longest_queue(config);
  return longest == 0 ? 0 : std::clamp<std::size_t>(4 * longest, 256, 4096);
}

struct LinePort {
  // queued: the largest number of receptions of PDOs that wait for the publisher.
  explicit LinePort(std::size_t queued = 0) : receptions(queued) {}

  // Executor to publisher. If the ring is full, events wait in the line, whose own log counts those
  // that it drops.
  exchange::Ring<Event> events{8192};
  exchange::Ring<line::Reply> replies{1024};
  exchange::Ring<NodeStatus> nodes{256};
  exchange::Ring<pdo::Reception> receptions;  // if full, they wait in the line
  exchange::Handover<LineStatus> status;
  // Published with the status of a line that has outputs
  exchange::Handover<OutputStatus> outputs_status;
  std::array<exchange::Handover<image::Snapshot>, 2> images;  // by image::Direction
  // The present routes, published only after a change.
  exchange::Handover<std::vector<routing::Route>> routes;
  // Both layouts, published only after a change, and before the first image that uses them.
  exchange::Handover<std::array<image::Layout, 2>> layouts;

  // Executor to main thread.
  exchange::Ring<AppliedScan> scans{4};

  // Request receiver to executor. If the ring is full, a command is answered with Refusal::busy,
  // and an output is counted.
  // One client fills at most half of a ring, so that a flood does not lock others out.
  static constexpr std::size_t kOfOneClient = 256;
  exchange::Ring<line::Command> commands{2 * kOfOneClient};
  // BusRestart and BusFault, which the line does not receive
  exchange::Ring<request::GatewayCommand> interface_commands{2 * kOfOneClient};
  exchange::Ring<line::OutputWrite> outputs{2 * kOfOneClient};
  exchange::Ring<Event> notices{256};  // refusals, which the line reports
  exchange::Counter requests_lost;     // outputs and notices dropped because their ring was full

  // Executor to the thread of routes over other gateways, which `peers` wakes; nullptr: there is
  // none, and the line gives up its requests at their deadlines.
  exchange::Ring<routing::GatewayRequest> gateway_requests{128};
  exchange::Wakeup* peers = nullptr;  // set before the line runs
  // That thread to executor.
  exchange::Ring<routing::GatewayAnswer> gateway_answers{128};
  exchange::Handover<std::vector<routing::GatewayLine>> gateways_present;
  exchange::Ring<routing::Message> gateway_emcys{128};  // EMCYs of other networks
  exchange::Ring<Event> gateway_notices{32};            // which the line reports

  // Set before the runner of the line is made: its images go to the edge by this way, and those of
  // inputs also to the publisher, which is woken only for PDO updates. Otherwise nullptr.
  std::shared_ptr<DirectImages> direct;

  exchange::Handover<image::Snapshot>& image(image::Direction direction) {
    return images[static_cast<std::size_t>(direction)];
  }
};

}  // namespace linegate::gateway
