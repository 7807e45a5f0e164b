// SPDX-License-Identifier: Apache-2.0
// The devices of two lines, "press" and "hall", on buses of the interface udp:, in a thread of
// their own. They make the gateway forward values and route SDO without end, and note what arrives.
//
// Node 5 of press gets a new value as soon as the one before has arrived at node 6 of hall: so a
// value that does not arrive is never replaced by a later one. A client on press reads an object of
// node 6 in the same way.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <poll.h>

#include "bridges/can/udp.h"
#include "bridges/sim/device_group.h"
#include "gateway/runtime/clock.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"

namespace linegate::gateway {

class BusStation {
 public:
  static constexpr Duration kSync = std::chrono::milliseconds(500);
  static constexpr std::uint8_t kSource = 5;  // on press
  static constexpr std::uint8_t kTarget = 6;  // on hall
  static constexpr std::uint8_t kValve = 7;   // on hall: its output 6200h:1 has values of a client

  // The lines and the forwarding, to be appended to the lines of a plant.
  static std::string lines(std::uint16_t port) {
    const std::string at = ':' + std::to_string(port) + "\"";
    const std::string device = "eds: bridges/sim/eds/digital-io.eds, heartbeat: 1s}";
    return "  - name: press\n    interface: \"udp:" + std::string(kPress) + at +
           "\n    network_id: 11\n    access: all\n    sync: 500ms\n"
           "    nodes: [{id: 5, name: inlet, " +
           device + "]\n  - name: hall\n    interface: \"udp:" + kHall + at +
           "\n    network_id: 12\n    access: all\n    enter: press\n"
           "    nodes: [{id: 6, name: lamp, " +
           device + ", {id: 7, name: valve, " + device + R"(]
    outputs:
      defaults: {"lamp.6200:2": 0, "valve.6200:2": 0}
      groups: [{name: valves, number: 3, entries: [valve.*]}]
forward:
  - press.inlet.6000:2 -> hall.lamp.6200:1
)";
  }

  explicit BusStation(std::uint16_t port)
      : press_(kPress, port, {kSource}), hall_(kHall, port, {kTarget, kValve}) {
    thread_ = std::thread([this] { run(); });
  }
  ~BusStation() { stop(); }
  BusStation(const BusStation&) = delete;
  BusStation& operator=(const BusStation&) = delete;

  // From one request to its answer.
  struct Course {
    Instant begin{};
    Instant end{};
  };
  struct Change {
    Instant time{};
    std::uint8_t value = 0;
  };
  struct Seen {
    std::vector<Course> values;  // that were forwarded
    std::vector<Course> reads;   // that were routed
    int unexpected_values = 0;   // another value than the one that is due
    int unexpected_answers = 0;
    std::vector<Instant> syncs;  // on press
    std::vector<Change> valve;   // the output of the client
    bool operational = false;    // all devices
  };
  Seen seen() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }
  std::uint8_t valve() const {
    const std::lock_guard lock(mutex_);
    return seen_.valve.empty() ? std::uint8_t{0} : seen_.valve.back().value;
  }
  void stop() {
    ending_ = true;
    if (thread_.joinable())
      thread_.join();
  }

 private:
  static constexpr const char* kPress = "239.74.163.13";
  static constexpr const char* kHall = "239.74.163.14";
  static constexpr std::uint8_t kGateway = 127;
  static constexpr std::uint16_t kHallNetwork = 12;
  static constexpr std::uint32_t kDeviceType = 0x0003'0191;          // of digital-io.eds
  static constexpr Duration kPause = std::chrono::milliseconds(10);  // as the inhibit time

  struct Bus {
    Bus(const char* group, std::uint16_t port, std::initializer_list<std::uint8_t> nodes)
        : channel(can_bridge::open_udp({.group = group, .port = port})) {
      for (const std::uint8_t node : nodes) {
        devices.add(*std::move(
            sim::Device::make({.profile = "digital-io", .node_id = node, .seed = node}).value));
      }
    }
    bool is_operational() const {
      return std::ranges::all_of(devices.devices(), [](const auto& device) {
        return device->node().state() == nmt::State::operational;
      });
    }
    const std::unique_ptr<can_bridge::Channel> channel;
    sim::DeviceGroup devices;
    bool started = false;
  };

  void run() {
    while (!ending_) {
      service(press_, [this](const can::Frame& frame) { look_at_press(frame); });
      service(hall_, [this](const can::Frame& frame) { look_at_hall(frame); });
      const bool operational = press_.is_operational() && hall_.is_operational();
      {
        const std::lock_guard lock(mutex_);
        seen_.operational = operational;
      }
      if (operational) {
        send_value();
        send_read();
      }
      std::array<pollfd, 2> sockets{
          {{press_.channel->descriptor(), POLLIN, 0}, {hall_.channel->descriptor(), POLLIN, 0}}};
      poll(sockets.data(), sockets.size(), 2);
    }
  }

  template <class Look>
  void service(Bus& bus, Look&& look) {
    std::array<can::Frame, 16> frames;
    can_bridge::BusEvents events;
    Instant now = monotonic_now();
    const std::size_t count = bus.channel->read(frames, events, now);
    if (!bus.started && bus.channel->room(now) > 0) {
      bus.started = true;
      bus.devices.start(now);
    }
    const std::span<const can::Frame> received = std::span(frames).first(count);
    bus.devices.receive(received);
    std::ranges::for_each(received, look);
    now = received.empty() ? now : std::max(now, received.back().time);
    bus.devices.advance(now);
    can::Frame frame;
    while (bus.channel->room(now) > 0 && bus.devices.next_frame(frame, now)) {
      bus.channel->write({&frame, 1}, now);
    }
  }

  // --- values
  // --------------------------------------------------------------------------------------

  // The device shows what it receives with its RPDO, which nobody else sends.
  void send_value() {
    const Instant now = monotonic_now();
    if (value_due_ != value_ || now - value_begin_ < kPause) {
      return;
    }
    value_begin_ = now;
    ++value_due_;
    can::Frame frame = can::make_frame(0x200U + kSource, {value_due_, 0});
    frame.time = now;
    press_.devices.receive({&frame, 1});
  }
  void look_at_value(const can::Frame& frame) {
    const auto value = std::to_integer<std::uint8_t>(frame.data[0]);
    if (value == value_) {
      return;  // the gateway received another input of the PDO
    }
    const std::lock_guard lock(mutex_);
    if (value != value_due_) {
      ++seen_.unexpected_values;
      return;
    }
    value_ = value;
    seen_.values.push_back({value_begin_, monotonic_now()});
  }
  void look_at_hall(const can::Frame& frame) {
    if (frame.id == 0x200U + kTarget) {
      look_at_value(frame);
    } else if (frame.id == 0x200U + kValve) {
      const auto value = std::to_integer<std::uint8_t>(frame.data[0]);
      const std::lock_guard lock(mutex_);
      if (seen_.valve.empty() || seen_.valve.back().value != value) {
        seen_.valve.push_back({frame.time, value});
      }
    }
  }

  // --- routed SDO
  // ----------------------------------------------------------------------------------

  void ask(std::initializer_list<std::uint8_t> data) {
    const can::Frame frame = can::make_frame(can::kSdoRequestBase + kGateway, data);
    press_.channel->write({&frame, 1}, monotonic_now());
  }
  // The network indication (stack/routing/README.md); the request follows its answer.
  void send_read() {
    const Instant now = monotonic_now();
    if (reading_ || now - read_begin_ < kPause) {
      return;
    }
    read_begin_ = now;
    reading_ = true;
    ask({0xE0, kHallNetwork, 0, kTarget, 1, 0, 0, 0});
  }
  void look_at_press(const can::Frame& frame) {
    if (frame.id == can::kSyncId) {
      const std::lock_guard lock(mutex_);
      seen_.syncs.push_back(frame.time);
    } else if (frame.id == can::kSdoResponseBase + kGateway && reading_) {
      look_at_answer(frame);
    }
  }
  void look_at_answer(const can::Frame& frame) {
    if (frame.data[0] == std::byte{0xE0}) {
      ask({0x40, 0x00, 0x10, 0, 0, 0, 0, 0});
      return;
    }
    const bool is_right = frame.data[0] == std::byte{0x43} &&
                          load_le(std::span(frame.data).subspan(4, 4)) == kDeviceType;
    const std::lock_guard lock(mutex_);
    reading_ = false;
    if (is_right) {
      seen_.reads.push_back({read_begin_, monotonic_now()});
    } else {
      ++seen_.unexpected_answers;
    }
  }

  Bus press_;
  Bus hall_;
  std::uint8_t value_ = 0;  // that arrived
  std::uint8_t value_due_ = 0;
  Instant value_begin_{};
  bool reading_ = false;
  Instant read_begin_{};

  mutable std::mutex mutex_;
  Seen seen_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace linegate::gateway
