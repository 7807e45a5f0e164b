// SPDX-License-Identifier: Apache-2.0
// The node states that a line may report, derived independently from the frames that it received.
//   a node that is not present shows no NMT state
//   the NMT state of a node is that of its newest heartbeat or boot-up message, or of a newer
//   response to a remote frame; the states of guarded nodes are not compared, because a response
//   whose toggle bit did not change counts as not received
//   without a heartbeat since its boot-up message, or while its error control is not monitored, the
//   state may be the one that an NMT command requested. The state by command is Operational only if
//   the device itself was Operational when it had received the newest NMT command, or if an NMT
//   start of the line follows this command on the bus. Once monitoring has begun, a state by
//   command is valid until the next message only if the device itself had this state when it had
//   received the newest command, or while a command other than start that was given before is under
//   way
//   a device that is off, disconnected, or did not receive an acknowledged frame is unknown to a
//   line: it counts as one that executed the command
//   a node that is present was received within the time of its error control and of the request of
//   its boot process; if it is not monitored, 10 s or three heartbeat times longer
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bridges/sim/bus.h"
#include "stack/can/frame.h"
#include "stack/line/line.h"
#include "stack/nmt/node_control.h"

namespace linegate::plant {

class StateModel {
 public:
  explicit StateModel(const line::Line& line);

  // Call it before the line receives the frame.
  void before_receive(const can::Frame& frame);
  // Call it before the line executes the command.
  void commanded(const line::Line& line, const line::Command& command);
  // Call it when the line sends the frame. The boot-up message of a node that it resets may be
  // lost.
  void sends(const can::Frame& frame);
  // The frame ended on the bus and was sent by the line, or received by it.
  void ended(const can::Frame& frame, bool by_line, sim::Fate fate);
  // The submitted frames of the line are discarded.
  void flushed();
  // The line is stopped: states by earlier commands remain valid.
  void stopped() { stopped_ = true; }
  // Call it after the devices executed the commands in the frames that ended. real: the NMT state
  // of a device, by node-ID. acknowledged: number of frames of the line that are reported to it as
  // acknowledged, counted from the first: a frame that overtook another is reported after the other
  // one.
  void look_at(const line::Line& line, const std::function<nmt::State(std::uint8_t)>& real,
               std::uint64_t acknowledged);
  // Compares the configured nodes only. Returns a description of the first difference, or nothing.
  std::string compare(const line::Line& line, Instant now) const;
  // The same for all nodes.
  std::string compare_all(const line::Line& line, Instant now) const;

 private:
  struct Node {
    bool configured = false;
    bool booted = false;  // its newest message is a boot-up message
    bool beats = false;   // a heartbeat is configured
    bool guarded = false;
    Duration silence{};   // longest silence while it is present; 0 = it has no error control
    Instant received{};   // time of the newest sign of life
    Instant heartbeat{};  // time of the newest heartbeat
    Duration longest{};   // longest time between two heartbeats
    nmt::State state = nmt::State::unknown;
    nmt::State answer = nmt::State::unknown;  // newer response to a remote frame
    bool starts = false;                      // an NMT start of the line is under way
    bool asked = false;                       // a remote frame was not answered yet
    // The state of the device after the newest NMT command since its newest message that ended
    // while its error control was not monitored: at that time, and when the command was reported to
    // the line.
    nmt::State obeyed_then = nmt::State::unknown;
    nmt::State obeyed = nmt::State::unknown;
    // The state requested by a command other than start that is under way: it is shown at once if
    // error control is not monitored then, and still if monitoring begins meanwhile.
    nmt::State requested = nmt::State::unknown;
  };

  // An NMT command that ended on the bus since the last look_at().
  struct Command {
    nmt::NodeControl control;
    std::uint64_t number = 0;  // number of the line's frame, 0 = another station
    bool reached = true;
    // The states of the devices after it ended, by node-ID; empty until look_at().
    std::vector<nmt::State> then{};
  };
  struct Submitted {
    nmt::NodeControl control;
    std::uint64_t number = 0;
    bool ended = false;  // it may be reported later, when another frame that it overtook has ended
  };

  std::string compare(const line::NodeState& said, Instant now) const;

  bool acts_ = false;  // the line is a manager
  bool stopped_ = false;
  std::array<Node, 128> nodes_{};
  std::vector<Command> commands_;
  std::uint64_t sent_ = 0;  // number of frames of the line
  // The NMT commands among them that were not yet reported to the line
  std::vector<Submitted> submitted_;
};

}  // namespace linegate::plant
