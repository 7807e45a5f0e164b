// SPDX-License-Identifier: Apache-2.0
// The axis of a simulated drive: position and velocity under limits, in steps of 10 ms.
#pragma once

#include <cstdint>

#include "stack/base/time.h"

namespace linegate::sim {

class DriveMotion {
 public:
  static constexpr Duration kStep = std::chrono::milliseconds(10);

  struct Limits {
    double velocity = 0;      // increments/s, > 0
    double acceleration = 0;  // increments/s^2, > 0
  };

  // Moves one step towards the target, so that the axis comes to rest there.
  void step_to_position(double target, const Limits& limits);
  // One step towards the velocity, increments/s.
  void step_to_velocity(double target, const Limits& limits);
  // Stands still at once: the axis has no mass without voltage.
  void halt() { velocity_ = 0; }
  void set_position(double position) { position_ = position; }

  double position() const { return position_; }
  double velocity() const { return velocity_; }

 private:
  double position_ = 0;
  double velocity_ = 0;
};

}  // namespace linegate::sim
