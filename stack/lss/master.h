// SPDX-License-Identifier: Apache-2.0
// The LSS master of a network (CiA 305): one service at a time. No answer within the time-out is a
// result like others: nobody there is what most questions are about.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "stack/base/time.h"
#include "stack/lss/message.h"

namespace linegate::lss {

enum class Service : std::uint8_t {
  switch_global,         // configuration; not answered: done when it is sent
  switch_selective,      // address
  configure_node_id,     // node_id
  configure_bit_timing,  // table, index
  activate_bit_timing,   // delay; not answered
  store,
  inquire_part,     // part -> Answer::value
  inquire_node_id,  // -> Answer::value
  identify,         // address (lowest revision and serial), highest_...
  identify_unconfigured,
  question,  // message: of a Fastscan
  anybody,   // without a node-ID; both kinds of question, of devices that know either
};

struct Request {
  Service service = Service::switch_global;
  bool configuration = false;
  Address address{};
  std::uint32_t highest_revision = 0;
  std::uint32_t highest_serial = 0;
  Part part = kVendor;
  std::uint8_t node_id = kNoNodeId;
  std::uint8_t table = 0;
  std::uint8_t index = 0;
  std::uint16_t delay_ms = 0;
  Message message{};
  Duration timeout{};   // for the answer; 0 = the master's
  bool of_one = false;  // of an inquiry: the time-out is waited for, and a second answer reported
};

// Grows at the end only: the numbers are those of the DDS contract (COMMAND_LSS).
enum class Outcome : std::uint8_t {
  done,
  no_answer,
  refused,
  several,         // several devices are in configuration
  node_id_in_use,  // by another device: it was not given
};

struct Answer {
  Service service = Service::switch_global;
  Outcome outcome = Outcome::done;
  std::uint8_t error = 0;     // byte 1 of a refusal
  std::uint8_t specific = 0;  // byte 2
  std::uint32_t value = 0;    // what was inquired
};

inline constexpr Duration kDefaultTimeout = std::chrono::milliseconds(100);
// To what several devices may answer, the answer is there this part of the time-out after the first
// of them: those that are slower do not answer the next question.
inline constexpr int kSettleShare = 10;
// For the answer to `store`: into a flash.
inline constexpr Duration kStoreTime = std::chrono::seconds(2);

class Master {
 public:
  explicit Master(Duration timeout = kDefaultTimeout) : timeout_(timeout) {}

  // False if a service is under way.
  bool start(const Request& request);
  bool busy() const { return busy_; }
  // Gives up what is under way, without an answer.
  void cancel();

  // A frame on 7E4h. False if it is malformed: no 8 bytes, or no answer there is.
  bool receive(const can::Frame& frame);
  void advance(Instant now);
  Instant next_wake() const { return deadline_; }
  // The next frame. The time-out runs from the last one, or with awaits_sent from sent() after it.
  bool next_frame(can::Frame& out, Instant now, bool awaits_sent = false);
  // The bus acknowledged the last frame. No effect if the time-out runs.
  void sent(Instant now);
  bool wants_to_send() const { return !frames_.empty(); }

  // Once for each service.
  std::optional<Answer> take();

  // Answers beyond the one to services that one device answers: two devices have one address.
  std::uint64_t doubled() const { return doubled_; }
  std::uint64_t malformed() const { return malformed_; }
  std::uint64_t unexpected() const { return unexpected_; }  // answers nobody waited for

 private:
  void push(Command command, std::uint32_t number = 0);
  void finish(const Answer& answer);
  void answered(const Message& message, Instant now);
  bool is_awaited(Command command) const;

  Duration timeout_;
  Duration patience_{};  // of the service under way
  bool of_one_ = false;  // the same
  bool busy_ = false;
  Service service_ = Service::switch_global;
  Command expected_ = Command::switch_global;  // as it: none
  std::deque<can::Frame> frames_;
  Instant deadline_ = kNever;
  std::optional<Answer> answer_;
  std::optional<Answer> held_;             // of several who may answer the first: the others settle
  Command last_ = Command::switch_global;  // the answer one device gave last
  std::uint64_t doubled_ = 0;
  std::uint64_t malformed_ = 0;
  std::uint64_t unexpected_ = 0;
};

}  // namespace linegate::lss
