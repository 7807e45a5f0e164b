// What a line may answer, from the frames between it and the bus.
//
// The invariant, after each step of a world, for each command that is answered as done:
//   1. SDO: a transfer of that object with that node came to its end since the command was given:
//      the line received the last response of it, and the value of the reply, or of the command, is
//      what its segments carried. Of a block transfer the end alone counts, not the value.
//   2. NMT commands to other nodes and frames of no service: the line submitted that frame since
//   the
//      command was given, and the bus acknowledged it. Not a reset of all that ends the state fatal
//      error: it begins the start-up of the network, whose commands are the manager's.
//   3. Outputs by PDO: the line submitted a frame of their PDO since then, and the bus acknowledged
//      it; or the reply names what the PDO waits for. Which value it carries is the matter of
//      output_model.h.
// Each transfer, and each frame of 2, answers for one command.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/line/line.h"

namespace linegate::plant {

class AnswerModel {
 public:
  explicit AnswerModel(const line::Line& line);

  // The line is given this command.
  void commanded(const line::Command& command);
  // The line submits it to the bus.
  void submitted(const can::Frame& frame);
  // Of the frames that it submitted, so many have ended; those of a range never will.
  void acknowledged(std::uint64_t number) { acknowledged_ = number; }
  void lost(std::uint64_t first, std::uint64_t last);
  // The line is about to receive it.
  void before_receive(const can::Frame& frame);
  // The line gave this reply. A sentence about the rule that it breaks, or nothing.
  std::string answered(const line::Reply& reply);

 private:
  enum class Phase : std::uint8_t { idle, initiated, segments, blocks };
  // The SDO transfer under way with a node, as the frames of both show it.
  struct Transfer {
    Phase phase = Phase::idle;
    bool upload = false;
    bool block = false;  // its initiate; the server may go on in segments
    bool has_value = true;
    bool last = false;  // the client sent its last segment
    bool toggle = false;
    unsigned next_segment = 1;  // of the block that the client sends
    od::Address address;
    std::vector<std::byte> value;
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
    bool used = false;
  };
  struct Given {
    line::Command command;
    std::uint64_t order = 0;
  };

  void request(std::uint8_t node, const can::Frame& frame);
  void response(std::uint8_t node, const can::Frame& frame);
  void end(std::uint8_t node);
  std::string check_transfer(const Given& given, const line::Reply& reply);
  std::string check_frame(const Given& given, const can::Frame& frame);
  std::string check_output(const Given& given, const line::Reply& reply);
  std::size_t entry_of(const line::Command& command) const;
  bool counts(const Sent& sent, const Given& given) const;

  const line::Line& line_;
  std::vector<can::CobId> cob_ids_;  // of the PDO of each output entry
  std::array<Transfer, 128> transfers_{};
  std::array<std::uint64_t, 128> begun_{};  // commands given when the transfer began
  std::vector<Done> done_;
  std::vector<Sent> sent_;                // what may answer for a command
  std::map<std::uint64_t, Given> given_;  // by tag
  std::uint64_t commands_ = 0;
  std::uint64_t submitted_ = 0;
  std::uint64_t acknowledged_ = 0;
};

}  // namespace linegate::plant
