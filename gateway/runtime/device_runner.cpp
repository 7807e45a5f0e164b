// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/device_runner.h"

#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "gateway/runtime/parameter_file.h"

namespace linegate::gateway {

Loaded<sim::DeviceGroup> make_devices(std::span<const config::SimulatedDevice> devices,
                                      const std::string& storage, const std::string& name) {
  Loaded<sim::DeviceGroup> loaded;
  if (const auto problem = make_parameter_folder(storage)) {
    loaded.diagnostics.push_back(*problem);
  }
  sim::DeviceGroup group;
  for (const auto& wanted : devices) {
    sim::DeviceOptions options;
    options.profile = wanted.profile;
    options.node_id = wanted.node;
    options.seed = wanted.node;
    options.unconfigured = wanted.unconfigured;
    options.serial = wanted.serial;
    options.fd = wanted.fd;
    options.emcy_fd = wanted.emcy_fd;
    if (!storage.empty()) {
      options.medium = std::make_shared<ParameterFile>(parameter_path(storage, name, wanted.node));
    }
    auto device = sim::Device::make(options);
    loaded.diagnostics.insert(loaded.diagnostics.end(), device.diagnostics.begin(),
                              device.diagnostics.end());
    if (device.value && !group.add(std::move(*device.value))) {
      loaded.diagnostics.push_back(
          {Severity::error, "", 0, 0,
           "two simulated devices with node-ID " + std::to_string(wanted.node)});
    }
  }
  if (!has_errors(loaded.diagnostics)) {
    loaded.value = std::move(group);
  }
  return loaded;
}

DeviceRunner::DeviceRunner(sim::DeviceGroup devices, std::unique_ptr<can_bridge::Channel> channel,
                           std::string interface, bool report_failures)
    : devices_(std::move(devices)),
      pump_(std::move(channel)),
      interface_(std::move(interface)),
      report_failures_(report_failures) {
}

void DeviceRunner::service(Instant now) {
  const Instant known = pump_.drain(
      now,
      [&](std::span<const can::Frame> frames) {
        if (started_) {
          devices_.receive(frames);
        }
      },
      [&](const can::BusEvent& event) { bus_event(event, now); });
  now = std::max(now, known);  // frames were received while the channel was read
  if (started_ && !stopping_) {
    devices_.advance(known);
    pump_.transmit(now, [&](can::Frame& frame) { return devices_.next_frame(frame, now); });
  }
  next_wake_ = pump_.more() ? now : pump_.channel().next_wake();
  if (started_ && !stopping_) {
    next_wake_ = earlier(next_wake_, devices_.next_wake());
  }
}

void DeviceRunner::bus_event(const can::BusEvent& event, Instant now) {
  if (event.kind == can::BusEvent::Kind::interface_failed && report_failures_) {
    spdlog::error("{}", can_bridge::describe_failure(interface_, event.code));
  }
  if (event.kind != can::BusEvent::Kind::interface_ready) {
    return;
  }
  if (report_failures_) {
    spdlog::info("interface {} ready", interface_);
  }
  if (!started_) {
    started_ = true;
    devices_.start(now);
  }
}

void DeviceRunner::stop(Instant now) {
  stopping_ = true;
  next_wake_ = now;
}

bool DeviceRunner::stopped(Instant /*now*/) const {
  return stopping_;
}

}  // namespace linegate::gateway
