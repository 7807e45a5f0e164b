// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/device_model.h"

#include <array>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/dictionary.h"

namespace linegate::plant {
namespace {

constexpr std::uint16_t kValue = 0x2F01;
constexpr std::uint16_t kFollowed = 0x2F02;

std::uint8_t byte(const can::Frame& frame, std::size_t place) {
  return std::to_integer<std::uint8_t>(frame.data[place]);
}

std::uint64_t number(sim::Device& device, std::uint16_t index) {
  return device.node().dictionary().number({index, 0}).value_or(0);
}

// A write of 100Ch or 100Dh by the default client, expedited, that the device executes: it does not
// while it is stopped.
bool writes_guarding(sim::Device& device, const can::Frame& frame) {
  const std::uint16_t index = load_le<std::uint16_t>(frame.data.data() + 1);
  return device.node().state() != nmt::State::stopped &&
         frame.id == can::kSdoRequestBase + device.node_id() &&
         frame.length == can::kMaxClassicData && byte(frame, 0) >> 5U == 1 &&
         (index == 0x100C || index == 0x100D);
}

}  // namespace

void DeviceModel::before_receive(sim::Device& device, const can::Frame& frame) {
  if (!device.alive()) {
    return;
  }
  if (!frame.extended()) {
    follow_guarding(device, frame);
  }
  if (frame.remote()) {
    return;
  }
  if (!frame.extended()) {
    follow_nmt(device.node_id(), frame);
  }
  follow_mpdo(device, frame);
}

void DeviceModel::follow_nmt(std::uint8_t node, const can::Frame& frame) {
  const bool meant =
      frame.id == 0 && frame.length == 2 && (byte(frame, 1) == 0 || byte(frame, 1) == node);
  if (!meant) {
    return;
  }
  const auto command = static_cast<nmt::Command>(byte(frame, 0));
  if (nmt::is_reset(command)) {
    guarded_until_ = kNever;
  }
  if (command == nmt::Command::reset_node) {
    value_ = 0;
    followed_ = 0;
  }
}

// The life time restarts with each request; there is no life guarding while the device has a
// heartbeat.
void DeviceModel::follow_guarding(sim::Device& device, const can::Frame& frame) {
  const std::uint8_t node = device.node_id();
  if (!frame.remote() && writes_guarding(device, frame)) {
    guarded_until_ = kNever;
  }
  if (!frame.remote() || frame.id != can::kErrorControlBase + node || number(device, 0x1017) != 0) {
    return;
  }
  if (guarded_until_ < frame.time) {
    guarding_lost_.push_back(guarded_until_);
  }
  const std::uint64_t life = number(device, 0x100C) * number(device, 0x100D);
  guarded_until_ = life == 0 ? kNever : frame.time + std::chrono::milliseconds(life);
}

void DeviceModel::follow_mpdo(sim::Device& device, const can::Frame& frame) {
  if (!mpdo_ || frame.length != can::kMaxClassicData ||
      device.node().state() != nmt::State::operational) {
    return;
  }
  constexpr std::uint8_t kToDestination = 0x80;
  const std::uint8_t head = byte(frame, 0);
  const auto index = load_le<std::uint16_t>(frame.data.data() + 1);
  const auto value = load_le<std::uint32_t>(frame.data.data() + 4);
  if (byte(frame, 3) != 0) {
    return;
  }
  if (frame.id == kMpdoToAll && !frame.extended() &&
      (head == kToDestination || head == (kToDestination | device.node_id()))) {
    value_ = index == kValue ? value : value_;
    followed_ = index == kFollowed ? value : followed_;
  }
  if (mpdo_of_ != 0 && frame.extended() && frame.id == kMpdoOfNode + mpdo_of_ && head == mpdo_of_ &&
      index == kValue) {
    followed_ = value;
  }
}

void DeviceModel::after_advance(sim::Device& device, Instant now) {
  if (device.alive() && guarded_until_ <= now) {
    guarding_lost_.push_back(guarded_until_);
    guarded_until_ = kNever;
  }
  std::array<Event, 16> events;
  while (const std::size_t count = device.pop_events(events)) {
    for (const Event& event : std::span(events).first(count)) {
      const auto* const lost = event.get<event::HeartbeatLost>();
      if (lost != nullptr && lost->by == event::ErrorControl::life_guarding) {
        guarding_lost_told_.push_back(event.time);
      }
    }
  }
}

void DeviceModel::power_off() {
  guarded_until_ = kNever;
  value_ = 0;
  followed_ = 0;
}

std::string DeviceModel::compare(sim::Device& device) const {
  const std::string name = "device " + std::to_string(device.options().node_id);
  if (guarding_lost_ != guarding_lost_told_) {
    return name + " lost its life guarding " + std::to_string(guarding_lost_.size()) +
           " times, and told so " + std::to_string(guarding_lost_told_.size()) +
           " times, or at other times";
  }
  if (!mpdo_ || !device.alive()) {
    return {};
  }
  for (const auto& [index, value] : {std::pair{kValue, value_}, std::pair{kFollowed, followed_}}) {
    if (number(device, index) != value) {
      return name + " has " + std::to_string(number(device, index)) + " in " +
             (index == kValue ? "2F01h" : "2F02h") + ", MPDOs brought " + std::to_string(value);
    }
  }
  return {};
}

}  // namespace linegate::plant
