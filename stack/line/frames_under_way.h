// SPDX-License-Identifier: Apache-2.0
// Frames between the line and the bus, and the commands that wait for them: a command of an
// unconfirmed service (NMT, PDO, EMCY, some of LSS, frames of no CANopen service) is answered when
// the bus acknowledged its frames.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/line/command.h"
#include "stack/pdo/engine.h"
#include "stack/sdo/requests_under_way.h"

namespace linegate::line {

class FramesUnderWay {
 public:
  // Awaited::number of a lost frame
  static constexpr std::uint64_t kLost = std::numeric_limits<std::uint64_t>::max();

  // What a command waits for: a frame with the newest values of that TPDO, or a later sample of
  // them; with tpdo 0 exactly this frame, once.
  struct Awaited {
    std::uint16_t tpdo = 0;
    can::Frame frame{};
    // MPDO: any frame to the same destination, because a newer value replaces it
    bool any_value = false;
    // MPDO in source address mode: the TPDO that sends it, and sends the value again if the frame
    // is lost
    std::uint16_t scanning_tpdo = 0;
    std::uint8_t device = 0;  // role device: node-ID of the device that sends the TPDO or frame
    std::uint64_t samples = pdo::Engine::kEverySample;  // sample count when the value was written
    std::uint64_t number = 0;                           // of the frame; 0 = not handed out yet

    // No other frame has the value: it was replaced by the default of a reset
    bool is_only = false;

    std::uint16_t sender() const { return tpdo != 0 ? tpdo : scanning_tpdo; }
  };
  // An event that is emitted when the bus acknowledged a frame.
  struct Report {
    EventLog* events = nullptr;  // nullptr: no report
    Event event{};
  };
  // A command whose frames are not all acknowledged yet; or, with a report, the kind of command
  // that sends such a frame.
  struct Sending {
    Command command;
    std::vector<Awaited> frames;
    ReplyData data{};  // of the reply
    // One of the frames suffices: each has the value that was written. `data` is WrittenByPdo.
    bool any_frame = false;
    Instant deadline = kNever;
    Report report{};

    bool is_report() const { return report.events != nullptr; }
    // Some frame of them.
    bool is_handed_out() const {
      return std::ranges::any_of(frames, [](const Awaited& frame) { return frame.number != 0; });
    }
    // No frame will have the value: it was replaced by a reset, and its frames were lost.
    bool is_gone() const {
      return !frames.empty() && std::ranges::all_of(frames, [](const Awaited& frame) {
        return frame.is_only && frame.number == kLost;
      });
    }
  };
  static constexpr std::size_t kMost = 1024;  // waiting commands

  // Acknowledgements will be reported. Without this call each frame counts as acknowledged when it
  // is handed to the bus.
  void expect() { expected_ = true; }
  bool expected() const { return expected_; }

  // The number of the next frame; 0 if no acknowledgements are expected.
  std::uint64_t next_number() const { return expected_ ? handed_out_ + 1 : 0; }
  void handed_out(const can::Frame& frame, Instant now) {
    if (handed_out_ == ended_) {
      progress_ = now;
    }
    ++handed_out_;
    requests_.handed_out(frame, expected_ ? handed_out_ : 0);
  }
  // The SDO requests among the frames.
  const sdo::RequestsUnderWay& requests() const { return requests_; }

  // The frames up to that number have ended: acknowledged, or lost. Returns false if that was known
  // before.
  bool ended(std::uint64_t number, Instant now);
  // Whether all frames that the command waits for, or the one that suffices, are among those up to
  // that number.
  static bool is_sent(const Sending& sending, std::uint64_t number);
  // Precondition: is_sent(). With any_frame its TPDO is that of the frame that was acknowledged.
  static ReplyData take_data(Sending& sending, std::uint64_t number);
  // The frames first..last were lost. Frames before `first` may still be under way: a channel
  // reports those that it refused when it accepts the others.
  void lost(std::uint64_t first, std::uint64_t last);
  // The values that those commands wrote are gone. Removes and returns the commands without a
  // frame; the others wait for the frames that they have.
  std::vector<Sending> give_up_values(const std::function<bool(const Command&)>& is_gone);
  // Whether frames are under way and none was acknowledged for kStuck.
  bool is_stuck(Instant now) const { return handed_out_ > ended_ && now - progress_ >= kStuck; }
  static constexpr Duration kStuck = std::chrono::milliseconds(100);

  // Precondition: sendings().size() < kMost.
  void add(Sending sending);
  std::vector<Sending>& sendings() { return sendings_; }
  const std::vector<Sending>& sendings() const { return sendings_; }
  bool any() const { return !sendings_.empty(); }
  Instant next_deadline() const;

 private:
  void end(std::uint64_t number);

  bool expected_ = false;
  std::uint64_t handed_out_ = 0;
  std::uint64_t ended_ = 0;       // all frames up to this number have ended
  std::uint64_t lost_first_ = 0;  // the newest lost frames beyond ended_; 0 = none
  std::uint64_t lost_last_ = 0;
  sdo::RequestsUnderWay requests_;
  Instant progress_{};  // last acknowledgement, or first frame under way
  std::vector<Sending> sendings_;
};

}  // namespace linegate::line
