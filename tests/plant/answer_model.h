// SPDX-License-Identifier: Apache-2.0
// What a line may answer, from the frames between it and the bus.
//
// The invariant, after each step of a world, for each command that is answered as done:
//   1. SDO: a transfer of that object with that node came to its end since the command was given:
//      the line received the last response of it, and the value of the reply, or of the command, is
//      what its segments carried: in blocks, those that were acknowledged.
//   2. NMT commands to other nodes, frames of no service, EMCYs and values by MPDO: the line
//      submitted that frame since the command was given, and the bus acknowledged it. Not a reset
//      of all that ends the state fatal error: it begins the start-up of the network, whose
//      commands are the manager's. An MPDO may carry a newer value to the same object.
//   3. Single outputs by PDO: the line submitted a frame of their PDO since then that carries the
//      value, or a newer one of the same entry, and the bus acknowledged it. A triggered PDO: a
//      frame of it that has the values of the image when the line submits it. A synchronous one
//      may have those of a SYNC that was queued before the trigger and waited for the bus, which
//      is not what was triggered: the values that were written until then come with the next SYNC.
// Each transfer, and each frame of 2, answers for one command; MPDOs for all that they carry.
//   9. LSS: a service without an answer (switch state global, activate bit timing) as in 2. Others
//      but a round of assignment: the line received the last answer of the service since the
//      command was given, and its error and value are those of the reply.
//
// Of a service that is not confirmed and is not done:
//   4. It is answered within kSendTime.
//   5. "No acknowledge" and "awaits its turn" are answered after kSendTime and only if no frame as
//      in 2 and 3 was acknowledged; the latter only if none is under way either, and never for a
//      frame of no service. The same holds for what a PDO waits for: its turn, the bus.
//   6. Values that a PDO waits for are entries of it that are not known; an own node that it waits
//      for is not Operational; nothing that is not configured is waited for.
//   7. Single outputs of a node that the line does not show as present and Operational are refused
//      at once with wrong_state and an event that names the node, and no frame carries the value.
//   8. The event of 7 is missing only as base/repeat_limit.h says: an equal one passed less than a
//      second before; or kPlaces different ones did, and one more, which took the place that all
//      others share. Within a second of the refusal a command_refused comes that names the node, or
//      has the number of those that were held back.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/image/snapshot.h"
#include "stack/line/line.h"

namespace linegate::plant {

class AnswerModel {
 public:
  explicit AnswerModel(line::Line& line);

  // The line is given this command.
  void commanded(const line::Command& command, Instant now);
  // The line is given this write to a group of outputs.
  void written(const line::OutputWrite& write);
  // The line submits it to the bus.
  void submitted(const can::Frame& frame, Instant now);
  // Of the frames that it submitted, so many have ended; those of a range never will.
  void acknowledged(std::uint64_t number) { acknowledged_ = number; }
  void lost(std::uint64_t first, std::uint64_t last);
  // The line is about to receive it.
  void before_receive(const can::Frame& frame);
  // The line gave this reply after these events. A sentence about the rule that it breaks, or
  // nothing.
  std::string answered(const line::Reply& reply, std::span<const Event> events, Instant now);
  // After each step, with all events of the line. A sentence about a command that is not answered
  // in time, a value that was refused and is sent, or an event that was held back and is not
  // counted; or nothing.
  std::string compare(std::span<const Event> events, Instant now);

 private:
  enum class Phase : std::uint8_t { idle, initiated, segments, blocks };
  // The SDO transfer under way with a node, as the frames of both show it.
  struct Transfer {
    Phase phase = Phase::idle;
    bool upload = false;
    bool block = false;  // its initiate; of an upload the server may go on in segments
    bool last = false;   // the client sent its last segment; in blocks, it was acknowledged
    bool toggle = false;
    od::Address address;
    std::vector<std::byte> value;
    // Of the sub-block under way:
    unsigned segments = 0;  // in order, as sent by the client or received from the server
    unsigned size = 0;      // of a download
    unsigned newest = 0;    // number of the segment before
    bool ends = false;      // the newest of them is the last one of the value
    std::uint64_t last_segment = 0;
    std::uint64_t acknowledged = 0;  // the newest acknowledgement of the server
    std::vector<std::byte> sub_block{};
  };
  struct Done {
    Transfer transfer;
    std::uint8_t node = 0;
    std::uint64_t after = 0;  // commands given before it began
  };
  struct Sent {
    can::Frame frame;
    std::uint64_t number = 0;
    std::uint64_t after = 0;  // commands given before
    bool newest = false;      // of a PDO: it has the values of the image
    bool used = false;
  };
  struct Heard {
    can::Frame frame;
    std::uint64_t after = 0;  // commands given before
  };
  struct Given {
    line::Command command;
    std::uint64_t order = 0;
    Instant time{};
    bool unconfirmed = false;  // see kSendTime
    bool refusable = false;    // a single output of a node that is not Operational
    bool lost = false;         // a bus-off lost frames since then
  };
  // Where an output entry is in the frames of its PDO.
  struct Field {
    can::CobId cob_id{can::CobId::kInvalidBit};
    std::uint16_t pdo = 0;  // of the node
    unsigned bit = 0;
    unsigned bits = 0;
  };
  struct Write {
    std::uint64_t order = 0;
    std::uint64_t value = 0;
    bool refused = false;
  };
  // A refusal that no event of its time names.
  struct Held {
    std::uint8_t node = 0;
    std::uint32_t code = 0;
    std::uint32_t value = 0;
    Instant time{};

    bool is_of(const Event& event) const {
      return event.kind == EventKind::command_refused && event.node == node && event.code == code &&
             event.value == value;
    }
  };

  void request(std::uint8_t node, const can::Frame& frame);
  void response(std::uint8_t node, const can::Frame& frame);
  static void take_segment(Transfer& transfer, const can::Frame& frame);
  static void take_sub_block(Transfer& transfer, unsigned count);
  static void take_block_end(Transfer& transfer, const can::Frame& frame);
  static bool block_request(Transfer& transfer, const can::Frame& frame);
  void block_response(std::uint8_t node, const can::Frame& frame);
  void end(std::uint8_t node);
  std::string check_transfer(const Given& given, const line::Reply& reply);
  std::string check_done(const Given& given, const line::Reply& reply);
  std::string check_sent(const Given& given);
  std::string check_lss(const Given& given, const line::Reply& reply);
  static bool is_lss_frame_of(const Given& given, const can::Frame& frame);
  std::string check_output(const Given& given, const line::Reply& reply);
  std::string check_wait(const Given& given, const line::Reply& reply);
  std::string check_values(const Given& given, const line::Reply& reply);
  std::string check_refusal(const Given& given, const line::Reply& reply,
                            std::span<const Event> events, Instant now);
  std::string check_event(const Held& refusal, std::span<const Event> events);
  void count_held(std::span<const Event> events);
  std::string check_unsent(const Given& given, bool turn, Instant now);
  std::size_t entry_of(const line::Command& command) const;
  bool is_unconfirmed(const line::Command& command) const;
  bool is_single_output(const line::Command& command) const;
  bool is_refusable(const line::Command& command) const;
  bool counts(const Sent& sent, const Given& given) const;
  bool is_frame_of(const Given& given, const Sent& sent) const;
  bool has_newest(const can::Frame& frame, Instant now);
  bool is_value_of(const Given& given, const can::Frame& frame) const;
  bool is_mpdo_of(const Given& given, const can::Frame& frame) const;
  bool is_of(const Field& field, const can::Frame& frame) const;
  void check_refused_values(const can::Frame& frame);

  line::Line& line_;
  std::vector<Field> fields_;                                     // of the output entries
  std::vector<std::vector<Write>> writes_;                        // the same
  std::vector<std::pair<std::uint64_t, line::MpdoWrite>> mpdos_;  // by order
  bool zeroes_ = false;                                           // a watchdog may set outputs to 0
  bool may_be_slave_ = false;
  std::string early_;  // what was sent and may not be
  image::Snapshot snapshot_;
  std::array<Transfer, 128> transfers_{};
  std::array<std::uint64_t, 128> begun_{};  // commands given when the transfer began
  std::vector<Done> done_;
  std::map<std::uint8_t, Heard> lss_answers_;  // the newest of each command specifier
  std::vector<Sent> sent_;                     // what may answer for a command
  std::map<std::uint64_t, Given> given_;       // by tag
  std::vector<Held> held_;                     // not counted by an event
  std::size_t counted_ = 0;                    // events that count_held() saw
  std::uint64_t commands_ = 0;
  std::uint64_t submitted_ = 0;
  std::uint64_t acknowledged_ = 0;
};

}  // namespace linegate::plant
