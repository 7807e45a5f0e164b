// What a line may show of the nodes, from what it received: a second way to come to it.
//   a node that is not present shows no NMT state
//   the NMT state of a node with a heartbeat is that of its newest heartbeat or boot-up message, or
//   of a newer answer to a remote frame
//   a node that is present was received within the time of its error control and of the question
//   that its boot process asks; if nobody monitors it, 10 s or three heartbeat times longer
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "stack/can/frame.h"
#include "stack/line/line.h"

namespace linegate::plant {

class StateModel {
 public:
  explicit StateModel(const line::Line& line);

  // The line is about to receive it.
  void before_receive(const can::Frame& frame);
  // The line sends it. The boot-up message of a node that it resets may be lost.
  void sends(const can::Frame& frame);
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
  };

  std::string compare(const line::NodeState& said, Instant now) const;

  bool acts_ = false;  // as manager
  std::array<Node, 128> nodes_{};
};

}  // namespace linegate::plant
