// SPDX-License-Identifier: Apache-2.0
// Several simulated devices behind one channel. What one of them sends the others hear too, since a
// channel does not give back its own frames.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bridges/sim/device.h"

namespace linegate::sim {

class DeviceGroup {
 public:
  // False if a device with this node-ID is there already; it is dropped then.
  bool add(std::unique_ptr<Device> device);
  // nullptr if there is none with this node-ID.
  Device* find(std::uint8_t node_id);
  std::span<const std::unique_ptr<Device>> devices() const { return devices_; }

  void start(Instant now);
  void receive(std::span<const can::Frame> frames);
  void advance(Instant now);
  Instant next_wake() const;
  // The frame that would win arbitration among the devices' most urgent ones, as far as they are
  // known; false if none wants to send. The other devices have received it at `now`.
  bool next_frame(can::Frame& out, Instant now);
  bool wants_to_send(Instant now) const;

 private:
  struct Offered {
    can::Frame frame;
    bool valid = false;
  };
  bool refresh_offer(std::size_t index, Instant now);

  std::vector<std::unique_ptr<Device>> devices_;
  std::vector<Offered> offered_;  // per device: its next frame, pulled but not given out yet
};

}  // namespace linegate::sim
