// SPDX-License-Identifier: Apache-2.0
// The permitted replies of a line, derived from the frames between it and the bus.
//
// The invariant, after each step of a world, for each command with the reply "done":
//   1. SDO: a transfer of that object with that node has ended since the command: the line received
//      the last response of the transfer, and the value of the reply, or of the command, is the
//      content of its segments: in block transfer, of the acknowledged ones. On a line of CANopen
//      FD the same for the session of a USDO transfer.
//   2. NMT commands to other nodes, frames of no service, EMCYs and values by MPDO: the line has
//      submitted that frame since the command, and the bus acknowledged it. Exception: a reset of
//      all nodes that ends the state fatal error. It begins the start-up of the network, whose NMT
//      commands are those of the manager. An MPDO may carry a newer value of the same object.
//   3. Single outputs by PDO: the line has submitted a frame of their PDO since then that carries
//      the value, or a newer one of the same entry, and the bus acknowledged it; of each PDO, if
//      several carry the object. A triggered PDO: a
//      frame of the PDO with the values of the image when the line submits it. A synchronous PDO
//      may have the values of a SYNC that was queued before the trigger and waited for the bus.
//      That frame does not answer the trigger: the values that were written until then follow with
//      the next SYNC.
// Each transfer, and each frame of 2, answers one command; an MPDO answers all commands whose
// values it carries.
//   9. LSS: a service without a response (switch state global, activate bit timing) as in 2. All
//      other services except a round of assignment: the line has received the last response of the
//      service since the command, and its error and value are those of the reply.
//  10. A write by SDO is cancelled, or ends at its own time-out, only if the line has not submitted
//      all of its value, and in block transfer the end: the device may carry it out. Of several
//      writes of one value to one object any may be the one that was submitted.
//
// For each command of an unconfirmed service with another reply:
//   4. It is answered within kSendTime.
//   5. "No acknowledge" and "awaits its turn" are answered after kSendTime and only if no frame as
//      in 2 and 3 was acknowledged; the latter only if no such frame is under way either, and never
//      for a frame of no service. The same holds for the reasons of a waiting PDO: its turn, the
//      bus.
//   6. The PDO that waits carries the object. The values for which it waits are entries of the PDO
//      that are not known; an own node for which it waits is not Operational; the line waits for
//      nothing that is not configured.
//   7. Single outputs of a node that the line does not show as present and Operational, or of a
//      group whose watchdog the line shows as fired, are refused immediately with wrong_state and
//      an event with the node-ID, and no frame carries the value.
//   8. The event of 7 is missing only as base/repeat_limit.h specifies: an equal event passed less
//      than a second before; or kPlaces different events did, and one more, which occupied the
//      shared place. Within a second of the refusal there is an event command_refused with the
//      node-ID, or with the number of suppressed events.
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

  // Call it when the line is given this command.
  void commanded(const line::Command& command, Instant now);
  // Call it when the line is given this write to a group of outputs.
  void written(const line::OutputWrite& write);
  // Call it when the line submits the frame to the bus.
  void submitted(const can::Frame& frame, Instant now);
  // Number of submitted frames that have ended; the frames of a lost range never end.
  void acknowledged(std::uint64_t number) { acknowledged_ = number; }
  void lost(std::uint64_t first, std::uint64_t last);
  // Call it before the line receives the frame.
  void before_receive(const can::Frame& frame);
  // Call it when the line replied, after these events. Returns a description of the violated rule,
  // or nothing.
  std::string answered(const line::Reply& reply, std::span<const Event> events, Instant now);
  // Call it after each step, with all events of the line. Returns a description of a command that
  // was not answered in time, of a refused value that was sent, or of a suppressed event that was
  // not counted; or nothing.
  std::string compare(std::span<const Event> events, Instant now);

 private:
  enum class Phase : std::uint8_t { idle, initiated, segments, blocks };
  // The current SDO transfer with a node, derived from the frames of both sides.
  struct Transfer {
    Phase phase = Phase::idle;
    bool upload = false;
    bool block = false;  // requested by the initiate; the server may continue an upload in segments
    bool last = false;   // the client sent its last segment; in block transfer, it was acknowledged
    bool whole = false;  // of a download: the client sent all of the value, with the end of a block
    bool toggle = false;
    // By USDO:
    unsigned session = 0;
    unsigned counter = 0;  // of the segment of an upload that was requested last
    bool awaits = false;   // that segment was not received yet
    od::Address address;
    std::vector<std::byte> value;
    // Of the current sub-block:
    unsigned segments = 0;  // in order, as sent by the client or received from the server
    unsigned size = 0;      // block size of a download
    unsigned newest = 0;    // number of the previous segment
    bool ends = false;      // the newest segment is the last one of the value
    std::uint64_t last_segment = 0;
    std::uint64_t acknowledged = 0;  // the last acknowledgement of the server
    std::vector<std::byte> sub_block{};
  };
  struct Done {
    Transfer transfer;
    std::uint8_t node = 0;
    std::uint64_t after = 0;  // number of commands before its begin
  };
  struct Sent {
    can::Frame frame;
    std::uint64_t number = 0;
    std::uint64_t after = 0;  // number of commands before it
    bool newest = false;      // of a PDO: it carries the values of the image
    bool used = false;
  };
  struct Heard {
    can::Frame frame;
    std::uint64_t after = 0;  // number of commands before it
  };
  struct Given {
    line::Command command;
    std::uint64_t order = 0;
    Instant time{};
    bool unconfirmed = false;  // see kSendTime
    bool refusable = false;    // clause 7
    bool lost = false;         // a bus-off lost frames since then
  };
  // The position of an output entry in the frames of its PDO.
  struct Field {
    can::CobId cob_id{can::CobId::kInvalidBit};
    std::uint16_t pdo = 0;  // PDO number of the node
    unsigned bit = 0;
    unsigned bits = 0;
  };
  struct Write {
    std::uint64_t order = 0;
    std::uint64_t value = 0;
    bool refused = false;
  };
  // A refusal without an event at that time.
  struct Held {
    std::uint8_t node = 0;
    line::Refusal refusal = line::Refusal::none;
    line::CommandKind command{};
    Instant time{};

    bool is_of(const Event& event) const {
      const auto* const refused = event.get<event::CommandRefused>();
      return refused != nullptr && event.node == node && refused->refusal == refusal &&
             refused->command == command;
    }
  };

  void usdo_request(const can::Frame& frame);
  void usdo_response(const can::Frame& frame);
  void request(std::uint8_t node, const can::Frame& frame);
  void response(std::uint8_t node, const can::Frame& frame);
  static void receive_segment(Transfer& transfer, const can::Frame& frame);
  static void receive_sub_block(Transfer& transfer, unsigned count);
  static void receive_block_end(Transfer& transfer, const can::Frame& frame);
  static bool block_request(Transfer& transfer, const can::Frame& frame);
  void block_response(std::uint8_t node, const can::Frame& frame);
  void end(std::uint8_t node);
  std::string check_transfer(const Given& given, const line::Reply& reply);
  std::string check_done(const Given& given, const line::Reply& reply);
  bool may_be_transferred(const Given& given) const;
  bool may_be_carried_out(const Given& given) const;
  std::string check_sent(const Given& given);
  std::string check_lss(const Given& given, const line::Reply& reply);
  static bool is_lss_frame_of(const Given& given, const can::Frame& frame);
  std::string check_output(const Given& given, const line::Reply& reply);
  std::string check_wait(const Given& given, const line::WrittenByPdo& way);
  std::string check_values(const Given& given, std::size_t entry, const line::WrittenByPdo& way);
  std::string check_refusal(const Given& given, const line::Reply& reply,
                            std::span<const Event> events, Instant now);
  std::string check_event(const Held& refusal, std::span<const Event> events);
  void count_held(std::span<const Event> events);
  std::string check_unsent(const Given& given, bool turn, Instant now);
  std::string check_sent(const Given& given, std::size_t entry);
  std::string check_unsent(const Given& given, std::size_t entry, bool turn);
  std::string check_unsent(const Given& given, const Sent& sent, bool turn) const;
  std::vector<std::size_t> entries_of(const line::Command& command) const;
  bool is_unconfirmed(const line::Command& command) const;
  bool is_single_output(const line::Command& command) const;
  bool is_refusable(const line::Command& command) const;
  bool has_fired(const line::Command& command) const;
  bool counts(const Sent& sent, const Given& given) const;
  bool is_frame_of(const Given& given, const Sent& sent) const;
  bool has_newest(const can::Frame& frame, Instant now);
  bool is_value_of(const Given& given, std::size_t entry, const can::Frame& frame) const;
  bool is_mpdo_of(const Given& given, const can::Frame& frame) const;
  bool is_of(const Field& field, const can::Frame& frame) const;
  void check_refused_values(const can::Frame& frame);

  line::Line& line_;
  std::vector<Field> fields_;                                     // of the output entries
  std::vector<std::vector<Write>> writes_;                        // the same
  std::vector<std::pair<std::uint64_t, line::MpdoWrite>> mpdos_;  // by order
  bool zeroes_ = false;                                           // a watchdog may set outputs to 0
  bool may_be_slave_ = false;
  std::string early_;  // description of a frame that must not be sent
  image::Snapshot snapshot_;
  std::array<Transfer, 128> transfers_{};
  std::array<std::uint64_t, 128> begun_{};  // number of commands when the transfer began
  std::vector<Done> done_;
  std::map<std::uint8_t, Heard> lss_answers_;  // the last one of each command specifier
  std::vector<Sent> sent_;                     // frames that may answer a command
  std::map<std::uint64_t, Given> given_;       // by tag
  std::vector<Held> held_;                     // not yet counted by an event
  std::size_t counted_ = 0;                    // number of events that count_held() has processed
  std::uint64_t commands_ = 0;
  std::uint64_t submitted_ = 0;
  std::uint64_t acknowledged_ = 0;
};

}  // namespace linegate::plant
