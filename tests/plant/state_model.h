// SPDX-License-Identifier: Apache-2.0
// What a line may show of the nodes, from what it received: a second way to come to it.
//   a node that is not present shows no NMT state
//   the NMT state of a node with a heartbeat is that of its newest heartbeat or boot-up message, or
//   of a newer answer to a remote frame
//   without a heartbeat since its boot-up message, or while its error control is not monitored, the
//   state may be what an NMT command asked for. Operational is that only if the device itself was
//   Operational when it had received the newest NMT command, or if a start of the line follows this
//   command on its way. Once monitoring has begun, a state by command stands until the next message
//   only if the device itself had it when it had received the newest command
//   a device that is off, cut off, or did not receive a frame that was acknowledged is unknown to a
//   line: it counts as one that obeyed
//   a node that is present was received within the time of its error control and of the question
//   that its boot process asks; if nobody monitors it, 10 s or three heartbeat times longer
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "stack/can/frame.h"
#include "stack/line/line.h"
#include "stack/nmt/node_control.h"

namespace linegate::plant {

class StateModel {
 public:
  explicit StateModel(const line::Line& line);

  // The line is about to receive it.
  void before_receive(const can::Frame& frame);
  // The line sends it. The boot-up message of a node that it resets may be lost.
  void sends(const can::Frame& frame);
  // It has ended on the bus and was sent by the line, or received by it. reached: the devices have
  // it.
  void ended(const can::Frame& frame, bool by_line, bool reached);
  // What the line has submitted is gone.
  void flushed();
  // The line is stopped: what a command asked for before stands as it is.
  void stopped() { stopped_ = true; }
  // The devices have done what the frames that ended ask for. real: the NMT state of a device, by
  // node-ID. acknowledged: frames of the line that it hears of, the first ones: of one that
  // overtook another it hears when that was acknowledged, too.
  void look_at(const line::Line& line, const std::function<nmt::State(std::uint8_t)>& real,
               std::uint64_t acknowledged);
  // Configured nodes alone; nothing if all is as it should be.
  std::string compare(const line::Line& line, Instant now) const;
  // All nodes.
  std::string compare_all(const line::Line& line, Instant now) const;

 private:
  struct Node {
    bool configured = false;
    bool booted = false;  // its newest message is a boot-up message
    bool beats = false;   // a heartbeat is configured
    Duration silence{};   // at most, while it is present; 0 = it has no error control
    Instant received{};   // newest sign of life
    Instant heartbeat{};  // newest heartbeat
    Duration longest{};   // between two heartbeats
    nmt::State state = nmt::State::unknown;
    nmt::State answer = nmt::State::unknown;  // newer, to a remote frame
    bool starts = false;                      // an NMT start of the line is on its way
    bool asked = false;                       // by a remote frame that was not answered yet
    // What the device was after the newest NMT command since its newest message that ended while
    // its error control was not monitored: then, and when the line heard of it.
    nmt::State obeyed_then = nmt::State::unknown;
    nmt::State obeyed = nmt::State::unknown;
  };

  // An NMT command that ended on the bus since the devices were looked at.
  struct Command {
    nmt::NodeControl control;
    std::uint64_t number = 0;  // of the line's frame, 0 = of another station
    bool reached = true;
    // By node-ID, what the devices were when it had ended; empty until they were looked at.
    std::vector<nmt::State> then{};
  };
  struct Submitted {
    nmt::NodeControl control;
    std::uint64_t number = 0;
  };

  std::string compare(const line::NodeState& said, Instant now) const;

  bool acts_ = false;  // as manager
  bool stopped_ = false;
  std::array<Node, 128> nodes_{};
  std::vector<Command> commands_;
  std::uint64_t sent_ = 0;            // frames of the line
  std::vector<Submitted> submitted_;  // NMT commands among them that it has not heard of
};

}  // namespace linegate::plant
