// A line beside a foreign master: the test plays the bus.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/nmt/heartbeat_consumer.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;

LineConfig observed(LineConfig config) {
  config.role = Role::observer;
  config.node_id = 0;
  return config;
}

std::vector<int> numbers(const image::Snapshot& snapshot) {
  std::vector<int> out;
  for (const std::byte b : snapshot.bytes) {
    out.push_back(std::to_integer<int>(b));
  }
  return out;
}

class ObserverTest : public LineTest {
 protected:
  void observe(const LineConfig& config) {
    make(observed(config));
    line_->start(now_);
  }

  void expect_silence() {
    can::Frame frame;
    ASSERT_FALSE(line_->wants_to_send(now_));
    ASSERT_FALSE(line_->next_frame(frame, now_)) << text(frame);
  }

  void hear_remote(std::uint32_t id) {
    can::Frame frame = can::make_frame(id, {});
    frame.flags |= can::Frame::kRemote;
    frame.length = 1;
    frame.time = now_;
    line_->receive(std::span(&frame, 1), now_);
  }

  std::vector<Event> of(EventKind kind) {
    std::vector<Event> all = events();
    std::erase_if(all, [&](const Event& e) { return e.kind != kind; });
    return all;
  }
};

LineConfig talkative() {
  LineConfig config = config_with_axis();
  config.sync_period = milliseconds(10);
  config.time_period = milliseconds(100);
  config.heartbeat = milliseconds(100);
  config.nodes[0].pdo_deadline = milliseconds(50);
  config.defaults = {{0, 7}, {1, 1}};
  return config;
}

TEST_F(ObserverTest, TransmitsNothingWhateverIsHeard) {
  observe(talkative());
  expect_silence();
  for (std::uint32_t id = 0; id < 0x800; ++id) {
    for (const std::uint8_t first :
         std::initializer_list<std::uint8_t>{0x00, 0x01, 0x05, 0x23, 0x40, 0x81, 0xC2, 0xFF}) {
      hear(id, {first, 0x00, 0x10, 0x00, 0, 0, 0, 0});
    }
    hear(id, {});
    hear(id, {0x7F});
    hear(id, {0x82, 0x00});
    hear_remote(id);
    expect_silence();
    events();
  }
}

TEST_F(ObserverTest, TransmitsNothingWhateverTimeBrings) {
  observe(talkative());
  hear(0x705, {0x05});
  hear(0x185, {1, 2, 3, 4, 5, 6});
  for (int second = 0; second < 3600; ++second) {
    pass(seconds(1));
    hear(0x080, {});
    expect_silence();
    events();
  }
  for (const can::BusState state :
       {can::BusState::bus_off, can::BusState::error_active, can::BusState::absent}) {
    line_->bus_event({.kind = can::BusEvent::Kind::state, .state = state, .time = now_});
    expect_silence();
  }
  line_->stop(now_);
  expect_silence();
}

TEST_F(ObserverTest, RefusesWhatWouldTransmit) {
  observe(talkative());
  events();
  for (int kind = 0; kind < static_cast<int>(CommandKind::versions); ++kind) {
    Command command{.tag = static_cast<std::uint64_t>(kind) + 1,
                    .kind = static_cast<CommandKind>(kind),
                    .node = 5,
                    .index = 0x1017};
    command.data.resize(4);
    line_->execute(command, now_);
    expect_silence();
    const Reply reply = answer();
    EXPECT_EQ(reply.tag, command.tag);
    EXPECT_EQ(reply.error, to_error(Refusal::wrong_role)) << name(command.kind);
    const std::vector<Event> told = of(EventKind::command_refused);
    ASSERT_EQ(told.size(), 1U);
    EXPECT_EQ(told[0].code, static_cast<std::uint32_t>(Refusal::wrong_role));
  }
  OutputWrite write{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
  write.values.push_back({.entry = 0, .length = 4});
  EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::wrong_role);
  expect_silence();
  const std::vector<Event> told = of(EventKind::output_refused);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, static_cast<std::uint32_t>(OutputRefusal::wrong_role));
  EXPECT_EQ(line_->state().counters.output_writes_refused, 1U);
  EXPECT_FALSE(line_->request_pdo(1));
  expect_silence();
}

TEST_F(ObserverTest, HasTheLayoutOfTheManager) {
  make(config_with_axis());
  const std::uint64_t inputs = line_->layout(Direction::inputs).id;
  const std::uint64_t outputs = line_->layout(Direction::outputs).id;
  make(observed(config_with_axis()));
  EXPECT_EQ(line_->layout(Direction::inputs).id, inputs);
  EXPECT_EQ(line_->layout(Direction::outputs).id, outputs);
  EXPECT_EQ(line_->layout(Direction::outputs).direction, Direction::outputs);
  EXPECT_EQ(snapshot(Direction::inputs).layout_id, inputs);
  EXPECT_EQ(snapshot(Direction::outputs).layout_id, outputs);
  EXPECT_EQ(snapshot(Direction::outputs).direction, Direction::outputs);
}

TEST_F(ObserverTest, WhatTheMasterSendsIsTheOutputs) {
  observe(config_with_axis());
  EXPECT_FALSE(snapshot(Direction::outputs).is_valid(0));
  hear(0x205, {1, 2, 3, 4, 5});
  EXPECT_TRUE(line_->image_changed(Direction::outputs));
  EXPECT_FALSE(line_->image_changed(Direction::inputs));
  const image::Snapshot outputs = snapshot(Direction::outputs);
  EXPECT_THAT(numbers(outputs), ElementsAre(1, 2, 3, 4, 5));
  EXPECT_TRUE(outputs.is_valid(0));
  EXPECT_TRUE(outputs.is_valid(1));
  ASSERT_EQ(outputs.marks.size(), 1U);
  EXPECT_EQ(outputs.marks[0].node, 5);
  EXPECT_EQ(outputs.marks[0].time, now_);
}

TEST_F(ObserverTest, WhatTheDevicesSendIsTheInputs) {
  observe(config_with_axis());
  hear(0x185, {0x11, 0x22, 1, 2, 3, 4});
  const image::Snapshot inputs = snapshot(Direction::inputs);
  const auto& entries = line_->layout(Direction::inputs).entries;
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(inputs.bytes[entries[0].bit_offset / 8], std::byte{0x11});
  EXPECT_EQ(inputs.bytes[entries[1].bit_offset / 8], std::byte{1});
  EXPECT_TRUE(inputs.is_valid(0));
  const LineState state = line_->state();
  EXPECT_EQ(state.role, Role::observer);
  EXPECT_EQ(state.node_id, 0);
  EXPECT_EQ(state.counters.rpdos, 1U);
  EXPECT_EQ(state.counters.frames_received, 1U);
  EXPECT_EQ(state.counters.frames_sent, 0U);
}

TEST_F(ObserverTest, ANodeThatSaysNothingElseIsOperationalWithItsFirstPdo) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration{};
  observe(config);
  EXPECT_EQ(line_->node_state(5).presence, Presence::unknown);
  const std::uint64_t before = line_->node_revision(5);
  hear(0x185, {0x11, 0x22, 1, 2, 3, 4});
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_GT(line_->node_revision(5), before);
  EXPECT_EQ(line_->state().nodes_operational, 1);
}

TEST_F(ObserverTest, HeartbeatsTellStateLossAndReturn) {
  observe(config_with_axis());
  hear(0x705, {0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  EXPECT_TRUE(told(EventKind::boot_up, 5));
  hear(0x705, {0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_TRUE(line_->node_state(5).heartbeat_monitored);
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
  pass(milliseconds(250));
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  EXPECT_TRUE(told(EventKind::heartbeat_lost, 5));
  EXPECT_EQ(line_->state().counters.heartbeats_lost, 1U);
  hear(0x705, {0x05});
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  EXPECT_TRUE(told(EventKind::heartbeat_recovered, 5));
}

TEST_F(ObserverTest, CommandsOfTheMasterAreToldAndBelievedWhereNothingElseTellsTheState) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration{};
  observe(config);
  hear(0x705, {0x00});
  events();
  hear(0x000, {0x01, 0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  std::vector<Event> told = of(EventKind::nmt_command);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(told[0].code, 1U);
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
  hear(0x000, {0x02, 0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::stopped);
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  hear(0x000, {0x03, 0x00});
  EXPECT_EQ(of(EventKind::malformed_frame).size(), 1U);
}

TEST_F(ObserverTest, AnswersToAGuardingMasterAreHeartbeats) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration{};
  config.nodes[0].guard_time = milliseconds(100);
  config.nodes[0].life_time_factor = 2;
  observe(config);
  hear(0x705, {0x00});
  pass(seconds(1));
  EXPECT_TRUE(of(EventKind::heartbeat_lost).empty()) << "nobody has asked it yet";
  for (const unsigned toggle : {0x00U, 0x80U, 0x00U, 0x80U}) {
    hear_remote(0x705);
    hear(0x705, {static_cast<std::uint8_t>(toggle | 5U)});
    pass(milliseconds(100));
  }
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_EQ(line_->state().counters.frames_malformed, 0U);
  events();
  pass(milliseconds(100));
  const std::vector<Event> lost = of(EventKind::heartbeat_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost[0].code, nmt::kByNodeGuarding);
  EXPECT_EQ(line_->node_state(5).presence, Presence::missing);
}

TEST_F(ObserverTest, ANodeThatIsGuardedUnexpectedlyIsUnderstoodFromTheFirstRequest) {
  LineConfig config = config_with_axis();
  config.nodes[0].heartbeat = Duration{};
  observe(config);
  hear_remote(0x705);
  hear(0x705, {0x85});
  hear_remote(0x705);
  hear(0x705, {0x05});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_EQ(line_->state().counters.frames_malformed, 0U);
  pass(seconds(100));
  EXPECT_EQ(line_->node_state(5).presence, Presence::present) << "no life time is known";
}

TEST_F(ObserverTest, EmcysAndForeignNodesAreTold) {
  LineConfig config = observed(config_with_axis());
  config.node_id = 126;  // of the master
  make(config);
  line_->start(now_);
  hear(0x085, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(line_->node_state(5).last_emcy, 0x8110);
  EXPECT_EQ(line_->node_state(5).presence, Presence::present);
  EXPECT_TRUE(told(EventKind::emcy, 5));
  hear(0x77E, {0x05});
  EXPECT_FALSE(told(EventKind::unexpected_node, 126)) << "the master";
  hear(0x709, {0x05});
  hear(0x709, {0x05});
  EXPECT_EQ(of(EventKind::unexpected_node).size(), 1U);
  EXPECT_EQ(line_->node_state(9).state, nmt::State::operational);
}

TEST_F(ObserverTest, TheSyncAndTheTimeOfOthersCount) {
  observe(config_with_axis());
  hear(0x080, {});
  hear(0x080, {7});
  EXPECT_EQ(line_->sync_count(), 2U);
  EXPECT_FALSE(line_->network_utc(now_));
  hear(0x100, {0, 0, 0, 0, 1, 0});
  ASSERT_TRUE(line_->network_utc(now_));
  EXPECT_EQ(*line_->network_utc(now_), std::chrono::hours(24) * 5114);
}

TEST_F(ObserverTest, WithoutABusNothingIsValid) {
  observe(config_with_axis());
  hear(0x185, {1, 2, 3, 4, 5, 6});
  hear(0x205, {1, 2, 3, 4, 5});
  line_->bus_event({.kind = can::BusEvent::Kind::interface_failed, .code = 19, .time = now_});
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  EXPECT_FALSE(snapshot(Direction::outputs).is_valid(0));
  EXPECT_TRUE(told(EventKind::interface_failed));
}

TEST_F(ObserverTest, APdoThatStaysAwayIsTold) {
  LineConfig config = config_with_axis();
  config.nodes[0].pdo_deadline = milliseconds(50);
  observe(config);
  hear(0x185, {1, 2, 3, 4, 5, 6});
  pass(milliseconds(60));
  EXPECT_TRUE(told(EventKind::pdo_timeout, 5));
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(told(EventKind::pdo_recovered, 5));
  hear(0x185, {1, 2});
  EXPECT_TRUE(told(EventKind::pdo_length, 5));
  EXPECT_EQ(line_->state().counters.frames_malformed, 1U);
}

// --- what SDO transfers of others say -----------------------------------------------------------

// As the device answers an expedited download.
class OverheardSdoTest : public ObserverTest {
 protected:
  void write(od::Address place, std::uint32_t value, unsigned bytes) {
    const auto b = [](std::uint32_t v, unsigned at) { return static_cast<std::uint8_t>(v >> at); };
    hear(0x605,
         {static_cast<std::uint8_t>(0x23U | (4U - bytes) << 2U), b(place.index, 0),
          b(place.index, 8), place.sub, b(value, 0), b(value, 8), b(value, 16), b(value, 24)});
    hear(0x585, {0x60, b(place.index, 0), b(place.index, 8), place.sub, 0, 0, 0, 0});
  }

  // Position first, then Status, on another COB-ID.
  void remap_tpdo() {
    write({0x1800, 1}, 0x8000'0185, 4);
    write({0x1A00, 0}, 0, 1);
    write({0x1A00, 1}, 0x2001'0020, 4);
    write({0x1A00, 2}, 0x2000'0010, 4);
    write({0x1A00, 0}, 2, 1);
    write({0x1800, 1}, 0x0000'0285, 4);
  }

  static LineConfig remapped() {
    LineConfig config = config_with_axis();
    const auto set = [&](od::Address place, std::uint64_t value) {
      for (od::ObjectDescription& object : config.nodes[0].device.objects) {
        for (od::VariableDescription& variable : object.variables) {
          if (od::Address{object.index, variable.sub} == place) {
            store_le(std::span(variable.value), value);
          }
        }
      }
    };
    set({0x1A00, 1}, 0x2001'0020);
    set({0x1A00, 2}, 0x2000'0010);
    set({0x1800, 1}, 0x0000'0285);
    return config;
  }

  static std::uint64_t managed_inputs(const LineConfig& config) {
    return (*Line::make(config).value)->layout(Direction::inputs).id;
  }
};

TEST_F(OverheardSdoTest, TransfersAndAbortsAreTold) {
  observe(config_with_axis());
  events();
  write({0x1017, 0}, 250, 2);
  const std::vector<Event> told = of(EventKind::sdo_transfer);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(told[0].code, 1U) << "written";
  EXPECT_EQ(told[0].value, 2U);
  EXPECT_EQ(load_le<std::uint16_t>(told[0].data.data()), 0x1017U);
  EXPECT_EQ(load_le<std::uint16_t>(told[0].data.data() + 3), 250U);
  EXPECT_EQ(told[0].length, 5);
  hear(0x605, {0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0});
  hear(0x585, {0x80, 0x18, 0x10, 0x01, 0x11, 0x00, 0x09, 0x06});
  const std::vector<Event> aborted = of(EventKind::sdo_abort);
  ASSERT_EQ(aborted.size(), 1U);
  EXPECT_EQ(aborted[0].code, 0x0609'0011U);
}

TEST_F(OverheardSdoTest, ChannelsThatAMasterConfiguresAreFollowedFromThenOn) {
  observe(config_with_axis());
  const auto transfers_on = [&](std::uint32_t request, std::uint32_t response) {
    events();
    hear(request, {0x40, 0x18, 0x10, 0x04, 0, 0, 0, 0});
    hear(response, {0x43, 0x18, 0x10, 0x04, 0x4D, 0, 0, 0});
    return of(EventKind::sdo_transfer);
  };
  EXPECT_TRUE(transfers_on(0x6E5, 0x5E5).empty());
  write({0x1201, 1}, 0x6E5, 4);
  EXPECT_TRUE(transfers_on(0x6E5, 0x5E5).empty()) << "one half of it";
  write({0x1201, 2}, 0x5E5, 4);
  const std::vector<Event> told = transfers_on(0x6E5, 0x5E5);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(load_le<std::uint16_t>(told[0].data.data()), 0x1018U);
  EXPECT_EQ(line_->node_state(5).serial, 77U) << "and it tells as much as the default one";
  EXPECT_EQ(transfers_on(0x605, 0x585).size(), 1U);
  hear(0x5E5, {1, 2, 3});
  EXPECT_EQ(of(EventKind::malformed_frame).size(), 1U);
  write({0x1202, 1}, 0x2000'0000 | 0x1234567, 4);
  write({0x1202, 2}, 0x6E6, 4);
  EXPECT_EQ(transfers_on(0x6E5, 0x5E5).size(), 1U) << "there may be several";
  write({0x1201, 1}, 0x8000'06E5, 4);
  EXPECT_TRUE(transfers_on(0x6E5, 0x5E5).empty()) << "switched off";
}

TEST_F(OverheardSdoTest, ChannelsOfTheDeviceFileAreFollowedFromTheBegin) {
  LineConfig config = config_with_axis();
  const auto cob_id = [](std::uint8_t sub, std::uint32_t value) {
    od::VariableDescription out{.sub = sub, .type = od::DataType::unsigned32};
    out.value.resize(4);
    store_le(std::span(out.value), std::uint64_t{value});
    return out;
  };
  od::ObjectDescription server{.index = 0x1202};
  server.variables = {cob_id(1, 0x6E5), cob_id(2, 0x5E5)};
  auto& objects = config.nodes[0].device.objects;
  objects.insert(std::ranges::find_if(objects, [](const auto& o) { return o.index > 0x1202; }),
                 server);
  observe(config);
  const auto mapped_over = [&](std::uint32_t request, std::uint32_t response) {
    hear(request, {0x2B, 0x17, 0x10, 0x00, 0xFA, 0, 0, 0});
    hear(response, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
    return of(EventKind::sdo_transfer).size();
  };
  EXPECT_EQ(mapped_over(0x6E5, 0x5E5), 1U);
  config.nodes[0].objects = {{{0x1202, 2}, {std::byte{0xE7}, std::byte{5}, {}, {}}}};
  observe(config);
  EXPECT_EQ(mapped_over(0x6E5, 0x5E5), 0U) << "the configuration says otherwise";
  EXPECT_EQ(mapped_over(0x6E5, 0x5E7), 1U);
}

TEST_F(OverheardSdoTest, AChannelThatIsTheDefaultOneIsFollowedOnce) {
  observe(config_with_axis());
  write({0x1201, 1}, 0x605, 4);
  write({0x1201, 2}, 0x585, 4);
  events();
  write({0x1017, 0}, 250, 2);
  EXPECT_EQ(of(EventKind::sdo_transfer).size(), 1U);
}

TEST_F(OverheardSdoTest, WhatIsReadOfTheIdentityIsShown) {
  observe(config_with_axis());
  hear(0x605, {0x40, 0x18, 0x10, 0x04, 0, 0, 0, 0});
  hear(0x585, {0x43, 0x18, 0x10, 0x04, 0x4D, 0, 0, 0});
  EXPECT_EQ(line_->node_state(5).serial, 77U);
}

TEST_F(OverheardSdoTest, ANewMappingMakesTheLayoutOfTheManagerThatWroteIt) {
  observe(config_with_axis());
  const std::uint64_t before = line_->layout(Direction::inputs).id;
  const std::uint64_t outputs = line_->layout(Direction::outputs).id;
  hear(0x205, {1, 2, 3, 4, 5});
  remap_tpdo();
  EXPECT_EQ(line_->layout(Direction::inputs).id, before) << "the node is still being configured";
  EXPECT_EQ(line_->layout_revision(), 0U);
  events();
  hear(0x000, {0x01, 0x05});
  EXPECT_EQ(line_->layout(Direction::inputs).id, managed_inputs(remapped()));
  EXPECT_NE(line_->layout(Direction::inputs).id, before);
  EXPECT_EQ(line_->layout(Direction::outputs).id, outputs);
  EXPECT_EQ(line_->layout_revision(), 1U);
  hear(0x285, {1, 2, 3, 4, 0x11, 0x22});
  const image::Snapshot inputs = snapshot(Direction::inputs);
  EXPECT_THAT(numbers(inputs), ElementsAre(1, 2, 3, 4, 0x11, 0x22));
  EXPECT_TRUE(inputs.is_valid(0));
  EXPECT_THAT(numbers(snapshot(Direction::outputs)), ElementsAre(1, 2, 3, 4, 5));
  expect_silence();
}

TEST_F(OverheardSdoTest, TheChangeIsToldOnce) {
  observe(config_with_axis());
  remap_tpdo();
  events();
  pass(seconds(2));
  std::vector<Event> all = events();
  std::erase_if(all, [](const Event& e) {
    return e.kind != EventKind::pdo_mapping && e.kind != EventKind::layout_changed;
  });
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].kind, EventKind::pdo_mapping);
  EXPECT_EQ(all[0].node, 5);
  EXPECT_EQ(all[0].code, 1U);
  EXPECT_EQ(all[0].value, 0U);
  EXPECT_EQ(all[0].data[0], std::byte{1});
  EXPECT_EQ(load_le<std::uint64_t>(all[1].data.data()), line_->layout(Direction::inputs).id);
  EXPECT_EQ(load_le<std::uint64_t>(all[1].data.data() + 8), line_->layout(Direction::outputs).id);
  remap_tpdo();  // as the master does after each boot
  pass(seconds(2));
  EXPECT_TRUE(of(EventKind::layout_changed).empty());
}

TEST_F(OverheardSdoTest, ARefusedWriteChangesNothing) {
  observe(config_with_axis());
  hear(0x605, {0x23, 0x00, 0x18, 0x01, 0x85, 0x01, 0x00, 0x80});
  hear(0x585, {0x80, 0x00, 0x18, 0x01, 0x00, 0x00, 0x00, 0x08});
  pass(seconds(2));
  EXPECT_EQ(line_->layout_revision(), 0U);
}

TEST_F(OverheardSdoTest, APdoThatIsSwitchedOffLeavesTheImage) {
  observe(config_with_axis());
  write({0x1800, 1}, 0x8000'0185, 4);
  pass(seconds(2));
  EXPECT_TRUE(line_->layout(Direction::inputs).entries.empty());
  const std::vector<Event> told = of(EventKind::pdo_mapping);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].data[0], std::byte{0});
  image::Snapshot kept;
  line_->snapshot(Direction::inputs, kept, now_, false);
  write({0x1800, 1}, 0x0000'0185, 4);
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(line_->layout(Direction::inputs).id, managed_inputs(config_with_axis()))
      << "with its first frame";
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
}

TEST_F(OverheardSdoTest, SnapshotsOfALayoutThatComesBackAreNotTakenForNewOnes) {
  observe(config_with_axis());
  image::Snapshot kept;
  for (std::uint8_t i = 1; i < 20; ++i) {
    hear(0x185, {i, 0, 0, 0, 0, 0});
    line_->snapshot(Direction::inputs, kept, now_, false);
  }
  write({0x1800, 1}, 0x8000'0185, 4);
  pass(seconds(2));
  write({0x1800, 1}, 0x0000'0185, 4);
  hear(0x185, {99, 0, 0, 0, 0, 0});
  EXPECT_TRUE(line_->image_changed(Direction::inputs));
  line_->snapshot(Direction::inputs, kept, now_, false);
  EXPECT_EQ(kept.bytes, snapshot(Direction::inputs).bytes);
  EXPECT_EQ(kept.bytes[0], std::byte{99});
}

TEST_F(OverheardSdoTest, AMappingThatNobodyUnderstandsIsPublishedAsItIs) {
  observe(config_with_axis());
  write({0x1800, 1}, 0x8000'0185, 4);
  write({0x1A00, 0}, 0, 1);
  write({0x1A00, 1}, 0x5FFF'0120, 4);  // an object that its file does not have
  write({0x1A00, 0}, 1, 1);
  write({0x1800, 1}, 0x0000'0185, 4);
  hear(0x000, {0x01, 0x05});
  EXPECT_TRUE(line_->layout(Direction::inputs).entries.empty()) << "its length is not known";
  hear(0x185, {1, 2, 3, 4, 5});
  const image::Layout& layout = line_->layout(Direction::inputs);
  ASSERT_EQ(layout.entries.size(), 1U);
  EXPECT_EQ(layout.entries[0].name, "axis.COB-ID 185h");
  EXPECT_EQ(layout.entries[0].bit_length, 40);
  EXPECT_EQ(layout.entries[0].node, 5);
  EXPECT_EQ(layout.entries[0].remote_pdo, 1);
  EXPECT_EQ(layout.entries[0].index, 0);
  const image::Snapshot inputs = snapshot(Direction::inputs);
  EXPECT_TRUE(inputs.is_valid(0));
  EXPECT_EQ(inputs.bytes[0], std::byte{1});
  EXPECT_EQ(inputs.bytes[4], std::byte{5});
  EXPECT_EQ(line_->state().counters.rpdos, 1U);
}

TEST_F(OverheardSdoTest, APdoThatWasConfiguredBeforeAnybodyListenedIsPublishedAsItIs) {
  observe(config_with_axis());
  hear(0x385, {1, 2});
  hear(0x485, {1, 2});
  hear(0x385, {1, 2});
  hear(0x306, {1, 2});  // of a node that is not configured
  hear(0x306, {1, 2});
  hear(0x306, {1, 2});
  EXPECT_EQ(line_->layout_revision(), 0U);
  hear(0x385, {7, 8});
  const image::Layout& layout = line_->layout(Direction::inputs);
  ASSERT_EQ(layout.entries.size(), 3U);
  EXPECT_EQ(layout.entries[2].name, "axis.COB-ID 385h");
  EXPECT_EQ(layout.entries[2].remote_pdo, 3);
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(2));
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  const std::vector<Event> told = of(EventKind::pdo_mapping);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].code, 3U);
  EXPECT_EQ(told[0].data[0], std::byte{0});
}

TEST_F(OverheardSdoTest, TheIdentifierOfEmcysMayMove) {
  observe(config_with_axis());
  write({0x1014, 0}, 0x0000'00F5, 4);
  hear(0x0F5, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(line_->node_state(5).last_emcy, 0x8110);
}

}  // namespace
}  // namespace linegate::line
