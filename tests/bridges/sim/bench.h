// SPDX-License-Identifier: Apache-2.0
// One simulated device without a bus: virtual time, frames of the test, and the frames it sends.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bridges/sim/device.h"
#include "stack/can/cob_id.h"

namespace linegate::sim {

class DeviceBench {
 public:
  static constexpr std::uint8_t kNode = 5;

  explicit DeviceBench(const std::string& profile, std::uint64_t seed = 0) {
    DeviceOptions options;
    options.profile = profile;
    options.node_id = kNode;
    options.seed = seed;
    options.heartbeat = std::chrono::milliseconds(0);
    auto made = Device::make(options);
    EXPECT_TRUE(made.ok());
    device = std::move(*made.value);
    device->start(now);
    run(Duration{});
  }

  // Advances the time and collects the sent frames.
  void run(Duration duration) {
    const Instant end = now + duration;
    drain();
    while (device->next_wake() <= end) {
      now = std::max(now, device->next_wake());
      device->advance(now);
      drain();
    }
    now = end;
    device->advance(now);
    drain();
  }

  void give(can::Frame frame) {
    frame.time = now;
    device->receive({&frame, 1});
    device->advance(now);
    drain();
  }
  void nmt(nmt::Command command) {
    give(can::make_frame(can::kNmtId, {static_cast<std::uint8_t>(command), kNode}));
  }
  void start_node() { nmt(nmt::Command::start); }
  void sync() { give(can::make_frame(can::kSyncId)); }

  // Writes like an expedited USDO download of node 1.
  void write_fd(od::Address address, std::uint64_t value, std::size_t size) {
    can::Frame frame;
    frame.id = can::kSdoRequestBase + 1;
    frame.flags = can::Frame::kFd;
    frame.length = can::fd_length(8 + size);
    const std::uint64_t head = kNode | 0x01U << 8U | 0x01U << 16U |
                               std::uint64_t{address.sub} << 24U |
                               std::uint64_t{address.index} << 32U | std::uint64_t{size} << 56U;
    store_le(std::span(frame.data).first(8), head);
    store_le(std::span(frame.data).subspan(8, size), value);
    give(frame);
    const auto answers = take(can::kSdoResponseBase + kNode);
    ASSERT_EQ(answers.size(), 1U);
    ASSERT_EQ(answers[0].data[1], std::byte{0x21});
  }

  // Writes like an expedited SDO download, or USDO download if the device is one of CANopen FD.
  void write(od::Address address, std::uint64_t value) {
    const auto variable = device->dictionary().find(address);
    ASSERT_TRUE(variable.has_value());
    if (device->options().profile == "fd-io") {
      write_fd(address, value, variable->size);
      return;
    }
    can::Frame frame = can::make_frame(can::kSdoRequestBase + kNode, {0, 0, 0, 0, 0, 0, 0, 0});
    frame.data[0] = static_cast<std::byte>(0x23U | ((4U - variable->size) << 2U));
    frame.data[1] = static_cast<std::byte>(address.index);
    frame.data[2] = static_cast<std::byte>(address.index >> 8U);
    frame.data[3] = static_cast<std::byte>(address.sub);
    store_le(std::span(frame.data).subspan(4, variable->size), value);
    give(frame);
    const auto answers = take(can::kSdoResponseBase + kNode);
    ASSERT_EQ(answers.size(), 1U);
    ASSERT_EQ(answers[0].data[0], std::byte{0x60});
  }

  std::uint64_t value(od::Address address) {
    const auto read = device->dictionary().read(address);
    return read.ok() ? load_le(read.value()) : ~std::uint64_t{0};
  }
  std::int32_t value32(od::Address address) { return static_cast<std::int32_t>(value(address)); }

  // Removes and returns the frames with that identifier that were sent so far.
  std::vector<can::Frame> take(std::uint32_t id) {
    std::vector<can::Frame> found;
    std::erase_if(sent, [&](const can::Frame& frame) {
      if (frame.id == id) {
        found.push_back(frame);
      }
      return frame.id == id;
    });
    return found;
  }

  std::unique_ptr<Device> device;
  Instant now{std::chrono::seconds(1)};
  std::vector<can::Frame> sent;

 private:
  void drain() {
    can::Frame frame;
    while (device->next_frame(frame, now)) {
      frame.time = now;
      sent.push_back(frame);
    }
  }
};

}  // namespace linegate::sim
