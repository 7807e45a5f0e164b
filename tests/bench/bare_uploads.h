// SPDX-License-Identifier: Apache-2.0
// A minimal client of SDO uploads: answers each frame of a server with the frame that continues the
// transfer, if there is one. No time-outs, no checks, no storage of data.
#pragma once

#include <array>
#include <cstdint>

#include <linux/can.h>

namespace linegate::bench {

class BareUploads {
 public:
  // Starts an upload, which is started again each time it ends, until stop().
  template <class Send>
  void begin(std::uint8_t node, Send send) {
    ++under_way_;
    states_[node] = State::initiated;
    send(initiate(node));
  }
  void stop() { go_on_ = false; }

  // Processes a frame from a server.
  template <class Send>
  void answer(const can_frame& frame, Send send) {
    can_frame out{};
    if (proceed(frame, out)) {
      send(out);
    }
    const auto node = static_cast<std::uint8_t>(frame.can_id & 0x7FU);
    if (states_[node] == State::over) {
      --under_way_;
      ++ended_;
      states_[node] = State::idle;
      if (go_on_) {
        begin(node, send);
      }
    }
  }

  unsigned under_way() const { return under_way_; }
  unsigned ended() const { return ended_; }

 private:
  enum class State : std::uint8_t { idle, initiated, segments, block, block_end, over };

  static can_frame initiate(std::uint8_t node);
  // Returns whether there is an answer, and stores it in out.
  bool proceed(const can_frame& frame, can_frame& out);

  std::array<State, 128> states_{};
  unsigned under_way_ = 0;
  unsigned ended_ = 0;
  bool go_on_ = true;
};

}  // namespace linegate::bench
