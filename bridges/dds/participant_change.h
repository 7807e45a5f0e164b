// SPDX-License-Identifier: Apache-2.0
// When a client changes to another participant, because the host got an address that the present
// one was created without: Fast DDS 2.9.1 looks at the interfaces when a participant is created
// (upstream issues 664, 1880, 4371), and set_qos() announces wrong ports afterwards (2676).
//
// Both participants exist for a moment: the new one is used once it has matched as many endpoints
// as the present one, so nothing is lost. If it does not, it is given up and another one is tried:
// with DDS-Security Fast DDS 2.9.1 does not authenticate every participant that joins late.
#pragma once

#include <algorithm>
#include <chrono>

#include "stack/base/time.h"

namespace linegate::dds {

// By a clock that never goes back.
class ParticipantChange {
 public:
  // Between two that are created; it doubles with each that is given up.
  static constexpr Duration kPause = std::chrono::seconds(5);
  static constexpr Duration kLongestPause = std::chrono::seconds(60);
  static constexpr Duration kLook = std::chrono::seconds(1);  // between two looks at the addresses
  // The time to match what the present one has. Longer than the lease of a gateway that is gone.
  static constexpr Duration kOverlap = std::chrono::seconds(6);
  static constexpr Duration kStep = std::chrono::milliseconds(50);  // while both exist

  // Whether it is time to look at the addresses.
  bool looks(Instant now) {
    if (now < look_at_)
      return false;
    look_at_ = now + kLook;
    return true;
  }
  // Another participant is needed.
  void want() { wanted_ = true; }
  // Whether it is to be created now.
  bool begins(Instant now) const { return wanted_ && now >= not_before_; }
  // It was created.
  void began(Instant now) {
    wanted_ = false;
    look_at_ = now + kStep;
    end_by_ = now + kOverlap;
    not_before_ = now + kPause;
  }
  // Whether the new one, which has not matched all that the present one has, is given up.
  bool gives_up(Instant now) {
    look_at_ = now + kStep;
    return now >= end_by_;
  }
  // It could not be created, or was given up.
  void failed(Instant now) {
    wanted_ = true;
    pause_ = std::min(2 * pause_, kLongestPause);
    not_before_ = now + pause_;
  }
  // It is used from now on.
  void ended() { pause_ = kPause; }

  // When to ask next.
  Instant next_wake() const { return look_at_; }

 private:
  bool wanted_ = false;
  Duration pause_ = kPause;
  Instant look_at_{};
  Instant end_by_{};
  Instant not_before_{};
};

}  // namespace linegate::dds
