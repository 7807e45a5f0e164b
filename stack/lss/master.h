// SPDX-License-Identifier: Apache-2.0
// The LSS master of a network (CiA 305): one service at a time. A time-out is a regular result:
// most questions ask whether such a device is present.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "stack/base/time.h"
#include "stack/lss/message.h"

namespace linegate::lss {

enum class Service : std::uint8_t {
  switch_global,         // configuration; unconfirmed: done when sent
  switch_selective,      // address
  configure_node_id,     // node_id
  configure_bit_timing,  // table, index
  activate_bit_timing,   // delay; unconfirmed
  store,
  inquire_part,     // part; returns Answer::value
  inquire_node_id,  // returns Answer::value
  identify,         // address (lowest revision and serial), highest_...
  identify_unconfigured,
  question,  // message: of a Fastscan
  anybody,   // sends both questions for unconfigured devices, as a device may support only one
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
  Duration timeout{};   // for the answer; 0 = default of the master
  bool of_one = false;  // for an inquiry: wait for the whole time-out, and report a second answer
};

// Only append: the numbers are part of the DDS contract (COMMAND_LSS).
enum class Outcome : std::uint8_t {
  done,
  no_answer,
  refused,
  several,         // several devices are in configuration
  node_id_in_use,  // by another device: the node-ID was not given
};

struct Answer {
  Service service = Service::switch_global;
  Outcome outcome = Outcome::done;
  std::uint8_t error = 0;     // byte 1 of an answer with an error
  std::uint8_t specific = 0;  // byte 2, specific error
  std::uint32_t value = 0;    // the inquired value
};

inline constexpr Duration kDefaultTimeout = std::chrono::milliseconds(100);
// Where several devices may answer, the service ends this fraction of the time-out after the first
// answer, so that slower answers do not count for the next question.
inline constexpr int kSettleShare = 10;
// Time-out of `store`, which may write a flash memory.
inline constexpr Duration kStoreTime = std::chrono::seconds(2);

class Master {
 public:
  explicit Master(Duration timeout = kDefaultTimeout) : timeout_(timeout) {}

  // Returns false if a service is under way.
  bool start(const Request& request);
  bool busy() const { return busy_; }
  // Cancels the current service without an answer.
  void cancel();

  // Processes a frame on 7E4h. Returns false if it is malformed: not 8 bytes, or not an answer of
  // CiA 305.
  bool receive(const can::Frame& frame);
  void advance(Instant now);
  Instant next_wake() const { return deadline_; }
  // Returns the next frame. The time-out starts with the last frame, or with awaits_sent at the
  // sent() after it.
  bool next_frame(can::Frame& out, Instant now, bool awaits_sent = false);
  // The bus acknowledged the last frame. No effect if the time-out has started.
  void sent(Instant now);
  bool wants_to_send() const { return !frames_.empty(); }

  // Returns the answer once for each service.
  std::optional<Answer> take();

  // Number of extra answers to services that a single device answers: two devices have the same
  // address.
  std::uint64_t doubled() const { return doubled_; }
  std::uint64_t malformed() const { return malformed_; }
  std::uint64_t unexpected() const { return unexpected_; }  // answers without a request

 private:
  void push(Command command, std::uint32_t number = 0);
  void finish(const Answer& answer);
  void answered(const Message& message, Instant now);
  bool is_awaited(Command command) const;

  Duration timeout_;
  Duration patience_{};  // time-out of the current service
  bool of_one_ = false;  // Request::of_one of the current service
  bool busy_ = false;
  Service service_ = Service::switch_global;
  Command expected_ = Command::switch_global;  // switch_global: no answer is expected
  std::deque<can::Frame> frames_;
  Instant deadline_ = kNever;
  std::optional<Answer> answer_;
  // First answer where several devices may answer, until the slower ones had time.
  std::optional<Answer> held_;
  Command last_ = Command::switch_global;  // last answer of a single device
  std::uint64_t doubled_ = 0;
  std::uint64_t malformed_ = 0;
  std::uint64_t unexpected_ = 0;
};

}  // namespace linegate::lss
