// SPDX-License-Identifier: Apache-2.0
// What a line of our devices may answer to commands, from the frames that it submits and the bus
// acknowledges.
//
// The invariant, after each step of a world:
//   1. EMCYs, triggered TPDOs and values by TPDO are answered as done only if the line submitted a
//      frame since the command was given, and the bus acknowledged it: an EMCY of the device with
//      the code and the information of the command; the TPDO with the values that the image has
//      when it is submitted; the TPDO with the value of the command, or a newer one of the same
//      entry. Each EMCY answers for one command.
//   2. They are answered within kSendTime, a value of a device that is not Operational at once.
//   3. "No acknowledge" and "awaits its turn" are answered after kSendTime, and only if no frame as
//      in 1 was acknowledged; the latter only if none is under way either, and never for an EMCY,
//      which waits for no inhibit time (1015h is 0). A TPDO of transmission type 252 may carry the
//      values of a SYNC that came before newer ones were written: it waits for its turn yet.
//   4. A command is refused because of a wrong state, and a value waits for its device, only if the
//      device was reset since the command was given, or is not Operational then; of an EMCY, if it
//      is Stopped. A value is never refused.
//   5. A value that is written into the dictionary is in the image when it is answered.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/image/snapshot.h"
#include "stack/line/line.h"

namespace linegate::plant {

class OwnAnswerModel {
 public:
  // A line in the role device, with devices.
  explicit OwnAnswerModel(line::Line& line);

  // The line is given this command.
  void commanded(const line::Command& command, Instant now);
  // The line is about to receive it.
  void before_receive(const can::Frame& frame);
  // The line submits it to the bus.
  void submitted(const can::Frame& frame, Instant now);
  // Of the frames that it submitted, so many have ended.
  void acknowledged(std::uint64_t number) { acknowledged_ = number; }
  // The line gave this reply. A sentence about the rule that it breaks, or nothing.
  std::string answered(const line::Reply& reply, Instant now);
  // After each step: a sentence about a command that is not answered in time, or nothing.
  std::string compare(Instant now) const;
  // Commands were given that are not answered.
  bool any() const { return !given_.empty(); }

 private:
  struct Given {
    line::Command command;
    std::uint64_t order = 0;
    Instant time{};
    bool reset = false;  // of its device, since then
  };
  struct Sent {
    can::Frame frame;
    std::uint64_t number = 0;
    std::uint64_t after = 0;  // commands given before
    bool newest = false;      // it has the values of the image
    bool used = false;
  };
  // Where an output entry is in the frames of its TPDO.
  struct Field {
    std::uint8_t node = 0;
    std::uint16_t pdo = 0;  // 0 = no TPDO carries it
    can::CobId cob_id{can::CobId::kInvalidBit};
    unsigned bit = 0;
    unsigned bits = 0;
  };
  struct Write {
    std::uint64_t order = 0;
    std::uint64_t value = 0;
  };

  std::size_t entry_of(const line::Command& command) const;
  std::uint8_t node_of(const line::Command& command) const;
  bool is_frame_of(const Given& given, const Sent& sent) const;
  bool is_sent(const Given& given);
  bool has_newest(const can::Frame& frame, Instant now);
  std::string check(const Given& given, const line::Reply& reply, Instant now);
  std::string check_value(const Given& given, const line::Reply& reply, Instant now);
  std::string check_written(const Given& given, Instant now);
  std::string check_refusal(const Given& given, line::Refusal why, Instant now);
  std::string check_state(const Given& given) const;
  std::string check_unsent(const Given& given, bool turn, Instant now) const;

  line::Line& line_;
  std::vector<Field> fields_;               // of the output entries
  std::vector<std::vector<Write>> writes_;  // the same
  image::Snapshot snapshot_;
  std::map<std::uint64_t, Given> given_;  // by tag
  std::vector<Sent> sent_;                // what may answer for a command
  std::uint64_t commands_ = 0;
  std::uint64_t submitted_ = 0;
  std::uint64_t acknowledged_ = 0;
};

}  // namespace linegate::plant
