// SPDX-License-Identifier: Apache-2.0
// Runs simulated devices on a channel.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "bridges/sim/device_group.h"
#include "gateway/config/plant.h"
#include "gateway/runtime/frame_pump.h"
#include "gateway/runtime/runner.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

// Creates all devices. Returns diagnostics if a profile is unknown, a node-ID is invalid or used
// twice, or the folder cannot be created. storage: the folder where each device has its file,
// parameter_path(storage, name, node); empty = none.
Loaded<sim::DeviceGroup> make_devices(std::span<const config::SimulatedDevice> devices,
                                      const std::string& storage = {},
                                      const std::string& name = {});

class DeviceRunner final : public Runner {
 public:
  // The devices are switched on as soon as the channel is usable. report_failures: log failures of
  // the interface here, because no line does.
  DeviceRunner(sim::DeviceGroup devices, std::unique_ptr<can_bridge::Channel> channel,
               std::string interface, bool report_failures);

  int descriptor() const override { return pump_.channel().descriptor(); }
  bool wants_writable() const override { return pump_.channel().wants_writable(); }
  void service(Instant now) override;
  Instant next_wake() const override { return next_wake_; }
  void stop(Instant now) override;
  bool stopped(Instant now) const override;

 private:
  void bus_event(const can::BusEvent& event, Instant now);

  sim::DeviceGroup devices_;
  FramePump pump_;
  std::string interface_;
  bool report_failures_;
  bool started_ = false;
  bool stopping_ = false;
  Instant next_wake_{};
};

}  // namespace linegate::gateway
