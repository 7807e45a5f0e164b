// Frames between the line and the bus, and the commands that wait for them: a service that is not
// confirmed (NMT, PDO, frames of no CANopen service) is answered when its frame was acknowledged on
// the bus. Private to stack/line.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/line/command.h"

namespace linegate::line {

class FramesUnderWay {
 public:
  // A command whose frame is not acknowledged yet.
  struct Sending {
    Command command;  // without data
    // What it waits for: a frame with the newest values of that TPDO, or with tpdo 0 this frame.
    std::uint16_t tpdo = 0;
    can::Frame frame;
    std::vector<std::byte> data;  // of the reply
    Instant deadline = kNever;
    std::uint64_t number = 0;  // of the frame; 0 = not handed out yet
  };
  static constexpr std::uint64_t kLost = std::numeric_limits<std::uint64_t>::max();  // number
  static constexpr std::size_t kMost = 1024;  // commands that wait

  // Without it each frame counts as acknowledged when it is handed out.
  void expect() { expected_ = true; }
  bool expected() const { return expected_; }

  // The number of the next frame to be handed out; 0 if nothing is expected.
  std::uint64_t next_number() const { return expected_ ? handed_out_ + 1 : 0; }
  void handed_out(Instant now) {
    if (handed_out_ == ended_) {
      progress_ = now;
    }
    ++handed_out_;
  }

  // The frames up to that number have ended: acknowledged, or lost. False if that is no news.
  bool ended(std::uint64_t number, Instant now);
  // What a command waits for was lost.
  void lost(std::uint64_t first, std::uint64_t last);
  // Frames are under way, and none was acknowledged for kStuck.
  bool is_stuck(Instant now) const { return handed_out_ > ended_ && now - progress_ >= kStuck; }
  static constexpr Duration kStuck = std::chrono::milliseconds(100);

  // Precondition: sendings().size() < kMost.
  void add(Sending sending) { sendings_.push_back(std::move(sending)); }
  std::vector<Sending>& sendings() { return sendings_; }
  const std::vector<Sending>& sendings() const { return sendings_; }
  bool any() const { return !sendings_.empty(); }
  Instant next_deadline() const;

 private:
  bool expected_ = false;
  std::uint64_t handed_out_ = 0;
  std::uint64_t ended_ = 0;
  Instant progress_{};  // last acknowledgement, or first frame under way
  std::vector<Sending> sendings_;
};

}  // namespace linegate::line
