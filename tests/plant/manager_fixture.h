// SPDX-License-Identifier: Apache-2.0
// The line of a manager with simulated devices, and commands to it.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"

#include "tests/plant/world.h"

namespace linegate::plant {

using namespace std::chrono_literals;

inline std::vector<std::byte> number(std::uint32_t value, std::size_t size = 4) {
  std::vector<std::byte> out(size);
  store_le(std::span(out), value);
  return out;
}

// An SDO download to a device: expedited, segmented or as block.
inline bool is_download(const can::Frame& frame) {
  const auto command = std::to_integer<unsigned>(frame.data[0]) >> 5U;
  return frame.id > 0x600 && frame.id <= 0x67F && (command == 1 || command == 6);
}

// Permits remote requests of TPDO 1 of the node.
inline void permit_rtr(line::NodeConfig& node) {
  for (od::ObjectDescription& object : node.device.objects) {
    if (object.index == 0x1800) {
      auto& cob_id = *std::ranges::find(object.variables, 1, &od::VariableDescription::sub);
      cob_id.value = number(0x180U + node.id);
      cob_id.configured = true;
    }
  }
}

class ManagerFixture : public testing::Test {
 protected:
  static line::NodeConfig node_of(std::uint8_t id, const std::string& profile) {
    line::NodeConfig node;
    node.id = id;
    node.name = profile + std::to_string(id);
    node.device = *eds::load(sim::eds_text(profile), sim::eds_name(profile), id).value;
    node.heartbeat = 100ms;
    return node;
  }

  // The configuration of the line; change it before start().
  line::LineConfig& config() { return config_; }
  // Its bus; change it before start().
  sim::BusOptions& bus() { return bus_; }
  // Call it before start(), in ascending order of id.
  void add(line::NodeConfig node, const std::string& profile) {
    devices_.emplace_back(node.id, profile);
    config_.nodes.push_back(std::move(node));
  }

  // Runs for 2 s; then all valid nodes are Operational.
  LineSeat& start() {
    config_.name = "press";
    config_.heartbeat = 500ms;
    auto made = line::Line::make(std::move(config_));
    EXPECT_TRUE(made.ok());
    seat_ = &world_.add_line(*std::move(made.value), bus_);
    for (const auto& [id, profile] : devices_) {
      sim::DeviceOptions options;
      options.node_id = id;
      options.profile = profile;
      options.seed = id;
      auto device = *std::move(sim::Device::make(options).value);
      prepare(*device);
      world_.add_device(*seat_, std::move(device));
    }
    world_.start();
    pass(2s);
    return *seat_;
  }

  // Called for each device before it is switched on.
  virtual void prepare(sim::Device& /*device*/) {}

  LineSeat& seat() { return *seat_; }
  World& world() { return world_; }
  void pass(Duration time) { world_.run(world_.now() + time); }

  // Returns the tag.
  std::uint64_t execute(line::Command command) {
    const std::uint64_t tag = ++tags_;
    command.tag = tag;
    seat_->silence.commanded(command);
    seat_->line->execute(std::move(command), world_.now());
    world_.settle();
    return tag;
  }
  line::Reply wait(std::uint64_t tag, Duration longest = 60s) {
    const Instant end = world_.now() + longest;
    while (!seat_->replies.contains(tag) && world_.now() < end && world_.failure().empty()) {
      pass(100ms);
    }
    EXPECT_EQ(world_.failure(), "");
    EXPECT_TRUE(seat_->replies.contains(tag));
    return seat_->replies[tag];
  }
  // Writes an object of the line's own dictionary.
  Error write_own(od::Address address, std::vector<std::byte> data) {
    line::Command command{.request = line::LocalWrite{.address = {address.index, address.sub},
                                                      .data = std::move(data)}};
    return wait(execute(std::move(command))).error;
  }

 private:
  World world_;
  line::LineConfig config_;
  sim::BusOptions bus_;
  std::vector<std::pair<std::uint8_t, std::string>> devices_;
  LineSeat* seat_ = nullptr;
  std::uint64_t tags_ = 0;
};

}  // namespace linegate::plant
