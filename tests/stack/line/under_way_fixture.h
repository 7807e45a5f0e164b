// SPDX-License-Identifier: Apache-2.0
// A line whose owner reports the fate of its frames.
#pragma once

#include "stack/base/byte_order.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {

// RPDO 1 of the device is synchronous, and no node sends SYNC.
inline LineConfig config_with_synchronous_axis() {
  LineConfig config = config_with_axis();
  for (od::ObjectDescription& object : config.nodes[0].device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (object.index == 0x1400 && variable.sub == 2) {
        variable.value = {std::byte{0}};
      }
    }
  }
  return config;
}

class AcknowledgedLine : public LineTest {
 protected:
  // Hands out frames that the controller accepts, but the bus does not acknowledge yet.
  std::vector<std::string> hand_out() {
    std::vector<std::string> out = sent();
    given_ += out.size();
    return out;
  }
  void acknowledge_all() { line_->acknowledged(given_, now_); }
  bool is_answered() {
    Reply reply;
    return line_->pop_reply(reply);
  }

  std::uint64_t given_ = 0;
};

class AcknowledgedOutputs : public AcknowledgedLine {
 protected:
  // Takes the device to Operational, with all frames acknowledged.
  void run(LineConfig config = config_with_axis()) {
    make(std::move(config));
    line_->expect_acknowledgements();
    boot();
    pass(milliseconds(1));
    hand_out();
    acknowledge_all();
    live(milliseconds(250));  // heartbeats after the acknowledgement of the NMT commands
    hand_out();
    acknowledge_all();
    events();
  }
  void boot() {
    const auto frames = [this] { return line_->state().counters.frames_sent; };
    LineTest::boot();
    given_ = frames();
  }
  // Boots the device without error control until its NMT start is due.
  void boot_unwatched() {
    make(config_without_error_control());
    line_->expect_acknowledgements();
    line_->start(now_);
    hear_identity();
    hand_out();
    hear_no_serial_number();
    line_->advance(now_);
  }
  // Takes the device to Operational without error control, with valid outputs.
  void run_unwatched() {
    boot_unwatched();
    for (int i = 0; i < 2; ++i) {  // the NMT start, then its outputs
      hand_out();
      acknowledge_all();
    }
    ASSERT_TRUE(valid());
  }
  void write(std::uint32_t setpoint) {
    OutputWrite out;
    out.layout_id = line_->layout(Direction::outputs).id;
    out.arming = 1;
    out.values = {{.entry = 0, .length = 4, .data = {}}, {.entry = 1, .length = 1, .data = {}}};
    store_le(out.values[0].data.data(), setpoint);
    out.values[1].data[0] = std::byte{2};
    EXPECT_EQ(line_->write_outputs(out, now_), OutputRefusal::none);
  }
  void write_by_hand(std::uint8_t mode, Duration timeout = {}) {
    line_->execute(
        {.timeout = timeout, .request = SingleOutput{.entry = 1, .data = {std::byte{mode}}}}, now_);
  }
  void start_node() {
    line_->execute({.request = NmtRequest{.node = 5, .command = nmt::Command::start}}, now_);
  }
  PdoWait wait_of(const Reply& reply) {
    const auto* const way = std::get_if<WrittenByPdo>(&reply.data);
    return way != nullptr ? way->wait : PdoWait::values;
  }
  OutputWait reason() {
    OutputState state;
    line_->output_state(0, state);
    return state.waits.empty() ? OutputWait::value : state.waits.front().reason;
  }
  bool valid() { return snapshot(Direction::outputs).is_valid(0); }
  // The device sends heartbeats for this time.
  void live(Duration time) {
    for (const Instant end = now_ + time; now_ < end;) {
      pass(std::min<Duration>(milliseconds(50), end - now_));
      hear(0x705, {0x05});
    }
  }
};

using AcknowledgedCommands = AcknowledgedOutputs;

}  // namespace linegate::line
