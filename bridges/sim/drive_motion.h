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

  // Moves one step towards the target position and stops there without overshoot.
  void step_to_position(double target, const Limits& limits);
  // Moves one step, with the velocity (increments/s) approaching the target.
  void step_to_velocity(double target, const Limits& limits);
  // Stops at once: without voltage the simulated axis has no inertia.
  void halt() { velocity_ = 0; }
  void set_position(double position) { position_ = position; }

  double position() const { return position_; }
  double velocity() const { return velocity_; }

 private:
  double position_ = 0;
  double velocity_ = 0;
};

}  // namespace linegate::sim
