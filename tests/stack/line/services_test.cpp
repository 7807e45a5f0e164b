// SPDX-License-Identifier: Apache-2.0
// Services of a line besides the boot of its nodes: guarding, the own node-ID, TIME, repeated SDO
// transfers, SDO clients of the own dictionary.
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// An old device without a heartbeat.
TEST_F(LineTest, AGuardedNodeIsAskedAndMissed) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration::zero();
  config.nodes[0].guard_time = milliseconds(100);
  config.nodes[0].life_time_factor = 2;
  make(config);
  line_->start(now_);
  hear(0x705, {0x00});
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
  hear(0x585, {0x43, 0x18, 0x10, 0x01, 0x23, 0x01, 0x00, 0x00});
  hear(0x585, {0x43, 0x18, 0x10, 0x02, 0x42, 0x00, 0x00, 0x00});
  sent();
  hear_no_serial_number();
  hear_no_pdo_records();
  EXPECT_THAT(sent(), ElementsAre("605#2B0C100064000000"));
  hear(0x585, {0x60, 0x0C, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("605#2F0D100002000000"));
  hear(0x585, {0x60, 0x0D, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("705#00")) << "a guarding request";
  hear(0x705, {0x7F});
  EXPECT_THAT(sent(), ElementsAre("000#0105"));
  pass(milliseconds(100));
  sent();
  hear(0x705, {0x85});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  const Counters before = line_->state().counters;
  events();
  hear(0x705, {0xFF});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational) << "the toggle bit did not change";
  EXPECT_EQ(line_->state().counters.frames_unused, before.frames_unused + 1);
  EXPECT_EQ(line_->state().counters.frames_malformed, before.frames_malformed);
  EXPECT_TRUE(events().empty()) << "handled as if it was not received";
  pass(milliseconds(200));
  EXPECT_TRUE(emitted(EventKind::heartbeat_lost, 5));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
  EXPECT_THAT(sent(), testing::Contains("000#8105"));
}

// An idle line does not update the time of its node.
TEST_F(LineTest, WhatIsWrittenAfterALongRestIsToldWithTheTimeAtWhichItIsWritten) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration::zero();
  make(config);
  boot();
  for (const Duration time : {milliseconds(1), milliseconds(1), milliseconds(3000)}) {
    sent();
    events();
    pass(time);
  }
  ASSERT_TRUE(line_->dictionary().set({0x1800, 1}, std::uint32_t{0x101}));
  const std::vector<Event> all = events();
  const auto error = std::ranges::find(all, EventKind::configuration_error, &Event::kind);
  ASSERT_NE(error, all.end());
  EXPECT_EQ(error->time, now_);
}

// A configured value takes precedence over the device file, and a value of 0 in the file is
// ignored.
TEST_F(LineTest, EmcysComeOnTheIdentifierTheDeviceIsGiven) {
  const auto told_on = [this](std::uint32_t cob_id) {
    can::Frame frame = can::make_frame(can::CobId{cob_id}.id(), {0x00, 0x10, 0x01, 0, 0, 0, 0, 0});
    frame.flags = can::CobId{cob_id}.extended() ? can::Frame::kExtended : 0;
    frame.time = now_;
    events();
    line_->receive(std::span(&frame, 1), now_);
    return emitted(EventKind::emcy, 5);
  };
  const auto value = [](std::uint32_t raw) {
    std::vector<std::byte> out(4);
    store_le(std::span(out), std::uint64_t{raw});
    return out;
  };
  constexpr std::uint32_t kOfTheFile = 0x2123'4567;
  constexpr std::uint32_t kWritten = 0x2765'4321;
  od::ObjectDescription object{.index = 0x1014, .name = "COB-ID EMCY"};
  object.variables.push_back({.sub = 0,
                              .name = object.name,
                              .type = od::DataType::unsigned32,
                              .value = value(kOfTheFile)});
  LineConfig config = config_with_axis();
  std::erase_if(config.nodes[0].device.objects,
                [](const od::ObjectDescription& each) { return each.index == 0x1014; });
  std::vector<od::ObjectDescription>& objects = config.nodes[0].device.objects;
  const auto after = std::ranges::find_if(
      objects, [](const od::ObjectDescription& each) { return each.index > 0x1014; });
  const auto at = static_cast<std::size_t>(after - objects.begin());
  objects.insert(after, object);
  make(config);
  line_->start(now_);
  EXPECT_TRUE(told_on(kOfTheFile));
  EXPECT_FALSE(told_on(kOfTheFile & 0x7FFU)) << "not the 11-bit identifier";
  EXPECT_FALSE(told_on(0x085));
  config.nodes[0].objects.push_back({{0x1014, 0}, value(kWritten)});
  make(config);
  line_->start(now_);
  EXPECT_TRUE(told_on(kWritten));
  EXPECT_FALSE(told_on(kOfTheFile));
  config.nodes[0].objects.clear();
  objects[at].variables[0].value = value(0);
  make(config);
  line_->start(now_);
  EXPECT_TRUE(told_on(0x085));
}

TEST_F(LineTest, GuardingNeedsBothNumbersAndNoHeartbeat) {
  LineConfig config = config_with_axis();
  config.nodes[0].guard_time = milliseconds(100);
  const auto refused = Line::make(config);
  ASSERT_EQ(refused.diagnostics.size(), 2U);
  EXPECT_THAT(refused.diagnostics[0].text, HasSubstr("both time and factor"));
  EXPECT_THAT(refused.diagnostics[1].text, HasSubstr("either a heartbeat or guarding"));
}

TEST_F(LineTest, PdosOfAWrongLengthAreCountedAndToldUntilARightOneComes) {
  make(config_with_axis());
  boot();
  events();
  const auto before = line_->state().counters;
  hear(0x185, {1});
  EXPECT_TRUE(emitted(EventKind::pdo_length, 5));
  hear(0x185, {1});
  hear(0x185, {1, 0, 2, 0, 0, 0, 9});
  EXPECT_FALSE(emitted(EventKind::pdo_length, 5));
  EXPECT_EQ(line_->state().counters.frames_malformed, before.frames_malformed + 3);
  hear(0x185, {1, 0, 2, 0, 0, 0});
  EXPECT_EQ(line_->state().counters.frames_malformed, before.frames_malformed + 3);
  hear(0x185, {});
  EXPECT_TRUE(emitted(EventKind::pdo_length, 5));
}

TEST_F(LineTest, AFloodOfBusErrorsIsCountedAndToldOnceASecond) {
  make(config_with_axis());
  boot();
  events();
  for (int i = 0; i < 2500; ++i) {
    line_->bus_event({.kind = can::BusEvent::Kind::error, .errors = can::kProtocol, .time = now_});
    pass(milliseconds(1));
  }
  pass(seconds(5));
  std::vector<bool> counts;  // of each event, whether others were suppressed
  for (const Event& event : events()) {
    if (const auto* const error = event.get<event::BusError>()) {
      counts.push_back(error->suppressed != 0);
    }
  }
  EXPECT_THAT(counts, ElementsAre(false, true, true, true));
  EXPECT_EQ(line_->state().counters.bus_errors, 2500U);
}

// Bus errors are also errors of the own node; a manager continues after bus-off.
TEST_F(LineTest, BusStatesReachTheOwnNode) {
  make(config_with_axis());
  boot();
  const auto bus = [this](can::BusState state) {
    line_->bus_event({.state = state, .time = now_});
  };
  EXPECT_EQ(line_->indicators(), (node::Indicators{node::Pattern::on, node::Pattern::off}));
  bus(can::BusState::error_passive);
  EXPECT_THAT(sent(), testing::Contains("0FF#2081110000000000"));
  EXPECT_EQ(line_->indicators().error, node::Pattern::single_flash);
  EXPECT_EQ(line_->state().indicators, line_->indicators());
  bus(can::BusState::bus_off);
  EXPECT_EQ(line_->indicators().error, node::Pattern::on);
  EXPECT_EQ(line_->state().own_state, nmt::State::operational);
  bus(can::BusState::error_active);
  EXPECT_EQ(line_->indicators().error, node::Pattern::off);
  EXPECT_THAT(sent(), testing::Contains("0FF#0000000000000000"));
}

TEST_F(LineTest, ProducesTime) {
  LineConfig config = config_with_axis();
  config.time_period = seconds(1);
  make(config);
  line_->set_utc(seconds(441'763'200) - now_.time_since_epoch());
  line_->start(now_);
  sent();
  pass(milliseconds(999));
  EXPECT_THAT(sent(), testing::Not(testing::Contains(HasSubstr("100#"))));
  pass(milliseconds(1));
  EXPECT_THAT(sent(), testing::Contains("100#E80300000000"));
}

TEST_F(LineTest, ConsumesTime) {
  make(config_with_axis());
  boot();
  EXPECT_FALSE(line_->network_utc(now_));
  hear(0x100, {0xE8, 0x03, 0, 0, 1, 0});
  pass(seconds(2));
  EXPECT_EQ(line_->network_utc(now_), seconds(441'763'200 + 86'400 + 3));
  hear(0x100, {0xE8, 0x03, 0, 0, 1});
  EXPECT_EQ(line_->state().counters.frames_malformed, 1U);
}

// A device has the node-ID of the manager.
TEST_F(LineTest, TheOwnNodeIdOfAnotherIsTold) {
  make(config_with_axis());
  boot();
  hear(0x77F, {0x00});
  EXPECT_TRUE(emitted(EventKind::duplicate_node_id, 127));
  EXPECT_EQ(line_->state().own_state, nmt::State::operational);
}

// --- repeated SDO transfers of a command -----------------------------------------------

constexpr const char* kReadInitiate = "605#4000200000000000";
constexpr const char* kWriteInitiate = "605#2B002000CDAB0000";
constexpr const char* kTimeOutAbort = "605#8000200000000405";

class RepeatedSdo : public LineTest {
 protected:
  RepeatedSdo() {
    make(config_with_axis());
    boot();
    sent();
    events();
  }
  void ask(bool write, std::uint8_t repeats, Duration timeout = {}) {
    Request request = SdoRead{.node = 5, .address = {0x2000, 0}, .repeats = repeats};
    if (write) {
      request = SdoWrite{.node = 5,
                         .address = {0x2000, 0},
                         .data = {std::byte{0xCD}, std::byte{0xAB}},
                         .repeats = repeats};
    }
    line_->execute({.tag = 7, .timeout = timeout, .request = std::move(request)}, now_);
  }
  void answer_well(bool write) {
    if (write) {
      hear(0x585, {0x60, 0x00, 0x20, 0x00, 0, 0, 0, 0});
    } else {
      hear(0x585, {0x4B, 0x00, 0x20, 0x00, 0xCD, 0xAB, 0, 0});
    }
  }
  void expect_success(bool write) {
    const Reply reply = answer();
    EXPECT_EQ(reply.tag, 7U);
    EXPECT_TRUE(reply.ok());
    EXPECT_EQ(reply.bytes().size(), write ? 0U : 2U);
    expect_nothing();
  }
  void expect_nothing() {
    Reply none;
    EXPECT_FALSE(line_->pop_reply(none));
  }
  // Without the heartbeats of the own node and similar frames.
  std::vector<std::string> sent_to_server() {
    std::vector<std::string> all = sent();
    std::erase_if(all, [](const std::string& frame) { return !frame.starts_with("605#"); });
    return all;
  }
};

TEST_F(RepeatedSdo, ATimeOutBeginsTheTransferAnewIfTheCommandSaysSo) {
  for (const bool write : {false, true}) {
    SCOPED_TRACE(write);
    const char* initiate = write ? kWriteInitiate : kReadInitiate;
    ask(write, 2);
    EXPECT_THAT(sent_to_server(), ElementsAre(initiate));
    for (int repetition = 0; repetition < 2; ++repetition) {
      pass(milliseconds(500));
      EXPECT_THAT(sent_to_server(), ElementsAre(kTimeOutAbort, initiate));
      expect_nothing();
    }
    answer_well(write);
    expect_success(write);
    EXPECT_FALSE(emitted(EventKind::sdo_abort, 5));
  }
}

TEST_F(RepeatedSdo, TheLastAttemptIsTheReply) {
  for (const bool write : {false, true}) {
    SCOPED_TRACE(write);
    ask(write, 1);
    pass(milliseconds(999));
    expect_nothing();
    pass(milliseconds(1));
    EXPECT_EQ(answer().error, to_error(AbortCode::timeout));
    expect_nothing();
    EXPECT_TRUE(emitted(EventKind::sdo_abort, 5));
    hear(0x585, {0x80, 0x00, 0x20, 0x00, 0x00, 0x00, 0x04, 0x05});  // a late abort
    sent();
  }
}

TEST_F(RepeatedSdo, AnAbortThatALostFrameExplainsDoesTheSame) {
  for (const bool write : {false, true}) {
    SCOPED_TRACE(write);
    ask(write, 1);
    hear(0x585, {0x80, 0x00, 0x20, 0x00, 0x00, 0x00, 0x04, 0x05});
    EXPECT_THAT(sent_to_server(), testing::Contains(write ? kWriteInitiate : kReadInitiate));
    expect_nothing();
    answer_well(write);
    expect_success(write);
  }
}

TEST_F(RepeatedSdo, ARefusalIsFinal) {
  for (const bool write : {false, true}) {
    ask(write, 3);
    sent();
    hear(0x585, {0x80, 0x00, 0x20, 0x00, 0x00, 0x00, 0x02, 0x06});
    EXPECT_EQ(answer().error, to_error(AbortCode::no_object));
    expect_nothing();
  }
}

TEST_F(RepeatedSdo, IsNotSoByItself) {
  for (const bool write : {false, true}) {
    ask(write, 0);
    pass(milliseconds(500));
    EXPECT_EQ(answer().error, to_error(AbortCode::timeout));
    hear(0x585, {0x80, 0x00, 0x20, 0x00, 0x00, 0x00, 0x04, 0x05});
    sent();
  }
}

// The value is sent in segments; the response to the second segment is lost.
TEST_F(RepeatedSdo, ADownloadInSegmentsBeginsAgainWithTheFirst) {
  line_->execute({.tag = 7,
                  .request = SdoWrite{.node = 5,
                                      .address = {0x2000, 0},
                                      .data = std::vector<std::byte>(10, std::byte{0x11}),
                                      .repeats = 1}},
                 now_);
  for (int attempt = 0; attempt < 2; ++attempt) {
    EXPECT_THAT(sent_to_server(), testing::Contains("605#210020000A000000"));
    hear(0x585, {0x60, 0x00, 0x20, 0x00, 0, 0, 0, 0});
    EXPECT_THAT(sent_to_server(), ElementsAre("605#0011111111111111"));
    if (attempt == 0) {
      pass(milliseconds(500));
    }
  }
  hear(0x585, {0x20, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_THAT(sent_to_server(), ElementsAre("605#1911111100000000"));
  hear(0x585, {0x30, 0, 0, 0, 0, 0, 0, 0});
  expect_success(true);
}

TEST_F(RepeatedSdo, TheCommandsTimeOutIsForAllAttempts) {
  for (const bool write : {false, true}) {
    SCOPED_TRACE(write);
    ask(write, 1, milliseconds(100));
    pass(milliseconds(50));
    EXPECT_THAT(sent_to_server(), testing::Contains(kTimeOutAbort));
    expect_nothing();
    pass(milliseconds(50));
    EXPECT_FALSE(answer().ok());
    expect_nothing();
    pass(seconds(1));
    hear(0x585, {0x80, 0x00, 0x20, 0x00, 0x00, 0x00, 0x04, 0x05});
    sent();
  }
}

// --- SDO clients of the own dictionary -------------------------------------------------

// The arbiter of the line uses the default server of each device, so no other client may use it.
TEST_F(LineTest, AnSdoClientObjectCannotHaveTheIdentifiersOfADefaultServer) {
  make(config_with_axis());
  od::ObjectDescription client{
      .index = 0x1280, .name = "SDO client parameter", .type = od::ObjectType::record};
  const auto add = [&client](std::uint8_t sub, od::DataType type, std::uint32_t value) {
    od::VariableDescription variable;
    variable.sub = sub;
    variable.type = type;
    variable.access = sub == 0 ? od::Access::constant : od::Access::rw;
    variable.value.resize(od::byte_size(type));
    store_le(std::span(variable.value), std::uint64_t{value});
    client.variables.push_back(std::move(variable));
  };
  add(0, od::DataType::unsigned8, 3);
  add(1, od::DataType::unsigned32, 0x605);
  add(2, od::DataType::unsigned32, 0x585);
  add(3, od::DataType::unsigned8, 5);
  ASSERT_TRUE(line_->dictionary().add(client).ok());
  boot();
  const auto write = [this](std::uint8_t sub, std::uint32_t cob_id) {
    std::vector<std::byte> data(4);
    store_le(data.data(), cob_id);
    line_->execute({.request = LocalWrite{.address = {0x1280, sub}, .data = std::move(data)}},
                   now_);
    return answer().error;
  };
  const Error refused = to_error(AbortCode::invalid_value);
  constexpr std::uint32_t kInvalid = 0x8000'0000;
  EXPECT_EQ(write(1, 0x605), refused);
  EXPECT_EQ(write(2, 0x585), refused);
  EXPECT_EQ(write(1, 0x601), refused) << "the arbiter may use any server";
  EXPECT_EQ(write(1, kInvalid | 0x605), Error{});
  EXPECT_EQ(write(2, kInvalid | 0x585), Error{});
  EXPECT_EQ(write(1, 0x605), refused);
  EXPECT_EQ(write(1, 0x6C0), Error{});
  EXPECT_EQ(write(2, 0x6C1), Error{});

  // An answer of the device is heard by one client.
  line_->execute({.tag = 1, .request = SdoRead{.node = 5, .address = {0x2000, 0}}}, now_);
  hear(0x585, {0x4B, 0x00, 0x20, 0x00, 0xCD, 0xAB, 0, 0});
  EXPECT_TRUE(answer().ok());
}

// NMT commands that the stack issues without an order are also sent at once.
TEST_F(LineTest, TheResetBehindRestoredDefaultsWaitsForNothing) {
  LineConfig config = config_with_axis();
  config.nodes.clear();
  make(config);
  line_->start(now_);
  pass(seconds(1));
  sent();
  Command command{.tag = 7, .request = ScanApply{.node = 5, .restore = true}};
  line_->execute(std::move(command), now_);
  EXPECT_THAT(sent(), ElementsAre("605#4000100000000000"));
  hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
  EXPECT_THAT(sent(), ElementsAre("605#231110016C6F6164"));
  hear(0x585, {0x60, 0x11, 0x10, 0x01, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("000#8105"));
}

TEST_F(LineTest, ANodeThatStrayedIsStartedAtOnce) {
  LineConfig config = config_with_axis();
  config.keep_operational = true;
  make(config);
  boot();
  for (int i = 0; i < 2; ++i) {  // until the time for executing the NMT start has passed
    pass(milliseconds(60));
    hear(0x705, {0x05});
  }
  sent();
  hear(0x705, {0x7F});
  EXPECT_THAT(sent(), ElementsAre("000#0105"));
}

}  // namespace
}  // namespace linegate::line
