// SPDX-License-Identifier: Apache-2.0
// Two lines of one process that route between each other, and functions for their buses.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "stack/line/line.h"

namespace linegate::routing::test {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Line 1: network 1, own node 127. Line 2: network 2, own node 126; every node of network 1 has
// access to it.
class RoutedLines : public testing::Test {
 protected:
  RoutedLines() {
    const std::vector<Interface> interfaces = {{.number = 1, .network = 1, .node = 127},
                                               {.number = 2, .network = 2, .node = 126}};
    for (const Interface& interface : interfaces) {
      line::LineConfig& config = configs_.at(interface.number - 1U);
      config.name = "line " + std::to_string(interface.number);
      config.network_id = interface.network;
      config.node_id = interface.node;
      config.reset_nodes = false;
      config.routing.interface = interface.number;
      config.routing.interfaces = interfaces;
      config.routing.access = {{.first = 1, .last = 2, .sdo_read = true, .sdo_write = true}};
    }
    of_line(1).routes = {{.first = 2, .last = 2, .interface = 2}};
    of_line(2).routes = {{.first = 1, .last = 1, .interface = 1}};
  }

  line::LineConfig& config_of(unsigned number) { return configs_.at(number - 1); }
  Config& of_line(unsigned number) { return config_of(number).routing; }
  // Networks 3 and 4 are behind node 9 of network 2; line 1 has the routes.
  void with_next_gateway() {
    of_line(1).routes.push_back({.first = 3, .last = 4, .interface = 2, .gateway = 9, .cost = 10});
  }

  void start() {
    for (unsigned number : {1U, 2U}) {
      auto made = line::Line::make(configs_.at(number - 1));
      ASSERT_TRUE(made.ok()) << to_string(made.diagnostics.at(0));
      lines_.at(number - 1) = *std::move(made.value);
      line(number).start(now_);
    }
    pass(milliseconds(10));
    (void)sent(1);
    (void)sent(2);
  }

  line::Line& line(unsigned number) { return *lines_.at(number - 1); }
  Counters counters(unsigned number) { return line(number).state().routing; }

  // Receives a frame from the bus of that line.
  void hear(unsigned number, std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    can::Frame frame = can::make_frame(id, data);
    frame.time = now_;
    line(number).receive(std::span(&frame, 1), now_);
    carry();
  }
  // A CAN FD frame with the bit rate switched, padded to the next length.
  void hear_fd(unsigned number, std::uint32_t id, std::span<const std::uint8_t> data) {
    can::Frame frame;
    frame.id = id;
    frame.flags = can::Frame::kFd | can::Frame::kBitRateSwitch;
    frame.length = can::fd_length(data.size());
    std::ranges::transform(data, frame.data.begin(), [](std::uint8_t b) { return std::byte{b}; });
    frame.time = now_;
    line(number).receive(std::span(&frame, 1), now_);
    carry();
  }
  // The frames that the line sends, as "5FF E002000501000000", without EMCYs, heartbeats and NMT.
  std::vector<std::string> sent(unsigned number) {
    std::vector<std::string> out;
    can::Frame frame;
    while (line(number).next_frame(frame, now_)) {
      if ((frame.id & 0x780U) != 0x580 && (frame.id & 0x780U) != 0x600 && frame.id != 0x123) {
        continue;
      }
      char digits[8];
      std::snprintf(digits, sizeof digits, "%03X ", frame.id);
      std::string text = digits;
      for (const std::byte b : frame.bytes()) {
        std::snprintf(digits, sizeof digits, "%02X", std::to_integer<unsigned>(b));
        text += digits;
      }
      out.push_back(text);
    }
    return out;
  }
  void pass(Duration time) {
    const Instant until = now_ + time;
    for (Instant wake = next_wake(); wake <= until; wake = next_wake()) {
      now_ = std::max(now_, wake);
      advance();
    }
    now_ = until;
    advance();
  }
  bool refused_with(unsigned number, AbortCode code) {
    bool found = false;
    std::array<Event, 64> events;
    while (const std::size_t count = line(number).pop_events(events)) {
      for (const Event& event : std::span(events).first(count)) {
        const auto* const refused = event.get<event::RoutingRefused>();
        found = found || (refused != nullptr && refused->abort == code);
      }
    }
    return found;
  }
  std::vector<Event> events(unsigned number, EventKind first, EventKind second) {
    std::vector<Event> out;
    std::array<Event, 64> events;
    while (const std::size_t count = line(number).pop_events(events)) {
      for (const Event& event : std::span(events).first(count)) {
        if (event.kind() == first || event.kind() == second) {
          out.push_back(event);
        }
      }
    }
    return out;
  }
  void expect_nothing_left() {
    for (unsigned number : {1U, 2U}) {
      const Counters now = counters(number);
      EXPECT_EQ(now.open, 0U) << "line " << number;
      EXPECT_EQ(now.channels, 0U) << "line " << number;
      EXPECT_EQ(now.opened, now.finished + now.aborted + now.timed_out) << "line " << number;
    }
  }
  void carry() {
    Message message;
    for (bool any = true; any;) {
      any = false;
      for (unsigned number : {1U, 2U}) {
        while (line(number).pop_message(message)) {
          any = true;
          ASSERT_EQ(message.from, number);
          if (message.to == 1 || message.to == 2) {
            line(message.to).deliver(message, now_);
          } else if (const auto back = undeliverable(message)) {
            line(number).deliver(*back, now_);
          }
        }
      }
    }
  }

  using Frames = std::vector<std::string>;
  Instant now_{seconds(100)};

 private:
  Instant next_wake() { return earlier(line(1).next_wake(), line(2).next_wake()); }
  void advance() {
    line(1).advance(now_);
    line(2).advance(now_);
    carry();
  }

  std::array<line::LineConfig, 2> configs_;
  std::array<std::unique_ptr<line::Line>, 2> lines_;
};

class SdoRouting : public RoutedLines {
 protected:
  // A client on line 1 opens a connection to node 5 of network 2.
  void open() {
    hear(1, 0x67F, {0xE0, 2, 0, 5, 1, 0, 0, 0});
    ASSERT_EQ(sent(1), Frames{"5FF E002000501000000"});
    ASSERT_EQ(sent(2), Frames{});
  }
  void open_again() {
    hear(1, 0x67F, {0xE0, 2, 0, 5, 1, 0, 0, 0});
    pass(milliseconds(1));
    ASSERT_EQ(sent(1), Frames{"5FF E002000501000000"});
    (void)sent(2);
  }
  void client(std::initializer_list<std::uint8_t> data) { hear(1, 0x67F, data); }
  void server(std::initializer_list<std::uint8_t> data) { hear(2, 0x585, data); }
};

}  // namespace linegate::routing::test
