// SPDX-License-Identifier: Apache-2.0
// The effects of the CANopenIA records in the own dictionary on the line (CANopenIA manual 5.1
// and 6.2), accessed by a tool on the bus and by command.
#include <array>

#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/diagnosis/control_record.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class LineRecords : public LineTest {
 protected:
  static constexpr std::uint16_t kStatus = 0x5F40;
  static constexpr std::uint16_t kControl = 0x5F41;
  static constexpr std::uint16_t kFrames = 0x5F4C;

  void run(LineConfig config) {
    make(std::move(config));
    boot();
    settle();
    sent();
    events();
  }
  // The line executes an order after the access that caused it.
  void settle() { pass(milliseconds(1)); }

  Reply ask(Command command) {
    line_->execute(std::move(command), now_);
    return answer();
  }
  static std::vector<std::byte> number(std::uint64_t value, std::size_t size) {
    std::vector<std::byte> out(size);
    store_le(std::span(out), value);
    return out;
  }
  // Writes by command.
  Error set(std::uint8_t sub, std::uint64_t value, std::size_t size,
            std::uint16_t index = kControl) {
    const Error error =
        ask({.request = LocalWrite{.address = {index, sub}, .data = number(value, size)}}).error;
    settle();
    return error;
  }
  Error set_control(std::uint32_t bits) { return set(4, diagnosis::kFixedControl | bits, 4); }
  std::uint64_t get(std::uint16_t index, std::uint8_t sub) {
    const Reply reply = ask({.request = LocalRead{.what = od::Address{index, sub}}});
    EXPECT_TRUE(reply.ok());
    return load_le(reply.bytes());
  }

  Reply write(std::uint16_t index, std::uint64_t value, std::size_t size) {
    return ask(
        {.request = ObjectWrite{.node = 5, .address = {index, 0}, .data = number(value, size)}});
  }
  // Writes both values of RPDO 1 of node 5.
  void write_both(unsigned value) {
    write(0x2002, value, 4);
    write(0x2003, value, 1);
  }
  std::vector<std::string> pdos() {
    std::vector<std::string> out = sent();
    std::erase_if(out, [](const std::string& frame) { return !frame.starts_with("205#"); });
    return out;
  }
  std::uint64_t tpdo(std::uint8_t sub) { return *line_->dictionary().number({0x1800, sub}); }
};

TEST_F(LineRecords, AToolOnTheBusEnforcesSdo) {
  run(config_with_axis());
  hear(0x67F, {0x23, 0x41, 0x5F, 0x04, 0x2E, 0x00, 0x7F, 0x7F});
  EXPECT_THAT(sent(), ElementsAre("5FF#60415F0400000000"));
  hear(0x67F, {0x40, 0x41, 0x5F, 0x04, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("5FF#43415F042E007F7F"));
  const Command mode{.request =
                         ObjectWrite{.node = 5, .address = {0x2003, 0}, .data = number(7, 1)}};
  line_->execute(mode, now_);
  EXPECT_THAT(sent(), ElementsAre("605#2F03200007000000")) << "although a PDO carries it";
  hear(0x585, {0x60, 0x03, 0x20, 0, 0, 0, 0, 0});
  EXPECT_EQ(answer().data, ReplyData{WrittenBySdo{}});
  EXPECT_EQ(set_control(0), Error{});
  EXPECT_TRUE(std::holds_alternative<WrittenByPdo>(ask(mode).data));
}

TEST_F(LineRecords, PdosAreTriggeredByHandOnly) {
  run(config_with_axis());
  EXPECT_EQ(set_control(diagnosis::kManualTrigger), Error{});
  EXPECT_EQ(set(0x0C, 0x0501, 2), to_error(AbortCode::device_state)) << "a value is missing";
  write(0x2002, 1, 4);
  EXPECT_EQ(write(0x2003, 1, 1).data, (ReplyData{WrittenByPdo{1, PdoWait::trigger}}));
  OutputState state;
  line_->output_state(0, state);
  ASSERT_EQ(state.waits.size(), 2U);
  EXPECT_EQ(state.waits[0].reason, OutputWait::trigger);
  EXPECT_EQ(state.waits[1].reason, OutputWait::trigger);
  pass(seconds(1));
  EXPECT_THAT(pdos(), IsEmpty());
  hear(0x67F, {0x2B, 0x41, 0x5F, 0x0C, 0x01, 0x05, 0, 0});
  settle();
  EXPECT_THAT(sent(), ElementsAre("205#0100000001", "5FF#60415F0C00000000"));
  EXPECT_EQ(set(0x0C, 0x0501, 2), Error{});
  EXPECT_THAT(pdos(), ElementsAre("205#0100000001")) << "also by command";
  EXPECT_EQ(set(0x0C, 0x0502, 2), to_error(AbortCode::invalid_value)) << "no such PDO";
  EXPECT_EQ(set(0x0C, 0x0601, 2), to_error(AbortCode::invalid_value)) << "no such node";
  hear(0x67F, {0x2B, 0x41, 0x5F, 0x0C, 0x02, 0x05, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("5FF#80415F0C30000906"));
}

TEST_F(LineRecords, NothingIsTriggeredOutsideOfOperational) {
  run(config_with_axis());
  write_both(1);
  Command command{.request =
                      NmtRequest{.node = 127, .command = nmt::Command::enter_pre_operational}};
  ASSERT_TRUE(ask(command).ok());
  EXPECT_EQ(set(0x0C, 0x0501, 2), to_error(AbortCode::device_state));
}

TEST_F(LineRecords, TheUpdateTimeBeginsAsConfiguredAndIsWritten) {
  LineConfig config = config_with_axis();
  config.pdo_update_time = milliseconds(100);
  run(std::move(config));
  EXPECT_EQ(get(kControl, 7), 100U);
  write_both(1);
  EXPECT_EQ(set(7, 20, 1), Error{});
  pdos();
  write(0x2002, 2, 4);
  pass(milliseconds(19));
  EXPECT_THAT(pdos(), IsEmpty());
  pass(milliseconds(1));
  EXPECT_THAT(pdos(), ElementsAre("205#0200000001"));
  EXPECT_EQ(set(7, 0, 1), Error{});
  write(0x2002, 3, 4);
  EXPECT_THAT(pdos(), ElementsAre("205#0300000001")) << "at once";
}

TEST_F(LineRecords, TheEventTimeIsThatOfEveryEventDrivenPdo) {
  run(config_with_axis());
  write_both(1);
  hear(0x67F, {0x2B, 0x41, 0x5F, 0x08, 100, 0, 0, 0});
  settle();
  sent();
  EXPECT_EQ(tpdo(5), 100U);
  pass(milliseconds(100));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000001")) << "sent cyclically without a write";
  pass(milliseconds(100));
  EXPECT_THAT(pdos(), ElementsAre("205#0100000001"));
  write(0x2002, 2, 4);
  EXPECT_THAT(pdos(), ElementsAre("205#0200000001")) << "and after a write";
  EXPECT_EQ(set(8, 0, 2), Error{});
  pdos();
  pass(seconds(1));
  EXPECT_THAT(pdos(), IsEmpty());
}

TEST_F(LineRecords, TheInhibitTimeIsThatOfEveryEventDrivenPdo) {
  run(config_with_axis());
  write_both(1);
  EXPECT_EQ(set(9, 500, 2), Error{});
  EXPECT_EQ(tpdo(3), 500U) << "50 ms";
  pdos();
  pass(milliseconds(100));
  write(0x2002, 2, 4);
  EXPECT_THAT(pdos(), ElementsAre("205#0200000001"));
  write(0x2002, 3, 4);
  write(0x2002, 4, 4);
  pass(milliseconds(49));
  EXPECT_THAT(pdos(), IsEmpty());
  pass(milliseconds(1));
  EXPECT_THAT(pdos(), ElementsAre("205#0400000001"));
}

// Without a write the PDO is sent after the event time, with a write after the inhibit time.
TEST_F(LineRecords, EventAndInhibitTimeTogether) {
  run(config_with_axis());
  write_both(1);
  EXPECT_EQ(set(8, 100, 2), Error{});
  EXPECT_EQ(set(9, 500, 2), Error{});
  pass(milliseconds(100));
  sent();
  pass(milliseconds(100));
  EXPECT_EQ(pdos().size(), 1U);
  pass(milliseconds(10));
  write(0x2002, 2, 4);
  pass(milliseconds(30));
  EXPECT_THAT(pdos(), IsEmpty()) << "inhibited";
  pass(milliseconds(10));
  EXPECT_THAT(pdos(), ElementsAre("205#0200000001"));
}

TEST_F(LineRecords, SynchronousPdosHaveNoSuchTimes) {
  run(config_with_axis());
  ASSERT_TRUE(line_->dictionary().set({0x1800, 2}, std::uint8_t{1}));
  EXPECT_EQ(set(8, 100, 2), Error{});
  EXPECT_EQ(set(9, 500, 2), Error{});
  EXPECT_EQ(tpdo(5), 0U);
  EXPECT_EQ(tpdo(3), 0U);
}

TEST_F(LineRecords, TimesOutlastAResetOfTheOwnNode) {
  LineConfig config = config_with_axis();
  config.nodes[0].rpdo_inhibit[1] = milliseconds(20);
  run(std::move(config));
  EXPECT_EQ(set(8, 100, 2), Error{});
  EXPECT_EQ(tpdo(3), 200U) << "unwritten values remain configured";
  EXPECT_EQ(set(1, 129, 1), Error{});
  settle();
  EXPECT_EQ(tpdo(5), 100U);
  EXPECT_EQ(tpdo(3), 200U);
  EXPECT_EQ(get(kControl, 8), 100U);
}

TEST_F(LineRecords, ReadsAreAnsweredWithScannedEntries) {
  LineConfig config = config_with_axis();
  scan::ScannedNode axis{.id = 5, .values = {}};
  axis.values.push_back({{0x1018, 1}, number(0x123, 4)});
  config.scanned.push_back(axis);
  run(std::move(config));
  const Command vendor{.request = SdoRead{.node = 5, .address = {0x1018, 1}}};
  EXPECT_EQ(set_control(diagnosis::kUseScannedEntries), Error{});
  EXPECT_EQ(ask(vendor).bytes(), number(0x123, 4));
  EXPECT_THAT(sent(), IsEmpty()) << "no request to the node";
  EXPECT_EQ(set_control(0), Error{});
  line_->execute(vendor, now_);
  EXPECT_THAT(sent(), ElementsAre("605#4018100100000000"));
}

TEST_F(LineRecords, ANodeIsScannedAgainAndNobodyIsAnswered) {
  run(config_with_axis());
  hear(0x67F, {0x2F, 0x41, 0x5F, 0x0A, 0x05, 0, 0, 0});
  settle();
  const std::vector<std::string> frames = sent();
  EXPECT_THAT(frames, testing::Contains("605#4000100000000000")) << "1000h of node 5 is read";
  EXPECT_EQ(get(0x5F44, 5), 0x9FU);
  EXPECT_EQ(set(0x0A, 5, 1), to_error(AbortCode::device_state)) << "one scan at a time";
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
  pass(seconds(2));
  EXPECT_TRUE(emitted(EventKind::node_scanned, 5));
  EXPECT_EQ(get(0x5F44, 5), 0xA8U) << "the node does not respond";
  Reply reply;
  EXPECT_FALSE(line_->pop_reply(reply)) << "no command asked for it";
  line_->execute({.request = Scan{.node = 5}}, now_);
  pass(seconds(2));
  EXPECT_TRUE(line_->pop_reply(reply)) << "requested by a command";
}

TEST_F(LineRecords, ScansAreForTheManagerAndOfOthers) {
  run(config_with_axis());
  EXPECT_EQ(set(0x0A, 127, 1), to_error(AbortCode::invalid_value)) << "the own node";
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .time = now_});
  EXPECT_EQ(set(0x0A, 5, 1), to_error(AbortCode::device_state));
  LineConfig config = config_with_axis();
  config.role = Role::device;
  make(std::move(config));
  line_->start(now_);
  EXPECT_EQ(set(0x0A, 5, 1), to_error(AbortCode::local_control));
}

TEST_F(LineRecords, FramesAreSentAndHeardByObject) {
  run(config_with_axis());
  hear(0x67F, {0x2F, 0x41, 0x5F, 0x0B, 0x11, 0, 0, 0});
  hear(0x67F, {0x21, 0x4C, 0x5F, 0x04, 6, 0, 0, 0});
  hear(0x67F, {0x03, 0x50, 0x01, 0x11, 0x22, 0x33, 0x44, 0});
  EXPECT_THAT(sent(), ElementsAre("5FF#60415F0B00000000", "5FF#604C5F0400000000",
                                  "5FF#2000000000000000", "150#11223344"));
  hear(0x333, {1, 2});
  hear(0x67F, {0x40, 0x4C, 0x5F, 0x02, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("5FF#434C5F0233030102"));
  EXPECT_TRUE(emitted(EventKind::can_frame)) << "reported without a listener";
  EXPECT_EQ(set(0x0B, 0, 1), Error{});
  hear(0x333, {1, 2});
  EXPECT_FALSE(emitted(EventKind::can_frame));
}

TEST_F(LineRecords, IdentifiersOfServicesAreNotSentByObject) {
  run(config_with_axis());
  EXPECT_EQ(set(1, 0x11'0150, 3, kFrames), to_error(AbortCode::device_state)) << "not enabled";
  EXPECT_EQ(set(0x0B, 0x01, 1), Error{});
  EXPECT_EQ(set(1, 0x11'0205, 3, kFrames), to_error(AbortCode::local_control)) << "a PDO";
  EXPECT_EQ(set(1, 0x11'0150, 3, kFrames), Error{});
  EXPECT_THAT(sent(), ElementsAre("150#11"));
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .time = now_});
  EXPECT_EQ(set(1, 0x11'0150, 3, kFrames), to_error(AbortCode::device_state)) << "no bus";
}

TEST_F(LineRecords, TheHardwareStateHasTheTransmission) {
  constexpr unsigned kInitialised = 0x01;
  run(config_with_axis());
  EXPECT_EQ(get(kStatus, 3), kInitialised);
  EXPECT_EQ(set(0x0B, 0x01, 1), Error{});
  EXPECT_EQ(set(1, 0x11'0150, 3, kFrames), Error{});
  EXPECT_EQ(get(kStatus, 3), kInitialised | 0x40U) << "a frame waits";
  sent();
  EXPECT_EQ(get(kStatus, 3), kInitialised);
  line_->set_bit_rates(500'000, 2'000'000);
  EXPECT_EQ(get(kStatus, 3), kInitialised | 0x20U) << "CAN FD";
}

}  // namespace
}  // namespace linegate::line
