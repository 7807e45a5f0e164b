// SPDX-License-Identifier: Apache-2.0
// While a network sleeps no value is shown as valid, and none is sent.
#include <algorithm>
#include <string>
#include <vector>

#include "stack/base/byte_order.h"

#include "tests/stack/line/sleep_fixture.h"

namespace linegate::line {
namespace {

class SleepValues : public SleepTest {
 protected:
  // A TPDO of the node, and its heartbeat.
  void hear_values() {
    hear(0x185, {1, 2, 3, 4, 5, 6});
    hear(0x705, {5});
    line_->advance(now_);
  }
  bool inputs_valid() { return line_->input(0).valid || snapshot(Direction::inputs).is_valid(0); }
  bool outputs_valid() { return snapshot(Direction::outputs).is_valid(0); }
  void expect_no_values() {
    EXPECT_FALSE(inputs_valid()) << nmt::name(phase());
    EXPECT_FALSE(outputs_valid()) << nmt::name(phase());
  }
  std::vector<std::string> outputs_sent() {
    std::vector<std::string> all = sent();
    std::erase_if(all, [](const std::string& frame) { return !frame.starts_with("205#"); });
    return all;
  }
  void write(std::uint32_t setpoint) {
    OutputWrite out;
    out.layout_id = line_->layout(Direction::outputs).id;
    out.arming = 1;
    out.values = {{.entry = 0, .length = 4, .data = {}}};
    store_le(out.values[0].data.data(), setpoint);
    EXPECT_EQ(line_->write_outputs(out, now_), OutputRefusal::none);
  }
  // Until the line is asleep, while the node sends its values during prepare.
  void expect_no_values_until_asleep() {
    ASSERT_EQ(phase(), SleepPhase::prepare);
    expect_no_values();
    for (int i = 0; i < 9; ++i) {
      pass(milliseconds(100));
      hear_values();
      write(static_cast<std::uint32_t>(100 + i));
      EXPECT_THAT(outputs_sent(), testing::IsEmpty());
      expect_no_values();
    }
    pass(milliseconds(100));
    ASSERT_EQ(phase(), SleepPhase::silent);
    hear_values();
    expect_no_values();
    pass(seconds(1));
    ASSERT_EQ(phase(), SleepPhase::asleep);
    expect_no_values();
  }
  void boot_again() {
    hear_identity();
    hear_no_serial_number();
    hear_no_pdo_records();
    hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
    hear(0x705, {0x7F});
    line_->advance(now_);
    sent();
  }
};

TEST_F(SleepValues, OfAManagerAreValidAgainAfterItsBoot) {
  run(sleepy());
  pass(milliseconds(1));
  sent();
  ASSERT_TRUE(inputs_valid());
  ASSERT_TRUE(outputs_valid());
  ask(SleepAction::prepare);
  expect_no_values_until_asleep();
  hear(0x7F0, {1});
  expect_no_values();
  EXPECT_THAT(outputs_sent(), testing::IsEmpty());
  boot_again();
  expect_no_values();
  hear(0x705, {5});
  line_->advance(now_);
  EXPECT_EQ(outputs_sent(), std::vector<std::string>{"205#6C00000003"})
      << "the value written last, meanwhile";
  EXPECT_TRUE(outputs_valid());
  EXPECT_FALSE(inputs_valid());
  hear_values();
  EXPECT_TRUE(inputs_valid());
}

TEST_F(SleepValues, OfASlaveAreValidAgainWhenItsMasterStartsTheNodes) {
  LineConfig config = sleepy(Role::device);
  make(config);
  line_->start(now_);
  hear(0x000, {1, 0});
  for (int i = 0; i < 3; ++i) {
    hear_values();
    pass(milliseconds(100));
  }
  sent();
  ASSERT_TRUE(inputs_valid());
  ASSERT_TRUE(outputs_valid());
  hear(0x690, {2});
  expect_no_values_until_asleep();
  hear(0x690, {3});
  ASSERT_EQ(phase(), SleepPhase::awake);
  expect_no_values();
  pass(milliseconds(100));
  EXPECT_THAT(outputs_sent(), testing::IsEmpty());
  expect_no_values();
  hear(0x705, {0});
  hear(0x000, {1, 0});
  pass(milliseconds(1));
  expect_no_values();
  for (int i = 0; i < 3; ++i) {
    pass(milliseconds(100));
    hear_values();
  }
  EXPECT_FALSE(outputs_sent().empty());
  EXPECT_TRUE(inputs_valid());
  EXPECT_TRUE(outputs_valid());
}

// A master or another node may have sent PDOs before it received the message.
TEST_F(SleepValues, OfAnObserverAreInvalid) {
  observe(sleepy());
  hear(0x000, {1, 0});
  hear_values();
  hear(0x205, {9, 0, 0, 0, 3});
  ASSERT_TRUE(inputs_valid());
  ASSERT_TRUE(outputs_valid());
  std::vector<can::Frame> frames{can::make_frame(0x690, {2}),
                                 can::make_frame(0x185, {1, 2, 3, 4, 5, 6}),
                                 can::make_frame(0x205, {9, 0, 0, 0, 3})};
  for (can::Frame& frame : frames) {
    frame.time = now_;
  }
  line_->receive(frames, now_);
  ASSERT_EQ(phase(), SleepPhase::prepare);
  expect_no_values();
  for (int i = 0; i < 25; ++i) {
    pass(milliseconds(50));
    if (i < 18) {
      hear_values();
      hear(0x205, {9, 0, 0, 0, 3});
    }
    expect_no_values();
  }
  pass(seconds(1));
  ASSERT_EQ(phase(), SleepPhase::asleep);
  hear(0x690, {3});
  expect_no_values();
  hear(0x205, {9, 0, 0, 0, 3});
  EXPECT_FALSE(outputs_valid()) << "the node is not started";
  hear(0x705, {0});
  hear(0x000, {1, 5});
  hear_values();
  hear(0x205, {9, 0, 0, 0, 3});
  EXPECT_TRUE(inputs_valid());
  EXPECT_TRUE(outputs_valid());
}

// An ordinary PDO, which an observer passes to its image without a look at the services.
TEST_F(SleepValues, APdoWakesAnObserver) {
  observe(sleepy());
  hear(0x000, {1, 0});
  hear_values();
  hear(0x690, {2});
  pass(seconds(3));
  ASSERT_EQ(phase(), SleepPhase::asleep);
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(phase(), SleepPhase::awake);
}

TEST_F(SleepValues, APdoWakesAManager) {
  run(sleepy());
  fall_asleep();
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(phase(), SleepPhase::awake);
  EXPECT_EQ(sent().front(), "690#03");
}

// The nodes obey a second master: until they are silent they report Operational, but take no PDO.
TEST_F(SleepValues, OutputsAreInvalidWhileAnotherMasterLetsTheNodesSleep) {
  for (const bool wakes : {true, false}) {
    run(sleepy());
    pass(milliseconds(1));
    sent();
    ASSERT_TRUE(outputs_valid());
    hear(0x690, {2});
    EXPECT_EQ(phase(), SleepPhase::awake);
    EXPECT_FALSE(outputs_valid());
    const std::vector<Event> reported = of(EventKind::foreign_manager);
    ASSERT_EQ(reported.size(), 1U);
    EXPECT_EQ(
        std::get<event::ForeignManager>(reported[0].data),
        (event::ForeignManager{.evidence = event::ManagerEvidence::sleep, .identifier = 0x690}));
    hear(0x690, {2});
    EXPECT_FALSE(emitted(EventKind::foreign_manager)) << "once in ten seconds";
    pass(milliseconds(500));
    hear_values();
    write(77);
    EXPECT_EQ(outputs_sent().size(), 1U);
    EXPECT_FALSE(outputs_valid());
    if (wakes) {
      hear(0x690, {3});
    } else {
      pass(milliseconds(1499));
      EXPECT_FALSE(outputs_valid());
      pass(milliseconds(1));
    }
    hear_values();
    pass(milliseconds(100));
    hear_values();
    EXPECT_FALSE(outputs_sent().empty());
    EXPECT_TRUE(outputs_valid());
  }
}

// The wake-up is for all nodes, also for those that another master prepared.
TEST_F(SleepValues, OutputsAreValidAfterTheOwnWakeUp) {
  run(sleepy());
  hear(0x690, {2});
  ask(SleepAction::prepare);
  pass(milliseconds(100));
  ask(SleepAction::wake);
  boot_again();
  hear(0x705, {5});
  line_->advance(now_);
  EXPECT_FALSE(outputs_sent().empty());
  EXPECT_TRUE(outputs_valid());
}

// A frame on its way to the bus when prepare begins.
TEST_F(SleepValues, AnAcknowledgementDuringPrepareMakesNoOutputValid) {
  make(sleepy());
  line_->expect_acknowledgements();
  boot();
  const auto acknowledge = [this] {
    line_->acknowledged(line_->state().counters.frames_sent, now_);
  };
  for (int i = 0; i < 5; ++i) {
    sent();
    acknowledge();
    pass(milliseconds(100));
    hear_values();
  }
  sent();
  acknowledge();
  ASSERT_TRUE(outputs_valid());
  write(77);
  EXPECT_EQ(outputs_sent().size(), 1U);
  ASSERT_FALSE(outputs_valid());
  ask(SleepAction::prepare);
  acknowledge();
  EXPECT_FALSE(outputs_valid());
}

// For other lines, which send it on.
TEST_F(SleepValues, OfForwardedObjectsAreInvalid) {
  LineConfig config = sleepy(Role::device);
  const od::Address address{0xB100, 1};
  config.forwarding.objects = {{address, "first", {}}};
  config.forwarding.rpdos = {{.number = 101, .cob_id = {0x281}, .mapping = {{address, 16}}}};
  make(std::move(config));
  line_->start(now_);
  hear(0x000, {1, 0});
  const auto valid = [this] { return line_->input(Line::kForwarded).valid; };
  hear(0x281, {1, 0});
  ASSERT_TRUE(valid());
  hear(0x690, {2});
  EXPECT_FALSE(valid());
  pass(milliseconds(100));
  hear(0x281, {2, 0});
  EXPECT_FALSE(valid());
  pass(seconds(2));
  line_->stop(now_);
  line_->start(now_);
  ASSERT_EQ(phase(), SleepPhase::awake);
  EXPECT_FALSE(valid()) << "received before";
  hear(0x000, {1, 0});
  pass(milliseconds(100));
  hear(0x281, {3, 0});
  EXPECT_TRUE(valid());
}

TEST_F(SleepValues, OfOutputsThatMpdosCarryAreInvalid) {
  LineConfig config = sleepy();
  OwnObject object{.index = 0x2100, .variable = {}};
  object.variable.sub = 2;
  object.variable.type = od::DataType::unsigned32;
  object.variable.access = od::Access::ro;
  object.variable.mappable = true;
  object.variable.value.resize(4);
  object.in_image = true;
  config.own_objects = {object};
  config.forwarding.tpdos = {
      {.number = 101, .cob_id = {0x1F1 | can::CobId::kNoRtrBit}, .mpdo = pdo::MpdoMode::source}};
  config.mpdo_scanner = {0x01'2100'02};
  run(config);
  const auto entry =
      static_cast<std::uint32_t>(line_->layout(Direction::outputs).entries.size() - 1);
  const auto write_it = [&] {
    line_->execute(
        {.tag = 7, .request = SingleOutput{.entry = entry, .data = std::vector<std::byte>(4)}},
        now_);
    line_->advance(now_);
  };
  write_it();
  EXPECT_THAT(sent(), testing::Contains("1F1#7F00210200000000"));
  ASSERT_TRUE(snapshot(Direction::outputs).is_valid(entry));
  fall_asleep();
  EXPECT_FALSE(snapshot(Direction::outputs).is_valid(entry));
  hear(0x7F0, {1});
  EXPECT_FALSE(snapshot(Direction::outputs).is_valid(entry));
}

}  // namespace
}  // namespace linegate::line
