// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <optional>

#include <spdlog/spdlog.h>

#include "bridges/sim/device.h"
#include "gateway/config/value.h"
#include "gateway/runtime/channels.h"
#include "gateway/runtime/device_runner.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/log.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

struct Simulation {
  config::Interface interface;
  std::uint32_t bit_rate = 0;
  std::uint32_t data_bit_rate = 0;
  std::vector<config::SimulatedDevice> devices;
};

void complain(const std::string& text) {
  std::cerr << "error: " << text << '\n';
}

bool read_uri(const std::string& text, Simulation& out) {
  std::string error;
  out.interface = config::parse_interface(text, {}, error);
  if (!error.empty()) {
    complain(text + ": " + error);
  }
  return error.empty();
}

// PROFILE:NODE-ID, or PROFILE:NODE-ID:unconfigured.
bool read_device(std::string text, Simulation& out) {
  constexpr std::string_view kUnconfigured = ":unconfigured";
  const bool unconfigured = text.ends_with(kUnconfigured);
  if (unconfigured) {
    text.resize(text.size() - kUnconfigured.size());
  }
  const std::size_t colon = text.rfind(':');
  const auto node =
      colon == std::string::npos ? std::nullopt : config::parse_unsigned(text.substr(colon + 1));
  if (!node || *node < 1 || *node > 127) {
    complain("--device is PROFILE:NODE-ID with a node-ID from 1 to 127, for example drive:5, not " +
             text);
    return false;
  }
  out.devices.push_back({.node = static_cast<std::uint8_t>(*node),
                         .profile = text.substr(0, colon),
                         .unconfigured = unconfigured,
                         .serial = {}});
  return true;
}

// The profile whose device file is that of the node, by the name of the file.
std::optional<std::string> profile_by_file(const line::NodeConfig& node) {
  const std::string file = std::filesystem::path(node.device.file).filename().string();
  for (const auto profile : sim::profiles()) {
    if (sim::eds_name(profile) == file) {
      return std::string(profile);
    }
  }
  return std::nullopt;
}

const config::LinePlan* choose_line(const config::Plant& plant, const std::string& name) {
  if (name.empty() && plant.lines.size() == 1) {
    return &plant.lines.front();
  }
  const auto it = std::find_if(plant.lines.begin(), plant.lines.end(),
                               [&](const auto& line) { return line.config.name == name; });
  if (it != plant.lines.end()) {
    return &*it;
  }
  std::string names;
  for (const auto& line : plant.lines) {
    names += (names.empty() ? "" : ", ") + line.config.name;
  }
  complain(name.empty() ? "--line is needed, one of " + names
                        : "there is no line " + name + "; there are " + names);
  return nullptr;
}

bool read_plant(const SimulateOptions& options, Simulation& out) {
  const auto loaded = config::load(options.plant);
  print(loaded.diagnostics);
  const auto* line = loaded.value ? choose_line(*loaded.value, options.line) : nullptr;
  if (line == nullptr) {
    return false;
  }
  out.bit_rate = line->config.bit_rate;
  out.data_bit_rate = line->config.data_bit_rate;
  if (options.uri.empty()) {
    if (line->interface.scheme == config::Scheme::simulated) {
      complain("line " + line->config.name + " simulates its devices itself; give an interface");
      return false;
    }
    out.interface = line->interface;
  }
  for (const auto& node : line->config.nodes) {
    if (const auto profile = profile_by_file(node)) {
      out.devices.push_back({.node = node.id,
                             .profile = *profile,
                             .unconfigured = false,
                             .serial = node.serial,
                             .fd = line->config.canopen_fd,
                             .emcy_fd = line->config.emcy_fd});
    } else {
      spdlog::warn("node {} ({}) is left out: {} is none of the simulated devices", node.id,
                   node.name, node.device.file);
    }
  }
  return true;
}

std::optional<Simulation> read_options(const SimulateOptions& options) {
  Simulation out;
  bool good = options.uri.empty() || read_uri(options.uri, out);
  good = (options.plant.empty() || read_plant(options, out)) && good;
  for (const auto& device : options.devices) {
    good = read_device(device, out) && good;
  }
  if (good && out.interface.uri.empty()) {
    complain("an interface is needed, for example socketcan:vcan0");
    good = false;
  }
  if (good && out.devices.empty()) {
    complain("there is no device to simulate; give --device PROFILE:NODE-ID or --plant");
    good = false;
  }
  return good ? std::optional(std::move(out)) : std::nullopt;
}

}  // namespace

int simulate(const SimulateOptions& options) {
  const auto simulation = read_options(options);
  if (!simulation) {
    return kExitUsage;
  }
  auto devices = make_devices(simulation->devices, options.storage, options.line);
  print(devices.diagnostics);
  if (!devices.value) {
    return kExitUsage;
  }
  sim::VirtualNetwork network;
  config::ExecutorPlan plan;
  plan.name = "devices";
  Executor executor(std::move(plan));
  executor.add(std::make_unique<DeviceRunner>(
      std::move(*devices.value),
      open_channel(simulation->interface, simulation->bit_rate, network, Use::transmit,
                   simulation->data_bit_rate),
      simulation->interface.uri, true));
  executor.start();
  for (const auto& device : simulation->devices) {
    spdlog::info("{} {} node-ID {} on {}", device.profile,
                 device.unconfigured ? "without a node-ID, else" : "with", device.node,
                 simulation->interface.uri);
  }
  wait_for_stop_signal();
  executor.request_stop();
  executor.join();
  return kExitOk;
}

}  // namespace linegate::gateway
