// SPDX-License-Identifier: Apache-2.0
// Whether the heartbeats on one node-ID are those of two devices.
//
// One device has one period: two make times between heartbeats that alternate, and they may show
// two NMT states in turn although no command was sent. Where the producer time is known, two make
// twice as many heartbeats as it allows, whatever their distances. After a boot-up message the
// heartbeats of the device that did not boot go on as before. What one device can do as well is no
// sign: a shorter period that is not known, a heartbeat besides when its state changes, a reboot
// with which its heartbeats begin anew, a frame that is repeated now and then. Two whose 1017h was
// written by one request send at one time: each heartbeat seems to be repeated.
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
inline constexpr std::uint32_t kBootedBeside = 4;
inline constexpr std::uint32_t kTooManyHeartbeats = 5;

class SharedIds {
 public:
  // The same sign is reported again after this time.
  static constexpr Duration kQuiet = std::chrono::minutes(1);

  // A heartbeat of the node, 1..127: 0, or how it shows that there are two devices. producer_time:
  // 1017h, as it was confirmed; 0 = not known.
  std::uint32_t heartbeat(std::uint8_t node, nmt::State state, Instant now,
                          Duration producer_time = {});
  // Its boot-up message: other times and states follow.
  void boot_up(std::uint8_t node, Instant now);
  // An NMT command to it, or to all with 0: the same.
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
    std::uint8_t pairs = 0;    // heartbeats that were repeated, one after the other
    bool repeated = false;     // the newest
    std::array<Duration, kTimes> between{};
    Duration producer_time{};
    // Before its boot-up message, when it was Operational:
    Duration period{};  // 0: it was not, or not steady
    Instant heard{};
    Instant booted{};
    std::uint8_t goes_on = 0;    // heartbeats that went on as before
    bool starts_itself = false;  // it was Operational after a boot-up message without a command
    bool commanded = true;       // since its boot-up message
  };

  static std::uint32_t report(Node& node, std::uint32_t sign, Instant now);
  static std::uint32_t repeat(Node& node, Duration time);
  std::uint32_t sign_of(Node& node, nmt::State state, Instant now);
  static Duration steady_period(const Node& node);
  static bool goes_on(Node& node, nmt::State state, Instant now);
  static bool alternates(const Node& node);
  static bool too_many(const Node& node);

  std::array<Node, can::kMaxNodeId + 1> nodes_{};
};

}  // namespace linegate::manager
