// SPDX-License-Identifier: Apache-2.0
// SRDOs of a node (EN 50325-5) as inputs of a manager and of an observer: valid while the SRDO is.
#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/line/build.h"
#include "stack/line/following.h"
#include "stack/line/srdo_plan.h"
#include "stack/manager/pdo_check.h"
#include "stack/srdo/parameters.h"

#include "tests/stack/line/observer_fixture.h"

namespace linegate::line {
namespace {

constexpr std::uint32_t kNormal = 0x109;
constexpr std::uint32_t kInverted = 0x10A;
constexpr std::uint16_t kDoor = 0x2100;

od::VariableDescription number_of_bytes(std::uint8_t sub, std::size_t bytes, std::uint64_t value) {
  od::VariableDescription out{.sub = sub,
                              .name = "value " + std::to_string(sub),
                              .type = bytes == 1   ? od::DataType::unsigned8
                                      : bytes == 2 ? od::DataType::unsigned16
                                                   : od::DataType::unsigned32,
                              .mappable = true};
  out.value.resize(bytes);
  store_le(std::span(out.value), value);
  return out;
}

// Node 5 transmits SRDO 1 on 109h and 10Ah: Door (8 bits), every 25 ms, SRVT 20 ms. It has a TPDO
// and an RPDO, too.
LineConfig config_with_srdo() {
  LineConfig config = config_with_axis();
  od::DeviceDescription& device = config.nodes[0].device;
  const auto add = [&device](std::uint16_t index, std::vector<od::VariableDescription> variables) {
    device.objects.push_back({.index = index, .name = "", .variables = std::move(variables)});
  };
  add(0x1301, {number_of_bytes(0, 1, 6), number_of_bytes(1, 1, 1), number_of_bytes(2, 2, 25),
               number_of_bytes(3, 1, 20), number_of_bytes(4, 1, 254),
               number_of_bytes(5, 4, kNormal), number_of_bytes(6, 4, kInverted)});
  add(0x1381, {number_of_bytes(0, 1, 2), number_of_bytes(1, 4, 0x2100'0108),
               number_of_bytes(2, 4, 0x2100'0208)});
  add(0x13FE, {number_of_bytes(0, 1, 0)});
  add(0x13FF, {number_of_bytes(0, 1, 1), number_of_bytes(1, 2, 0)});
  add(kDoor, {number_of_bytes(0, 1, 2), number_of_bytes(1, 1, 0), number_of_bytes(2, 1, 0)});
  std::ranges::sort(device.objects, {}, &od::ObjectDescription::index);
  return config;
}

// As `srdo` in plant.yaml does: then the boot process compares the SRDO with the device.
LineConfig with_configured_srdo(LineConfig config) {
  config.nodes[0].device.find(od::Address{0x1301, 1})->overridden = true;
  return config;
}

void set_described(LineConfig& config, od::Address address, std::uint64_t value) {
  od::VariableDescription* const variable = config.nodes[0].device.find(address);
  ASSERT_NE(variable, nullptr);
  store_le(std::span(variable->value), value);
}

class SrdoLine : public ObserverTest {
 protected:
  std::uint32_t entry() const {
    const auto& entries = line_->layout(Direction::inputs).entries;
    const auto found = std::ranges::find(entries, kDoor, &image::Entry::index);
    return static_cast<std::uint32_t>(found - entries.begin());
  }
  void hear_pair(std::uint8_t value) {
    hear(kNormal, {value});
    hear(kInverted, {static_cast<std::uint8_t>(~value)});
  }
  // "value", or "?" if it is not valid.
  std::string shown() {
    const Line::Input input = line_->input(entry());
    return input.valid ? std::to_string(input.value) : "?";
  }
  std::string states() {
    std::string out;
    for (const Event& event : of(EventKind::srdo_state)) {
      const auto& state = std::get<event::SrdoState>(event.data);
      EXPECT_EQ(event.node, 5);
      EXPECT_EQ(state.number, 1);
      out += std::string(srdo::name(state.fault)) + "; ";
    }
    return out;
  }

  void expect_values_while_valid() {
    EXPECT_EQ(shown(), "?");
    hear(kNormal, {7});
    EXPECT_EQ(shown(), "?") << "half of it";
    hear(kInverted, {0xF8});
    EXPECT_EQ(shown(), "7");
    EXPECT_EQ(states(), "valid; ");
    pass(milliseconds(30));
    hear_pair(8);
    EXPECT_EQ(shown(), "8");
    pass(milliseconds(49));
    EXPECT_EQ(shown(), "8");
    pass(milliseconds(1));
    EXPECT_EQ(shown(), "?");
    EXPECT_EQ(states(), "SCT exceeded; ");
    hear_pair(9);
    EXPECT_EQ(shown(), "9");
    EXPECT_EQ(states(), "valid; ");
    hear(kNormal, {10});
    hear(kInverted, {10});
    EXPECT_EQ(shown(), "?");
    EXPECT_EQ(states(), "not inverted; ");
    hear_pair(11);
    EXPECT_EQ(shown(), "11");
    hear(kNormal, {12});
    pass(milliseconds(20));
    EXPECT_EQ(shown(), "?");
    EXPECT_EQ(states(), "valid; SRVT exceeded; ");
  }
};

TEST_F(SrdoLine, IsAnInputOfTheManager) {
  make(config_with_srdo());
  boot();
  const image::Entry& door = line_->layout(Direction::inputs).entries.at(entry());
  EXPECT_EQ(door.node, 5);
  EXPECT_EQ(door.sub, 1) << "the inverted object has no entry";
  EXPECT_EQ(door.remote_pdo, image::kFirstSrdo);
  EXPECT_EQ(door.local_pdo, 2) << "after the TPDO";
  EXPECT_EQ(line_->layout(Direction::inputs).entries.size(), 3U);
  events();
  expect_values_while_valid();
}

TEST_F(SrdoLine, IsAnInputOfAnObserver) {
  make(config_with_srdo());
  const std::uint64_t layout = line_->layout(Direction::inputs).id;
  observe(config_with_srdo());
  EXPECT_EQ(line_->layout(Direction::inputs).id, layout);
  expect_values_while_valid();
  expect_silence();
}

TEST_F(SrdoLine, CountsPairsAndFaults) {
  observe(config_with_srdo());
  EXPECT_EQ(line_->state().srdos, (SrdoCounters{.received = 1}));
  hear_pair(1);
  hear_pair(2);
  EXPECT_EQ(line_->state().srdos, (SrdoCounters{.received = 1, .valid = 1, .pairs = 2}));
  pass(milliseconds(100));
  EXPECT_EQ(line_->state().srdos, (SrdoCounters{.received = 1, .pairs = 2, .faults = 1}));
}

TEST_F(SrdoLine, TheSctIsConfiguredAtTheReceiver) {
  LineConfig config = config_with_srdo();
  config.nodes[0].srdo_cycle[1] = milliseconds(200);
  observe(config);
  hear_pair(1);
  pass(milliseconds(199));
  EXPECT_EQ(shown(), "1");
  pass(milliseconds(1));
  EXPECT_EQ(shown(), "?");
}

TEST_F(SrdoLine, TheSrvtIsConfiguredAtTheReceiver) {
  LineConfig config = config_with_srdo();
  config.nodes[0].srdo_validation[1] = milliseconds(5);
  observe(config);
  hear(kNormal, {1});
  pass(milliseconds(5));
  EXPECT_EQ(states(), "SRVT exceeded; ");
}

// An SRDO of a manager that is not Operational is not kept for later: it may be unsafe then.
TEST_F(SrdoLine, IsNotShownBeforeOperational) {
  LineConfig config = config_with_srdo();
  config.own_start = false;
  make(config);
  line_->start(now_);
  hear_pair(1);
  EXPECT_EQ(shown(), "?");
  pass(seconds(1));
  Command start{.tag = 1, .request = NmtRequest{.node = 127, .command = nmt::Command::start}};
  line_->execute(start, now_);
  pass(milliseconds(1));
  EXPECT_EQ(shown(), "?");
  hear_pair(2);
  EXPECT_EQ(shown(), "2");
}

// An SRDO is received in both roles. A slave does not read the signature: SDO is the master's.
TEST_F(SrdoLine, IsAnInputOfAFlyingMasterInBothRoles) {
  LineConfig config = with_configured_srdo(config_with_srdo());
  config.node_id = 20;
  config.flying_master = {.priority = 1};
  make(config);
  line_->start(now_);
  hear(0x071, {0, 9});  // node 9 is the active master
  pass(milliseconds(1));
  ASSERT_EQ(line_->state().role, Role::device);
  hear(0x705, {0x05});
  hear_pair(1);
  EXPECT_EQ(shown(), "1");
  hear(0x072, {});
  pass(milliseconds(1500 + 200));
  ASSERT_EQ(line_->state().role, Role::manager);
  EXPECT_EQ(shown(), "?") << "the node was reset";
  hear_pair(2);
  EXPECT_EQ(shown(), "2");
  sent();
  hear(0x071, {0, 9});
  pass(milliseconds(1));
  ASSERT_EQ(line_->state().role, Role::device);
  EXPECT_EQ(shown(), "?") << "its boot process had not ended";
  hear(0x705, {0x05});
  hear_pair(3);
  EXPECT_EQ(shown(), "3");
  pass(milliseconds(50));
  EXPECT_EQ(shown(), "?") << "SCT exceeded";
  EXPECT_THAT(sent(), testing::Not(testing::Contains(testing::StartsWith("605#4"))));
}

TEST_F(SrdoLine, PairsOfANodeThatIsLostAreInvalidUntilTheNextPair) {
  observe(config_with_srdo());
  hear(0x705, {5});
  hear_pair(1);
  hear(0x705, {0});
  EXPECT_EQ(shown(), "?");
  hear_pair(2);
  EXPECT_EQ(shown(), "2");
}

// A reset by the manager, a heartbeat that is lost, bus off: the SRDO is not received, and a frame
// from before completes no pair.
class EndedSrdo : public SrdoLine {
 protected:
  void expect_end(const std::function<void()>& end) {
    hear_pair(1);
    ASSERT_EQ(shown(), "1");
    ASSERT_EQ(line_->state().srdos.valid, 1U);
    states();
    hear(kNormal, {2});
    end();
    EXPECT_EQ(shown(), "?");
    EXPECT_EQ(line_->state().srdos.valid, 0U);
    EXPECT_EQ(line_->state().srdos.faults, 1U);
    EXPECT_EQ(states(), "not received; ");
    hear(kInverted, {0xFD});
    EXPECT_EQ(shown(), "?") << "the normal frame is from before";
    EXPECT_EQ(line_->state().srdos.valid, 0U);
  }
  void reset_node() {
    line_->execute({.request = NmtRequest{.node = 5, .command = nmt::Command::reset_node}}, now_);
  }
  void bus_off() { line_->bus_event({.state = can::BusState::bus_off, .time = now_}); }
};

TEST_F(EndedSrdo, ByAResetOfTheManager) {
  make(config_with_srdo());
  boot();
  expect_end([this] { reset_node(); });
}

TEST_F(EndedSrdo, ByBusOff) {
  make(config_with_srdo());
  boot();
  expect_end([this] { bus_off(); });
}

TEST_F(EndedSrdo, ByBusOffOfAnObserver) {
  observe(config_with_srdo());
  expect_end([this] { bus_off(); });
}

TEST_F(EndedSrdo, ByAResetThatAnObserverReceives) {
  observe(config_with_srdo());
  hear(0x705, {5});
  expect_end([this] { hear(0x000, {0x81, 5}); });
}

TEST_F(EndedSrdo, ByALostHeartbeat) {
  LineConfig config = config_with_srdo();
  config.nodes[0].srdo_cycle[1] = seconds(10);
  config.nodes[0].heartbeat_consumer = milliseconds(10);
  set_described(config, {0x1301, 3}, 100);
  make(config);
  boot();
  expect_end([this] { pass(milliseconds(20)); });
}

// The vendor's tool has stored another mapping. Nothing is written: the node is not started, and
// its SRDO is not shown.
TEST_F(SrdoLine, ADeviceWithAnotherSrdoIsNotShown) {
  make(with_configured_srdo(config_with_srdo()));
  line_->start(now_);
  hear_identity();
  hear_no_serial_number();
  const auto answer = [this](std::uint8_t sub, std::uint16_t index, std::uint32_t value) {
    hear(0x585, {0x43, static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(index >> 8U),
                 sub, static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8U),
                 static_cast<std::uint8_t>(value >> 16U), static_cast<std::uint8_t>(value >> 24U)});
  };
  hear_no_pdo_records('4');
  answer(1, 0x1301, 1);
  answer(5, 0x1301, kNormal);
  answer(6, 0x1301, kInverted);
  answer(0, 0x1381, 2);
  answer(1, 0x1381, 0x2100'0308);
  EXPECT_EQ(line_->node_state(5).boot, 'J');
  EXPECT_EQ(line_->node_state(5).finding.object, (od::Address{0x1381, 1}));
  EXPECT_EQ(line_->node_state(5).finding.found, 0x2100'0308U);
  for (const std::string& frame : sent()) {
    EXPECT_FALSE(frame.starts_with("605#2")) << "a write: " << frame;
  }
  pass(milliseconds(1));
  hear_pair(1);
  EXPECT_EQ(shown(), "?");
  EXPECT_EQ(line_->state().srdos.valid, 0U);
}

TEST_F(SrdoLine, ADeviceThatDoesNotTransmitTheSrdoIsReported) {
  LineConfig config = with_configured_srdo(config_with_srdo());
  config.nodes[0].objects = {{{0x1301, 1}, {std::byte{0}}}};  // as a concise DCF at run time
  const auto plans = node_plans(config);
  const manager::PdoCheck check({plans.at(0).pdos.at(2)}, plans.at(0).writes);
  ASSERT_TRUE(check.fault());
  EXPECT_EQ(check.fault()->object, (od::Address{0x1301, 1}));
}

TEST_F(SrdoLine, TheBootComparesConfiguredSrdosAndThoseWithoutASignature) {
  LineConfig config = config_with_srdo();
  EXPECT_TRUE(assumed_srdos(config.nodes[0]).empty());
  EXPECT_EQ(assumed_srdos(with_configured_srdo(config).nodes[0]).size(), 1U);
  std::erase_if(config.nodes[0].device.objects,
                [](const od::ObjectDescription& object) { return object.index == 0x13FF; });
  EXPECT_EQ(assumed_srdos(config.nodes[0]).size(), 1U);
}

TEST_F(SrdoLine, AnObserverShowsNoSrdoThatADownloadChanged) {
  observe(config_with_srdo());
  hear_pair(1);
  states();
  const auto write = [this](std::uint8_t sub, std::uint16_t index, std::uint8_t value) {
    const auto low = static_cast<std::uint8_t>(index);
    const auto high = static_cast<std::uint8_t>(index >> 8U);
    hear(0x605, {0x2F, low, high, sub, value, 0, 0, 0});
    hear(0x585, {0x60, low, high, sub, 0, 0, 0, 0});
  };
  write(0, 0x1381, 2);
  EXPECT_EQ(shown(), "1") << "it has this value";
  write(1, 0x1301, 0);
  write(0, 0x1381, 0);
  EXPECT_EQ(shown(), "?");
  EXPECT_EQ(states(), "not received; ");
  write(1, 0x1301, 1);
  hear_pair(2);
  EXPECT_EQ(shown(), "?") << "it maps something else";
  write(0, 0x1381, 2);
  hear_pair(3);
  EXPECT_EQ(shown(), "3");
}

// They are sent in Operational alone, as PDOs.
TEST_F(SrdoLine, APairIsASignOfLife) {
  LineConfig config = config_with_srdo();
  config.nodes[0].heartbeat = {};
  observe(config);
  hear(kNormal, {1});
  EXPECT_EQ(line_->node_state(5).presence, manager::Presence::unknown);
  hear(kInverted, {0xFE});
  EXPECT_EQ(line_->node_state(5).presence, manager::Presence::present);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
}

// The number of the RPDO in the own dictionary shifts with each TPDO that the observer learns.
TEST_F(SrdoLine, FollowsANewLayoutOfAnObserver) {
  observe(config_with_srdo());
  hear_pair(1);
  const auto write = [this](std::uint8_t sub, std::uint16_t index, std::uint32_t value,
                            std::uint8_t command) {
    hear(0x605, {command, static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(index >> 8U),
                 sub, static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8U),
                 static_cast<std::uint8_t>(value >> 16U), static_cast<std::uint8_t>(value >> 24U)});
    hear(0x585, {0x60, static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(index >> 8U),
                 sub, 0, 0, 0, 0});
  };
  const std::uint64_t layout = line_->layout(Direction::inputs).id;
  write(1, 0x1800, 0x8000'0185, 0x23);
  write(0, 0x1A00, 0, 0x2F);
  write(0, 0x1A00, 1, 0x2F);
  write(1, 0x1800, 0x185, 0x23);
  hear(0x000, {1, 5});
  EXPECT_NE(line_->layout(Direction::inputs).id, layout);
  EXPECT_EQ(shown(), "1") << "it is copied";
  hear_pair(2);
  EXPECT_EQ(shown(), "2");
}

// 13FFh:01h of node 5 after its boot.
TEST_F(SrdoLine, TheSignatureOfTheDeviceIsCompared) {
  const LineConfig config = config_with_srdo();
  const std::uint16_t right = *srdo_sources(config).at(0).signature;
  for (const std::uint16_t found : {right, static_cast<std::uint16_t>(right ^ 1U)}) {
    make(config);
    boot();
    pass(milliseconds(1));
    EXPECT_THAT(sent(), testing::Contains("605#40FF130100000000"));
    hear(0x585, {0x4B, 0xFF, 0x13, 0x01, static_cast<std::uint8_t>(found),
                 static_cast<std::uint8_t>(found >> 8U), 0, 0});
    hear_pair(1);
    EXPECT_EQ(shown(), found == right ? "1" : "?");
    EXPECT_EQ(states(), found == right ? "valid; " : "other signature; ");
  }
}

TEST_F(SrdoLine, ASignatureIsNotReadAnyMoreWhenTheRoleIsGivenUp) {
  LineConfig config = config_with_srdo();
  config.node_id = 20;
  config.flying_master = {.priority = 1};
  make(config);
  line_->start(now_);
  hear(0x072, {});
  pass(milliseconds(1500 + 200));
  ASSERT_EQ(line_->state().role, Role::manager);
  hear_identity();
  hear_no_serial_number();
  hear_no_pdo_records();
  hear(0x585, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  hear(0x705, {0x7F});
  hear(0x705, {0x05});
  pass(milliseconds(1));
  ASSERT_THAT(sent(), testing::Contains("605#40FF130100000000"));
  hear(0x071, {0, 9});
  for (int i = 0; i < 20; ++i) {
    hear(0x705, {0x05});
    pass(milliseconds(100));
  }
  ASSERT_EQ(line_->state().role, Role::device);
  EXPECT_THAT(sent(), testing::Not(testing::Contains(testing::StartsWith("605#4"))));
}

TEST_F(SrdoLine, AnObserverComparesTheSignatureThatIsRead) {
  observe(config_with_srdo());
  hear_pair(1);
  hear(0x605, {0x40, 0xFF, 0x13, 0x01, 0, 0, 0, 0});
  hear(0x585, {0x4B, 0xFF, 0x13, 0x01, 0, 0, 0, 0});
  EXPECT_EQ(shown(), "?");
  hear_pair(1);
  EXPECT_EQ(shown(), "?");
  EXPECT_EQ(states(), "valid; other signature; ");
}

TEST_F(SrdoLine, AClientDoesNotChangeWhatTheImageShows) {
  make(config_with_srdo());
  boot();
  pass(milliseconds(1));
  sent();
  const auto write = [this](od::Address address, std::vector<std::byte> data) {
    line_->execute({.tag = 1, .request = SdoWrite{.node = 5, .address = address, .data = data}},
                   now_);
    Reply reply;
    return line_->pop_reply(reply) ? reply.error : Error{};
  };
  const std::vector<std::byte> other{std::byte{8}, std::byte{3}, std::byte{0}, std::byte{0x21}};
  EXPECT_EQ(write({0x1381, 1}, other), to_error(Refusal::image_pdo));
  EXPECT_EQ(write({0x1301, 5}, other), to_error(Refusal::image_pdo));
  EXPECT_EQ(write({0x1381, 0}, {std::byte{4}}), to_error(Refusal::image_pdo));
  EXPECT_TRUE(sent().empty());
  hear(0x585, {0x80, 0xFF, 0x13, 0x01, 0, 0, 0x02, 0x06});  // it has no signature
  EXPECT_EQ(write({0x1301, 1}, {std::byte{0}}), Error{}) << "the SRDO is then unsafe";
  EXPECT_EQ(sent().size(), 1U);
}

// TPDO 1 and SRDO 1 carry the object. With the value of the TPDO, the reaction would never act.
TEST_F(SrdoLine, AnOutputThatFollowsTheSrdoIsLostWithIt) {
  LineConfig config = config_with_srdo();
  set_described(config, {0x1A00, 1}, 0x2100'0108);
  config.bound = {1};
  make(config);
  boot();
  pass(milliseconds(1));
  const std::vector<Following> what{{.input = {5, {kDoor, 1}, image::kFirstSrdo},
                                     .output_entry = 1,
                                     .when_lost = WhenLost::zero,
                                     .forwarded = true}};
  FollowedInputs inputs(what);
  FollowingOutputs outputs(what);
  const auto written = [&] {
    inputs.look(*line_);
    outputs.take(*line_, inputs.values(), now_);
    return snapshot(Direction::outputs).bytes.at(4);
  };
  hear(0x185, {3, 0, 0, 0, 0});
  hear_pair(2);
  EXPECT_EQ(written(), std::byte{2});
  pass(milliseconds(60));
  hear(0x185, {3, 0, 0, 0, 0});
  EXPECT_EQ(written(), std::byte{0}) << "the SRDO is unsafe, the TPDO is received";
}

TEST_F(SrdoLine, AFollowedObjectIsThatOfItsPdo) {
  LineConfig config = config_with_srdo();
  set_described(config, {0x1A00, 1}, 0x2100'0108);
  observe(config);
  hear(0x185, {3, 0, 0, 0, 0});
  const std::vector<Following> what{
      {.input = {5, {kDoor, 1}, image::kFirstSrdo}},
      {.input = {5, {kDoor, 1}, 1}},
      {.input = {5, {kDoor, 1}}},                         // of any PDO
      {.input = {5, {kDoor, 1}, 2}},                      // PDO 1 maps it instead
      {.input = {5, {kDoor, 1}, image::kFirstSrdo + 1}},  // no other SRDO replaces it
      {.input = {5, {0x2001, 0}, image::kFirstSrdo}},     // a PDO replaces no SRDO
  };
  FollowedInputs inputs(what);
  inputs.look(*line_);
  std::string valid;
  for (const Line::Input& input : inputs.values()) {
    valid += input.valid ? std::to_string(input.value) + " " : "? ";
  }
  EXPECT_EQ(valid, "? 3 3 3 ? ? ");
}

// PdoReception has no validity.
TEST(SrdoPlan, HaveNoQueueOfReceptions) {
  LineConfig config = config_with_srdo();
  config.pdo_queue = 4;
  const auto plan = link_plan(config);
  ASSERT_TRUE(plan.ok());
  ASSERT_EQ(plan.value->rpdos.size(), 2U);
  EXPECT_EQ(plan.value->rpdos[0].queue, 4U);
  EXPECT_EQ(plan.value->rpdos[1].queue, 0U);
}

TEST(SrdoPlan, WhatNodesReceiveIsNoOutput) {
  LineConfig config = config_with_srdo();
  set_described(config, {0x1301, 1}, 2);
  EXPECT_TRUE(srdo_sources(config).empty());
  EXPECT_EQ(received_srdo(config.nodes[0], {kDoor, 1}), 1);
  EXPECT_EQ(received_srdo(config.nodes[0], {0x2002, 0}), 0);
  const auto made = Line::make(config);
  ASSERT_TRUE(made.ok());
  ASSERT_EQ(made.diagnostics.size(), 1U);
  EXPECT_EQ(made.diagnostics[0].severity, Severity::warning);
  EXPECT_EQ(made.diagnostics[0].text,
            "SRDO 1 of axis is received from no node of this line, and Linegate produces no SRDOs: "
            "its values are no outputs");
}

TEST(SrdoPlan, AFaultOfAConfiguredSrdoIsAnError) {
  LineConfig config = config_with_srdo();
  set_described(config, {0x1301, 3}, 0);
  config.nodes[0].device.find(od::Address{0x1301, 3})->overridden = true;
  EXPECT_FALSE(Line::make(config).ok());
}

LineConfig config_with_two_transmitters() {
  LineConfig config = config_with_srdo();
  config.nodes.push_back(config.nodes[0]);
  config.nodes[1].id = 6;
  config.nodes[1].name = "other";
  config.nodes[1].device.find(od::Address{0x1800, 1})->value[0] = std::byte{0x86};
  return config;
}

// The COB-IDs are constants of the device file, which cannot be those of both.
TEST(SrdoPlan, TwoTransmittersOnOneIdentifierAreLeftOut) {
  const auto made = Line::make(config_with_two_transmitters());
  ASSERT_TRUE(made.ok());
  EXPECT_EQ((*made.value)->state().srdos.received, 0U);
  std::vector<std::string> warnings;
  for (const Diagnostic& found : made.diagnostics) {
    EXPECT_EQ(found.severity, Severity::warning);
    if (found.text.starts_with("SRDO")) {
      warnings.push_back(found.text);
    }
  }
  const std::string left_out =
      " has the COB-IDs of an SRDO of another node, and is left out: give it others (srdo, cob_id)";
  EXPECT_THAT(warnings,
              testing::ElementsAre("SRDO 1 of axis" + left_out, "SRDO 1 of other" + left_out));
}

TEST(SrdoPlan, TwoConfiguredTransmittersOnOneIdentifierAreAnError) {
  LineConfig config = config_with_two_transmitters();
  for (NodeConfig& node : config.nodes) {
    node.device.find(od::Address{0x1301, 5})->overridden = true;
  }
  const auto made = Line::make(config);
  ASSERT_FALSE(made.ok());
  EXPECT_TRUE(std::ranges::any_of(made.diagnostics, [](const Diagnostic& found) {
    return found.text == "SRDO 1 of other has the COB-IDs of an SRDO of axis";
  }));
}

// 13FEh first and last, the signature computed.
TEST(SrdoPlan, ConfigurationIsWrittenInTheOrderOfTheStandard) {
  LineConfig config = config_with_srdo();
  config.nodes[0].objects = {{{0x1301, 3}, {std::byte{20}}}};
  const auto plans = node_plans(config);
  std::vector<std::string> written;
  for (const manager::ObjectWrite& write : plans.at(0).writes) {
    if (srdo::is_srdo_object(write.address.index)) {
      written.push_back(od::to_text(write.address));
    }
  }
  EXPECT_THAT(written, testing::ElementsAre("13FE:00", "1301:01", "1301:03", "1301:01", "13FF:01",
                                            "13FE:00"));
}

// The boot process awaits the first heartbeat after the last write.
TEST(SrdoPlan, ErrorControlBeginsAfterTheConfiguration) {
  LineConfig config = config_with_srdo();
  config.nodes[0].objects = {{{0x1301, 3}, {std::byte{20}}}};
  ASSERT_NE(config.nodes[0].heartbeat, Duration::zero());
  EXPECT_EQ(node_plans(config).at(0).writes.back().address,
            (od::Address{od::objects::kProducerHeartbeatTime, 0}));
  config.nodes[0].heartbeat = {};
  config.nodes[0].guard_time = milliseconds(100);
  config.nodes[0].life_time_factor = 3;
  EXPECT_EQ(node_plans(config).at(0).writes.back().address,
            (od::Address{od::objects::kLifeTimeFactor, 0}));
}

// Pairs that the node sends before it is silent, too.
TEST_F(SrdoLine, IsNotReceivedWhileTheNetworkSleeps) {
  LineConfig config = config_with_srdo();
  config.sleep = {.request = 0x690, .objection = 0x691};
  for (const bool observes : {false, true}) {
    observes ? observe(config) : make(config);
    if (!observes) {
      boot();
    }
    hear_pair(7);
    EXPECT_EQ(shown(), "7");
    if (observes) {
      hear(0x690, {2});
    } else {
      line_->execute({.tag = 7, .request = SleepRequest{SleepAction::prepare}}, now_);
    }
    EXPECT_EQ(shown(), "?");
    hear_pair(8);
    EXPECT_EQ(shown(), "?");
    pass(seconds(1));
    hear_pair(9);
    EXPECT_EQ(shown(), "?");
  }
}

}  // namespace
}  // namespace linegate::line
