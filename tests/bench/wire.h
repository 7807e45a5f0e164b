// SPDX-License-Identifier: Apache-2.0
// A socket pair in the place of a CAN interface: a frame that is sent on one end arrives on the
// other with the kernel's receive stamp, in the kernel's format of CAN frames.
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
  // The measured end. The caller that takes it must close it.
  int far() const { return far_; }

  // Sends all frames, in as few system calls as possible.
  void send(std::span<can_frame> frames) const;

  // Answers the frames with which a manager boots its nodes, for `milliseconds`: sends the boot-up
  // messages of nodes 1 to `count` first, then answers every SDO request.
  void play_devices(int count, int milliseconds) const;

 private:
  int near_ = -1;
  int far_ = -1;
};

std::vector<can_frame> raw(std::span<const can::Frame> frames);

}  // namespace linegate::bench
