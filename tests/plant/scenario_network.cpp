// Statements that describe the network, and how it is built.
#include <algorithm>
#include <utility>

#include "stack/eds/reader.h"

#include "tests/plant/scenario_run.h"

namespace linegate::plant {

using image::Direction;

namespace {

// 2F00h, which its EDS does not know.
od::ObjectDescription domain_object() {
  od::VariableDescription domain;
  domain.type = od::DataType::domain;
  domain.access = od::Access::rw;
  od::ObjectDescription out;
  out.index = 0x2F00;
  out.name = "Program";
  out.variables.push_back(std::move(domain));
  return out;
}

}  // namespace

void Scenario::describe_line(Words& words) {
  NetworkPlan plan;
  plan.config.name = words.take();
  plan.config.heartbeat = std::chrono::milliseconds(500);
  while (!words.done()) {
    const std::string key = words.take();
    if (key == "bitrate") {
      plan.bus.bit_rate = static_cast<std::uint32_t>(words.number());
    } else if (key == "sync") {
      plan.config.sync_period = words.duration();
    } else if (key == "buffers") {
      plan.bus.buffers = words.number();
    } else if (key == "network") {
      plan.config.network_id = static_cast<std::uint16_t>(words.number());
    } else if (key == "interface") {
      plan.config.routing.interface = static_cast<std::uint8_t>(words.number());
    } else if (key == "channels") {
      words.expect("per-node");
      plan.config.routing.channels = routing::ChannelRule::per_node;
    } else if (key == "own") {
      plan.config.node_id = words.node();
    } else {
      throw BadStatement("unknown property of a line '" + key + "'");
    }
  }
  plan.config.bit_rate = plan.bus.bit_rate;
  plans_.push_back(std::move(plan));
}

void Scenario::describe_device(Words& words) {
  if (plans_.empty() || built_) {
    throw BadStatement("a device comes after its line and before the first 'at'");
  }
  sim::DeviceOptions device{.node_id = words.node()};
  device.profile = words.take();
  device.seed = seed_ * 128 + device.node_id;
  line::NodeConfig node{.id = device.node_id};
  node.name = device.profile + std::to_string(device.node_id);
  node.heartbeat = std::chrono::milliseconds(100);
  bool listed = true;
  bool present = true;
  bool domain = false;
  bool ours = false;
  while (!words.done()) {
    const std::string key = words.take();
    if (key == "heartbeat") {
      node.heartbeat = words.duration();
    } else if (key == "consumer") {
      node.heartbeat_consumer = words.duration();
    } else if (key == "guarding") {
      node.heartbeat = Duration::zero();
      node.guard_time = words.duration();
      node.life_time_factor = static_cast<std::uint8_t>(words.number());
    } else if (key == "mandatory") {
      node.mandatory = true;
    } else if (key == "serial") {
      node.serial = static_cast<std::uint32_t>(words.number());
    } else if (key == "boot-timeout") {
      node.boot_timeout = words.duration();
    } else if (key == "deadline") {
      node.pdo_deadline = words.duration();
    } else if (key == "domain") {
      domain = true;
    } else if (key == "unlisted") {
      listed = false;
    } else if (key == "ours") {
      ours = true;
    } else if (key == "absent") {
      present = false;
    } else {
      throw BadStatement("unknown property of a device '" + key + "'");
    }
  }
  NetworkPlan& plan = plans_.back();
  if (listed) {
    const auto file =
        eds::load(sim::eds_text(device.profile), sim::eds_name(device.profile), node.id);
    if (!file.ok()) {
      throw BadStatement("no device profile '" + device.profile + "'");
    }
    node.device = *file.value;
    if (ours) {
      plan.ours.push_back({.id = node.id, .name = node.name, .device = node.device});
    }
    plan.config.nodes.push_back(std::move(node));
    std::ranges::sort(plan.config.nodes, {}, &line::NodeConfig::id);
  }
  if (domain) {
    plan.domains.insert(device.node_id);
  }
  if (present && !ours) {
    plan.devices.push_back(std::move(device));
  }
}

// route FIRST LAST over INTERFACE [via NODE] [cost N]
void Scenario::describe_route(Words& words) {
  routing::Route route{.first = static_cast<std::uint16_t>(words.number()),
                       .last = static_cast<std::uint16_t>(words.number())};
  words.expect("over");
  route.interface = static_cast<std::uint8_t>(words.number());
  if (words.accept("via")) {
    route.gateway = words.node();
  }
  if (words.accept("cost")) {
    route.cost = static_cast<std::uint16_t>(words.number());
  }
  plans_.back().config.routing.routes.push_back(route);
}

// admit FIRST LAST read|write|all
void Scenario::describe_access(Words& words) {
  routing::AccessRule rule{.first = static_cast<std::uint16_t>(words.number()),
                           .last = static_cast<std::uint16_t>(words.number())};
  const std::string what = words.take();
  rule.sdo_read = what != "write";
  rule.sdo_write = what != "read";
  plans_.back().config.routing.access.push_back(rule);
}

void Scenario::build() {
  if (std::exchange(built_, true)) {
    return;
  }
  std::vector<routing::Interface> interfaces;
  for (const NetworkPlan& plan : plans_) {
    if (plan.config.routing.interface != 0) {
      interfaces.push_back(
          {plan.config.routing.interface, plan.config.network_id, plan.config.node_id});
    }
  }
  for (NetworkPlan& plan : plans_) {
    plan.config.routing.interfaces = interfaces;
  }
  plan_forwards();
  for (NetworkPlan& plan : plans_) {
    line::LineConfig below{.name = plan.config.name + "-ours", .role = line::Role::device};
    below.devices = std::move(plan.ours);
    auto made = line::Line::make(std::move(plan.config));
    if (!made.ok()) {
      throw BadStatement(to_string(made.diagnostics.front()));
    }
    LineSeat& seat = world_.add_line(*std::move(made.value), plan.bus);
    for (const sim::DeviceOptions& options : plan.devices) {
      auto device = sim::Device::make(options);
      if (!device.ok()) {
        throw BadStatement(to_string(device.diagnostics.front()));
      }
      if (plan.domains.contains(options.node_id)) {
        (void)(*device.value)->dictionary().add(domain_object()).ok();
      }
      world_.add_device(seat, *std::move(device.value));
    }
    if (!below.devices.empty()) {
      std::ranges::sort(below.devices, {}, &line::DeviceConfig::id);
      auto devices = line::Line::make(std::move(below));
      if (!devices.ok()) {
        throw BadStatement(to_string(devices.diagnostics.front()));
      }
      world_.add_ours(seat, *std::move(devices.value));
    }
    current_ = current_ == nullptr ? &seat : current_;
  }
  for (const auto& [ends, what] : followings_) {
    world_.join(*world_.find(ends.first), *world_.find(ends.second), what);
  }
  world_.start();
}

}  // namespace linegate::plant
