// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/drive_motion.h"

#include <algorithm>
#include <cmath>

namespace linegate::sim {
namespace {

constexpr double kSeconds = std::chrono::duration<double>(DriveMotion::kStep).count();

}  // namespace

void DriveMotion::step_to_velocity(double target, const Limits& limits) {
  const double most = limits.acceleration * kSeconds;
  velocity_ += std::clamp(target - velocity_, -most, most);
  position_ += velocity_ * kSeconds;
}

void DriveMotion::step_to_position(double target, const Limits& limits) {
  const double distance = target - position_;
  const double most = limits.acceleration * kSeconds;
  if (std::abs(distance) <= most * kSeconds && std::abs(velocity_) <= 2 * most) {
    position_ = target;
    velocity_ = 0;
    return;
  }
  // The highest velocity from which the axis can stop at the target without overshoot.
  const double braking = std::sqrt(2 * limits.acceleration * std::abs(distance)) - most / 2;
  const double wanted =
      std::min({limits.velocity, std::max(braking, most / 2), std::abs(distance) / kSeconds});
  step_to_velocity(std::copysign(wanted, distance), limits);
}

}  // namespace linegate::sim
