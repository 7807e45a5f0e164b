// SPDX-License-Identifier: Apache-2.0
// A socket pair in the place of a CAN interface: what is sent on one end arrives on the other with
// the kernel's receive stamp, in the kernel's own format of CAN frames.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <linux/can.h>

#include "stack/can/frame.h"

namespace linegate::bench {

class Wire {
 public:
  Wire();
  ~Wire();
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  int near() const { return near_; }
  // The end that is measured; whoever takes it closes it.
  int far() const { return far_; }

  // All of them, in as few system calls as possible.
  void send(std::span<can_frame> frames) const;

  // Answers what a manager sends to boot its nodes, for that long: boot-up messages of nodes
  // 1..count first, then every SDO request.
  void play_devices(int count, int milliseconds) const;

 private:
  int near_ = -1;
  int far_ = -1;
};

std::vector<can_frame> raw(std::span<const can::Frame> frames);

}  // namespace linegate::bench
