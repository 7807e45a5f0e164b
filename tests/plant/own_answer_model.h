// SPDX-License-Identifier: Apache-2.0
// The permitted replies of a line with own devices, and the permitted validity of its outputs,
// derived from the frames that it submits and the bus acknowledges.
//
// The invariant, after each step of a world:
//   1. EMCYs, triggered TPDOs and values by TPDO are answered as done only if the line has
//      submitted a frame since the command, and the bus acknowledged it: an EMCY of the device with
//      the code and the information of the command; the TPDO with the values of the image when it
//      is submitted; the TPDO with the value of the command, or a newer one of the same entry. Each
//      EMCY answers one command.
//   2. They are answered within kSendTime, a value of a device that is not Operational immediately.
//   3. "No acknowledge" and "awaits its turn" are answered after kSendTime, and only if no frame as
//      in 1 was acknowledged; the latter only if no such frame is under way either, and never for
//      an EMCY, which waits for no inhibit time (1015h is 0). A TPDO of transmission type 252 may
//      carry the values of a SYNC before newer ones were written: it then still waits for its turn.
//   4. A command is refused because of a wrong state, and a value waits for its device, only if the
//      device was reset since the command, or is not Operational then; for an EMCY, if it is
//      Stopped. A value is never refused.
//   5. A value that is written into the dictionary is in the image when it is answered.
//   6. An output is valid only while its device is Operational, and only if the newest frame of its
//      TPDO that the bus acknowledged has its value, and the line submitted that frame after the
//      newest NMT command that ended Operational of the device, after it was last not Operational
//      at the end of a step, and after the line last went off the bus. Frames that the controller
//      lost do not count.
//   7. OutputState counts each other output as waiting, with a reason that holds: the device is not
//      Operational, or it is. The bus is a reason only without one, or while a frame is under way.
//   8. At rest, each known output of an Operational device whose TPDO is event-driven is valid.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <string>
#include <utility>
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

  // Call it when the line is given this command.
  void commanded(const line::Command& command, Instant now);
  // Call it before the line receives the frame.
  void before_receive(const can::Frame& frame);
  // Call it when the line submits the frame to the bus.
  void submitted(const can::Frame& frame, Instant now);
  // Number of submitted frames that have ended.
  void acknowledged(std::uint64_t number);
  // Call it when the controller loses these frames, before acknowledged() counts them.
  void lost(std::uint64_t first, std::uint64_t last);
  // Call it when the controller goes off the bus, or is back.
  void set_bus(bool on);
  // Call it when the line replied. Returns a description of the violated rule, or nothing.
  std::string answered(const line::Reply& reply, Instant now);
  // Call it after each step. Returns a description of a command that was not answered in time, or
  // of an output that violates the invariant, or nothing.
  std::string compare(Instant now);
  // Call it at rest. Returns a description of an output that is not valid although nothing delays
  // it, or nothing.
  std::string check_rest(Instant now);
  // Whether there are commands without a reply.
  bool any() const { return !given_.empty(); }

 private:
  struct Given {
    line::Command command;
    std::uint64_t order = 0;
    Instant time{};
    bool reset = false;  // the device was reset since the command
  };
  struct Sent {
    can::Frame frame;
    std::uint64_t number = 0;
    std::uint64_t after = 0;  // number of commands before it
    bool newest = false;      // it carries the values of the image
    bool used = false;
  };
  // The position of an output entry in the frames of its TPDO.
  struct Field {
    std::uint8_t node = 0;
    std::uint16_t pdo = 0;  // 0 = no TPDO carries it
    can::CobId cob_id{can::CobId::kInvalidBit};
    unsigned bit = 0;
    unsigned bits = 0;
  };
  // The frames of a TPDO.
  struct Transmission {
    std::uint8_t node = 0;
    std::uint16_t pdo = 0;
    can::CobId cob_id{can::CobId::kInvalidBit};
    std::uint8_t type = 0;
    std::deque<std::pair<std::uint64_t, can::Frame>> under_way;  // with their numbers
    std::uint64_t number = 0;  // of the newest acknowledged frame; 0 = none
    can::Frame newest;
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
  std::string compare_commands(Instant now) const;
  std::string compare_outputs(Instant now);
  std::string check_valid(std::size_t entry) const;
  std::string check_waits() const;
  bool holds(const line::OutputState::Wait& wait) const;
  std::string check_unsent(const Given& given, bool turn, Instant now) const;

  line::Line& line_;
  std::vector<Field> fields_;               // by output entry
  std::vector<std::vector<Write>> writes_;  // by output entry
  std::vector<Transmission> transmissions_;
  // By node-ID: number of frames submitted before its device was last not Operational.
  std::array<std::uint64_t, can::kMaxNodeId + 1> started_after_{};
  image::Snapshot snapshot_;
  std::map<std::uint64_t, Given> given_;  // by tag
  std::vector<Sent> sent_;                // frames that may answer a command
  std::uint64_t commands_ = 0;
  std::uint64_t submitted_ = 0;
  std::uint64_t acknowledged_ = 0;
  bool is_off_bus_ = false;
};

}  // namespace linegate::plant
