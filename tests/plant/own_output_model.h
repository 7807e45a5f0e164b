// SPDX-License-Identifier: Apache-2.0
// The permitted validity of the outputs that are objects of a line's own node, derived from the
// frames that the line submits and the bus acknowledges.
//
// The invariant, after each step of a world:
//   1. Such an output is valid only while the own node is Operational and the line is on the bus.
//   2. If TPDOs of the own node map the output, or its MPDOs in source address mode send it, it is
//      valid only if for one of them the newest frame that the bus acknowledged has its value, and
//      the line submitted that frame after it received the newest NMT command that ends
//      Operational, and after the own node was last not Operational at the end of a step, and after
//      the line last went off the bus. Frames that the controller lost do not count.
//   3. OutputState has a reason that holds for each other one: the own node is not Operational, or
//      it is. The bus is a reason only without one, or while a frame is under way.
//   4. At rest each of them is valid if it is known and the own node is Operational.
//   5. A command that writes one of them is answered with a PDO and no wait only if that PDO sends
//      it, and the bus acknowledged a frame of it that the line submitted after the command, with
//      its value, or one that was written later or by the reaction of a watchdog. It is answered
//      without a PDO only if none sends it. The wait is for Operational only while the own node is
//      not Operational.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
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

  // Call them before the line gets the command or the write.
  void commanded(const line::Command& command);
  void written(const line::OutputWrite& write);
  // Returns a violation of clause 5, or nothing.
  std::string answered(const line::Reply& reply);
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

  // Number of valid outputs whose frame was compared, and of single writes that were sent.
  std::uint64_t compared() const { return compared_; }
  std::uint64_t writes_sent() const { return writes_sent_; }

 private:
  // A PDO that sends an output.
  struct Way {
    std::uint16_t tpdo = 0;
    bool by_mpdo = false;
    can::CobId cob_id{can::CobId::kInvalidBit};
    unsigned bit = 0;
    std::deque<std::pair<std::uint64_t, std::uint64_t>> under_way{};  // number and value
    std::uint64_t number = 0;  // of the newest acknowledged frame; 0 = none
    std::uint64_t value = 0;   // in that frame
  };
  struct Output {
    std::size_t entry = 0;
    std::vector<Way> ways{};
  };
  // A command that writes an output.
  struct Asked {
    std::size_t entry = 0;
    std::uint64_t after = 0;               // frames that were submitted before
    std::vector<std::uint64_t> values{};   // its value and those written since
    std::vector<std::uint16_t> sent_by{};  // TPDOs of which such a frame was acknowledged
  };

  bool carries(const Output& output, const Way& way, const can::Frame& frame) const;
  std::string check_valid(const Output& output);
  const Output* find(std::size_t entry) const;
  void note_value(std::size_t entry, std::uint64_t value);
  void note_acknowledged(const Output& output, const Way& way);
  std::string check_waits(bool operational) const;

  line::Line& line_;
  std::vector<Output> outputs_;
  image::Snapshot snapshot_;
  std::uint64_t submitted_ = 0;
  std::uint64_t acknowledged_ = 0;
  std::uint64_t started_after_ = 0;  // frames submitted before the own node was last not started
  std::map<std::uint64_t, Asked> asked_;  // by tag
  bool zeroes_ = false;                   // the reaction of a watchdog may have written zeros
  std::uint64_t compared_ = 0;
  std::uint64_t writes_sent_ = 0;
  bool is_off_bus_ = false;
};

}  // namespace linegate::plant
