// Whether the heartbeats on one node-ID are those of two devices.
//
// One device has one period: two make times between heartbeats that alternate, and they may show
// two NMT states in turn although no command was sent. What one device can do as well is no sign: a
// shorter period, a heartbeat besides when its state changes, a reboot, a frame that is repeated.
// Two devices whose heartbeats are evenly spaced are like one with half the period, until their
// clocks have drifted apart.
#pragma once

#include <array>
#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/nmt/state.h"

namespace linegate::manager {

// Event::code of shared_node_id.
inline constexpr std::uint32_t kTwoAnswers = 1;  // to one SDO request, see sdo/arbiter.h
inline constexpr std::uint32_t kTwoStates = 2;
inline constexpr std::uint32_t kTwoRhythms = 3;

class SharedIds {
 public:
  // The same sign is reported again after this time.
  static constexpr Duration kQuiet = std::chrono::minutes(1);

  // A heartbeat of the node, 1..127: 0, or how it shows that there are two devices.
  std::uint32_t heartbeat(std::uint8_t node, nmt::State state, Instant now);
  // Its boot-up message, or an NMT command to it, or to all with 0: other times and states follow.
  void begin(std::uint8_t node);

 private:
  static constexpr std::size_t kTimes = 8;
  static constexpr unsigned kChanges = 4;

  struct Node {
    Instant last = kNever;
    Instant reported = kNever;
    nmt::State state = nmt::State::unknown;
    std::uint8_t times = 0;    // known, the newest last
    std::uint8_t changes = 0;  // of state, one after the other
    std::array<Duration, kTimes> between{};
  };

  static bool alternates(const Node& node);

  std::array<Node, can::kMaxNodeId + 1> nodes_{};
};

}  // namespace linegate::manager
