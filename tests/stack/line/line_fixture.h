// SPDX-License-Identifier: Apache-2.0
// The line of a manager with one device, which the test simulates.
#pragma once

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/eds/reader.h"
#include "stack/line/line.h"
#include "stack/od/objects.h"

#include "tests/stack/line/device_file.h"

namespace linegate::line {

using image::Direction;
using std::chrono::milliseconds;
using std::chrono::seconds;

inline LineConfig config_with_axis() {
  LineConfig config;
  config.name = "press";
  config.bit_rate = 500'000;
  NodeConfig node;
  node.id = 5;
  node.name = "axis";
  node.device = *eds::load(kDeviceFile, "axis.eds", 5).value;
  node.heartbeat = milliseconds(100);
  config.nodes.push_back(node);
  return config;
}

// Without error control, with defaults for both outputs and PDOs that cannot be changed.
inline LineConfig config_without_error_control() {
  LineConfig config = config_with_axis();
  for (od::ObjectDescription& object : config.nodes[0].device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      variable.access =
          od::objects::is_pdo_record(object.index) ? od::Access::constant : variable.access;
    }
  }
  config.nodes[0].heartbeat = {};
  config.defaults = {{.entry = 0, .value = 9}, {.entry = 1, .value = 3}};
  return config;
}

// A line in the role device; the test adds its devices.
inline LineConfig config_of_devices() {
  LineConfig config;
  config.name = "below";
  config.role = Role::device;
  config.node_id = 0;
  return config;
}

inline std::string text(const can::Frame& frame) {
  char digits[8];
  std::snprintf(digits, sizeof digits, "%03X#", frame.id);
  std::string out = digits;
  for (const std::byte b : frame.bytes()) {
    std::snprintf(digits, sizeof digits, "%02X", std::to_integer<unsigned>(b));
    out += digits;
  }
  return out;
}

class LineTest : public testing::Test {
 protected:
  void make(LineConfig config) {
    auto made = Line::make(std::move(config));
    ASSERT_TRUE(made.ok()) << to_string(made.diagnostics.at(0));
    line_ = *std::move(made.value);
  }

  // The frames are returned by the next sent().
  void hand_out_all() {
    can::Frame frame;
    while (line_->next_frame(frame, now_)) {
      handed_out_.push_back(text(frame));
    }
  }
  std::vector<std::string> sent() {
    hand_out_all();
    return std::exchange(handed_out_, {});
  }

  // Receives a frame from the bus. An SDO response arrives after its request was handed out.
  void hear(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    if (id > can::kSdoResponseBase && id <= can::kSdoResponseBase + can::kMaxNodeId) {
      hand_out_all();
    }
    can::Frame frame = can::make_frame(id, data);
    frame.time = now_;
    line_->receive(std::span(&frame, 1), now_);
  }

  void pass(Duration time) {
    const Instant until = now_ + time;
    while (line_->next_wake() <= until) {
      now_ = std::max(now_, line_->next_wake());
      line_->advance(now_);
    }
    now_ = until;
    line_->advance(now_);
  }

  std::vector<Event> events() {
    std::array<Event, 64> out;
    const std::size_t count = line_->pop_events(out);
    return {out.begin(), out.begin() + static_cast<long>(count)};
  }

  bool emitted(EventKind kind, std::uint8_t node = 0) {
    const std::vector<Event> all = events();
    return std::ranges::any_of(all,
                               [&](const Event& e) { return e.kind() == kind && e.node == node; });
  }

  // Node 5 boots and answers all identity requests except the one for its serial number, which it
  // does not have.
  void hear_identity() {
    hear(0x705, {0x00});
    hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
    hear(0x585, {0x43, 0x18, 0x10, 0x01, 0x23, 0x01, 0x00, 0x00});
    hear(0x585, {0x43, 0x18, 0x10, 0x02, 0x42, 0x00, 0x00, 0x00});
  }
  void hear_no_serial_number() { hear(0x585, {0x80, 0x18, 0x10, 0x04, 0x11, 0x00, 0x09, 0x06}); }
  // It refuses the uploads of its PDO records, and of those of SRDOs (1300h to 13FFh), which are
  // left out of sent(). first: '4' = of PDO records alone.
  void hear_no_pdo_records(char first = '3') {
    while (refuse_upload(first)) {
    }
  }

  // Executes the boot process of node 5 to its end.
  void boot() {
    line_->start(now_);
    hear_identity();
    hear_no_serial_number();
    hear_no_pdo_records();
    hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
    hear(0x705, {0x7F});
    sent();
    events();
    hear(0x705, {0x05});
  }

  Reply answer() {
    Reply reply;
    EXPECT_TRUE(line_->pop_reply(reply));
    return reply;
  }

  image::Snapshot snapshot(Direction direction) {
    image::Snapshot out;
    line_->snapshot(direction, out, now_, false);
    return out;
  }

  Instant now_{seconds(100)};
  std::unique_ptr<Line> line_;

 private:
  // 605h, 40h, and an index from 1300h or 1400h to 1BFFh.
  static bool is_upload_of_pdo_record(const std::string& frame, char first) {
    return frame.starts_with("605#40") && frame[8] == '1' && frame[9] >= first && frame[9] <= 'B';
  }

  // Answers one with 0602 0000h. Returns false if there is none.
  bool refuse_upload(char first) {
    hand_out_all();
    const auto found = std::ranges::find_if(handed_out_, [first](const std::string& frame) {
      return is_upload_of_pdo_record(frame, first);
    });
    if (found == handed_out_.end()) {
      return false;
    }
    const auto byte = [&found](std::size_t at) {
      return static_cast<std::uint8_t>(std::stoul(found->substr(4 + 2 * at, 2), nullptr, 16));
    };
    can::Frame frame = can::make_frame(
        0x585, {std::uint8_t{0x80}, byte(1), byte(2), byte(3), 0x00, 0x00, 0x02, 0x06});
    frame.time = now_;
    handed_out_.erase(found);
    line_->receive(std::span(&frame, 1), now_);
    return true;
  }

  std::vector<std::string> handed_out_;  // and not yet returned by sent()
};

}  // namespace linegate::line
