// SPDX-License-Identifier: Apache-2.0
// The permitted validity of the outputs that are objects of a line's own node, derived from the
// frames that the line submits and the bus acknowledges.
//
// The invariant, after each step of a world:
//   1. Such an output is valid only while the own node is Operational and the line is on the bus.
//   2. If a TPDO of the own node maps the output, or its MPDOs in source address mode send it, it
//   is
//      valid only if the newest such frame that the bus acknowledged has its value, and the line
//      submitted that frame after it received the newest NMT command that ends Operational, and
//      after the own node was last not Operational at the end of a step, and after the line last
//      went off the bus. Frames that the controller lost do not count.
//   3. OutputState has a reason that holds for each other one: the own node is not Operational, or
//      it is. The bus is a reason only without one, or while a frame is under way.
//   4. At rest each of them is valid if it is known and the own node is Operational.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/image/snapshot.h"
#include "stack/line/line.h"

namespace linegate::plant {

class OwnOutputModel {
 public:
  // A line with its own node. Its TPDOs are as configured.
  explicit OwnOutputModel(line::Line& line);

  // Call it before the line receives the frame.
  void before_receive(const can::Frame& frame);
  // Call it when the line submits the frame to the bus.
  void submitted(const can::Frame& frame);
  // Number of submitted frames that have ended.
  void acknowledged(std::uint64_t number);
  // Call it when the controller loses these frames, before acknowledged() counts them.
  void lost(std::uint64_t first, std::uint64_t last);
  // Call it when the controller goes off the bus, or is back.
  void set_bus(bool on);
  // Call it after each step. Returns a description of an output that violates the invariant, or
  // nothing. at_rest: clause 4, too.
  std::string compare(Instant now, bool at_rest = false);

  // Number of valid outputs whose frame was compared.
  std::uint64_t compared() const { return compared_; }

 private:
  struct Output {
    std::size_t entry = 0;
    bool is_sent = false;
    bool by_mpdo = false;
    can::CobId cob_id{can::CobId::kInvalidBit};
    unsigned bit = 0;
    std::deque<std::pair<std::uint64_t, std::uint64_t>> under_way{};  // number and value
    std::uint64_t number = 0;  // of the newest acknowledged frame; 0 = none
    std::uint64_t value = 0;   // in that frame
  };

  bool carries(const Output& output, const can::Frame& frame) const;
  std::string check_valid(const Output& output);
  std::string check_waits(bool operational) const;

  line::Line& line_;
  std::vector<Output> outputs_;
  image::Snapshot snapshot_;
  std::uint64_t submitted_ = 0;
  std::uint64_t acknowledged_ = 0;
  std::uint64_t started_after_ = 0;  // frames submitted before the own node was last not started
  std::uint64_t compared_ = 0;
  bool is_off_bus_ = false;
};

}  // namespace linegate::plant
