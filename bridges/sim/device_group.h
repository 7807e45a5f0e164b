// SPDX-License-Identifier: Apache-2.0
// Several simulated devices behind one channel. A channel does not return its own frames, so the
// group delivers the frames of each device to the others.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bridges/sim/device.h"

namespace linegate::sim {

class DeviceGroup {
 public:
  // Returns false, and destroys the device, if its node-ID is already in use.
  bool add(std::unique_ptr<Device> device);
  // nullptr if no device has this node-ID.
  Device* find(std::uint8_t node_id);
  std::span<const std::unique_ptr<Device>> devices() const { return devices_; }

  void start(Instant now);
  void receive(std::span<const can::Frame> frames);
  void advance(Instant now);
  Instant next_wake() const;
  // Returns the frame that wins arbitration among the known most urgent frames of the devices;
  // false if there is none. The other devices receive it at `now`.
  bool next_frame(can::Frame& out, Instant now);
  bool wants_to_send(Instant now) const;

 private:
  struct Offered {
    can::Frame frame;
    bool valid = false;
  };
  bool refresh_offer(std::size_t index, Instant now);

  std::vector<std::unique_ptr<Device>> devices_;
  std::vector<Offered> offered_;  // by device: its next frame, pulled but not yet returned
};

}  // namespace linegate::sim
