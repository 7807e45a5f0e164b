// SPDX-License-Identifier: Apache-2.0
// Detects from heartbeats that two devices have the same node-ID.
//
// One device has one period: with two devices the times between heartbeats alternate, and the NMT
// state may alternate although no command was sent. If the producer time is known, two devices send
// twice as many heartbeats as it allows, whatever their distances. After a boot-up message the
// heartbeats of the device that did not boot continue as before. Anything that one device can cause
// is not counted: a shorter period that is not known, an additional heartbeat when its state
// changes, a reboot with which its heartbeats begin again, an occasional repeated frame, times that
// alternate because the bus delays every second heartbeat: their average remains the producer time,
// or, if it is not known, the period of before. (So two devices that were heard from the beginning,
// first with equal distances, are not detected if their producer time is not known.) Two
// devices whose 1017h was written by one request send at the same time: each heartbeat seems to be
// repeated.
#pragma once

#include <array>
#include <cstdint>

#include "stack/base/events.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/nmt/state.h"

namespace linegate::manager {

class SharedIds {
 public:
  using Evidence = event::SharedIdEvidence;

  // The same evidence is reported again only after this time.
  static constexpr Duration kQuiet = std::chrono::minutes(1);

  // Processes a heartbeat of the node, 1..127. Returns the evidence if it shows that there are two
  // devices, else none. producer_time: the confirmed 1017h; 0 = not known.
  Evidence heartbeat(std::uint8_t node, nmt::State state, Instant now, Duration producer_time = {});
  // The node sent its boot-up message: its times and states start again.
  void boot_up(std::uint8_t node, Instant now);
  // An NMT command was sent to the node, or to all with 0: its times and states start again.
  void begin(std::uint8_t node);

 private:
  static constexpr std::size_t kTimes = 8;
  static constexpr unsigned kChanges = 4;

  struct Node {
    Instant last = kNever;
    Instant reported = kNever;
    nmt::State state = nmt::State::unknown;
    std::uint8_t times = 0;    // number of known times; the last element is the newest
    std::uint8_t changes = 0;  // consecutive changes of state
    std::uint8_t pairs = 0;    // consecutive repeated heartbeats
    bool repeated = false;     // the last heartbeat was repeated
    std::array<Duration, kTimes> between{};
    Duration producer_time{};
    Duration steady{};  // the newest period that did not vary; 0 = not known
    // Before its boot-up message, if it was Operational:
    Duration period{};  // 0: it was not Operational, or not steady
    Instant heard{};
    Instant booted{};
    std::uint8_t goes_on = 0;    // number of heartbeats that continued as before
    bool starts_itself = false;  // it was Operational after a boot-up message without a command
    bool commanded = true;       // a command was sent since its boot-up message
  };

  static Evidence report(Node& node, Evidence evidence, Instant now);
  static Evidence repeat(Node& node, Duration time);
  Evidence evidence_of(Node& node, nmt::State state, Instant now);
  static Duration steady_period(const Node& node);
  static bool goes_on(Node& node, nmt::State state, Instant now);
  static bool alternates(const Node& node);
  static bool is_average_of_one(const Node& node, Duration average);
  static bool too_many(const Node& node);

  std::array<Node, can::kMaxNodeId + 1> nodes_{};
};

}  // namespace linegate::manager
