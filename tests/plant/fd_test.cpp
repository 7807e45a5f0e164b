// SPDX-License-Identifier: Apache-2.0
// A line of CANopen FD with simulated devices, in virtual time: boot and configuration by USDO,
// PDOs of 64 bytes, commands.
#include <algorithm>
#include <array>
#include <initializer_list>
#include <iterator>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/sim/bus.h"
#include "bridges/sim/device.h"
#include "bridges/sim/program_memory.h"
#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/emcy/message.h"
#include "stack/line/build.h"
#include "stack/line/following.h"
#include "stack/line/line.h"

namespace linegate::plant {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kFdOwn = 127;

struct FdDevice {
  std::unique_ptr<sim::Device> device;
  sim::Bus::Endpoint end = 0;
};

// A bus with a line and simulated devices.
class FdNetwork {
 public:
  static line::NodeConfig node_of(std::uint8_t id, const std::string& profile = "fd-io") {
    line::NodeConfig node;
    node.id = id;
    node.name = "io" + std::to_string(id);
    node.device = *eds::load(sim::eds_text(profile), sim::eds_name(profile), id).value;
    node.heartbeat = 100ms;
    return node;
  }

  FdNetwork() {
    config.name = "press";
    config.canopen_fd = true;
    config.node_id = kFdOwn;
    config.heartbeat = 500ms;
  }

  // Another line on the same bus, from now on.
  line::Line& join(const line::LineConfig& of) {
    auto made = line::Line::make(of);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : to_string(made.diagnostics.at(0)));
    companions.push_back({*std::move(made.value), bus.attach()});
    companions.back().line->start(now);
    return *companions.back().line;
  }

  // Adds a device for each node of the configuration, and runs for 2 s.
  void start(const std::string& profile = "fd-io") {
    power_on(profile);
    run(2s);
  }

  // Nodes that do not boot have no device.
  void power_on(const std::string& profile) {
    for (const line::NodeConfig& node : config.nodes) {
      if (!node.boot) {
        continue;
      }
      sim::DeviceOptions options;
      const auto own = profiles.find(node.id);
      options.profile = own == profiles.end() ? profile : own->second;
      options.node_id = node.id;
      options.fd = config.canopen_fd;
      options.emcy_fd = config.emcy_fd;
      devices.push_back({*std::move(sim::Device::make(options).value), bus.attach()});
    }
    power_on_line();
  }

  void power_on_line() {
    auto made = line::Line::make(config);
    ASSERT_TRUE(made.ok());
    line = *std::move(made.value);
    line->expect_acknowledgements();
    for (FdDevice& each : devices) {
      each.device->start(now);
    }
    line->start(now);
  }

  void run(Duration time) {
    const Instant end = now + time;
    while (now < end) {
      turn();
      now = std::min(std::max(next(), now + 1us), end);  // less than 1us may be left
    }
    turn();
  }

  line::Reply execute(line::Request request) {
    line->execute({.tag = ++tags, .request = std::move(request)}, now);
    line::Reply reply;
    for (unsigned i = 0; i < 1000; ++i) {
      run(10ms);
      if (line->pop_reply(reply)) {
        EXPECT_EQ(reply.tag, tags);
        return reply;
      }
    }
    ADD_FAILURE() << "no reply";
    return reply;
  }
  line::Reply read(std::uint8_t node, od::Address address) {
    return execute(line::SdoRead{.node = node, .address = address});
  }
  line::Reply write(std::uint8_t node, od::Address address, std::vector<std::byte> data) {
    return execute(line::SdoWrite{.node = node, .address = address, .data = std::move(data)});
  }
  // 1017h, which each node has.
  Error write_object_of(std::uint8_t node) {
    return write(node, {0x1017, 0}, {std::byte{0xFA}, std::byte{0}}).error;
  }
  std::uint64_t in_device(std::size_t device, od::Address address) {
    return devices[device].device->dictionary().number(address).value_or(~0ULL);
  }
  std::uint32_t entry(image::Direction direction, std::uint8_t node, od::Address address) {
    const image::Layout& layout = line->layout(direction);
    const auto found = std::ranges::find_if(layout.entries, [&](const image::Entry& each) {
      return each.node == node && od::Address{each.index, each.sub} == address;
    });
    EXPECT_NE(found, layout.entries.end());
    return static_cast<std::uint32_t>(found - layout.entries.begin());
  }
  // The frames of the bus from now on with that identifier.
  std::vector<can::Frame> frames_of(std::uint32_t id) const {
    std::vector<can::Frame> out;
    std::ranges::copy_if(seen, std::back_inserter(out),
                         [id](const can::Frame& frame) { return frame.id == id; });
    return out;
  }

  line::LineConfig config;
  sim::Bus bus{{.bit_rate = 1'000'000, .data_bit_rate = 5'000'000}};
  sim::Bus::Endpoint line_end = bus.attach();
  sim::Bus::Endpoint witness = bus.attach();
  std::unique_ptr<line::Line> line;
  std::vector<FdDevice> devices;
  std::map<std::uint8_t, std::string> profiles;  // by node-ID; others have that of power_on()
  std::vector<can::Frame> seen;
  Instant now{1s};
  std::uint64_t tags = 0;
  // No other node acknowledges what the line sends: its controller holds a few frames.
  bool unacknowledged = false;

  void turn() {
    bus.advance(now);
    for (FdDevice& each : devices) {
      serve(*each.device, each.end);
    }
    for (Companion& each : companions) {
      serve(*each.line, each.end);
    }
    serve_line();
    std::array<can::Frame, 8> batch;
    while (const std::size_t count = bus.take(witness, batch, now)) {
      seen.insert(seen.end(), batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(count));
    }
  }
  Instant next() const {
    Instant next = earlier(bus.next_wake(), line->next_wake());
    for (const FdDevice& each : devices) {
      next = earlier(next, each.device->next_wake());
    }
    for (const Companion& each : companions) {
      next = earlier(next, each.line->next_wake());
    }
    return next;
  }

 private:
  template <class Station>
  void serve(Station& station, sim::Bus::Endpoint at) {
    std::array<can::Frame, 8> batch;
    while (const std::size_t count = bus.take(at, batch, now)) {
      receive(station, std::span(batch).first(count));
    }
    station.advance(now);
    can::Frame out;
    while (bus.room(at) > 0 && station.next_frame(out, now)) {
      EXPECT_TRUE(bus.submit(at, out, now));
    }
  }
  void serve_line() {
    constexpr std::size_t kHeld = 8;
    std::array<can::Frame, 8> batch;
    while (const std::size_t count = bus.take(line_end, batch, now)) {
      line->receive(std::span(batch).first(count), now);
    }
    line->advance(now);
    while (!unacknowledged && !held.empty() && bus.room(line_end) > 0) {
      EXPECT_TRUE(bus.submit(line_end, held.front(), now));
      held.erase(held.begin());
      line->acknowledged(++acknowledged, now);
    }
    can::Frame out;
    while (held.size() < kHeld && bus.room(line_end) > 0 && line->next_frame(out, now)) {
      if (unacknowledged) {
        held.push_back(out);
      } else {
        EXPECT_TRUE(bus.submit(line_end, out, now));
        line->acknowledged(++acknowledged, now);
      }
    }
  }
  void receive(sim::Device& device, std::span<const can::Frame> frames) { device.receive(frames); }
  void receive(line::Line& other, std::span<const can::Frame> frames) {
    other.receive(frames, now);
  }

  struct Companion {
    std::unique_ptr<line::Line> line;
    sim::Bus::Endpoint end = 0;
  };
  std::vector<Companion> companions;

  std::vector<can::Frame> held;
  std::uint64_t acknowledged = 0;
};

class FdPlant : public testing::Test, protected FdNetwork {};

TEST_F(FdPlant, BootsAndConfiguresByUsdoAlone) {
  config.nodes = {node_of(5), node_of(6)};
  config.nodes[1].objects = {{{0x6200, 7}, {std::byte{0x77}}}};
  start();
  for (const auto node : std::initializer_list<std::uint8_t>{5, 6}) {
    EXPECT_EQ(line->node_state(node).boot, manager::kBooted) << int{node};
    EXPECT_EQ(line->node_state(node).state, nmt::State::operational) << int{node};
  }
  EXPECT_EQ(in_device(0, {0x1017, 0}), 100U);
  EXPECT_EQ(in_device(1, {0x6200, 7}), 0x77U);
  EXPECT_EQ(frames_of(0x605).size(), 0U);
  const std::vector<can::Frame> requests = frames_of(0x600 + kFdOwn);
  EXPECT_GT(requests.size(), 10U);
  EXPECT_TRUE(std::ranges::all_of(requests, &can::Frame::fd));
  const line::Counters counters = line->state().counters;
  EXPECT_GT(counters.usdo_transfers, 10U);
  EXPECT_EQ(counters.sdo_transfers, 0U);
  EXPECT_GT(counters.fd_frames_sent, 10U);
  EXPECT_GT(counters.fd_frames_received, 10U);
  EXPECT_LT(counters.fd_frames_received, counters.frames_received);  // heartbeats are classical
  EXPECT_EQ(counters.frames_malformed, 0U);
}

TEST_F(FdPlant, AWrongDeviceIsNotStarted) {
  config.nodes = {node_of(5)};
  for (od::ObjectDescription& object : config.nodes[0].device.objects) {
    if (object.index == 0x1018) {
      object.variables[2].value = {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}};
    }
  }
  start();
  EXPECT_EQ(line->node_state(5).boot, 'M');
  EXPECT_EQ(line->node_state(5).finding.object, (od::Address{0x1018, 2}));
}

TEST_F(FdPlant, PdosOf64BytesReachTheImageAndLeaveIt) {
  config.nodes = {node_of(5)};
  start();
  const std::vector<can::Frame> tpdos = frames_of(0x185);
  ASSERT_FALSE(tpdos.empty());
  EXPECT_EQ(tpdos.back().length, 64);
  EXPECT_TRUE(tpdos.back().fd());
  line::OutputWrite write;
  write.layout_id = line->layout(image::Direction::outputs).id;
  for (std::uint8_t sub = 1; sub <= 64; ++sub) {
    write.values.push_back({.entry = entry(image::Direction::outputs, 5, {0x6200, sub}),
                            .length = 1,
                            .data = {std::byte{static_cast<std::uint8_t>(sub + 100)}}});
  }
  ASSERT_EQ(line->write_outputs(write, now), line::OutputRefusal::none);
  seen.clear();
  run(100ms);
  const std::vector<can::Frame> rpdos = frames_of(0x205);
  ASSERT_EQ(rpdos.size(), 1U);
  EXPECT_EQ(rpdos[0].length, 64);
  EXPECT_TRUE(rpdos[0].fd());
  EXPECT_EQ(in_device(0, {0x6200, 64}), 164U);
  const line::Line::Input input = line->input(entry(image::Direction::inputs, 5, {0x6000, 64}));
  EXPECT_TRUE(input.valid);
  EXPECT_EQ(input.value, 164U);
}

TEST_F(FdPlant, CommandsAreTransferredByUsdo) {
  config.nodes = {node_of(5)};
  start();
  const std::uint64_t aborts = line->state().counters.usdo_aborts;
  const line::Reply name = read(5, {0x1008, 0});
  EXPECT_EQ(name.error, Error{});
  const auto* const value = std::get_if<std::vector<std::byte>>(&name.data);
  ASSERT_NE(value, nullptr);
  EXPECT_EQ(value->size(), std::string("Linegate FD I/O").size());
  EXPECT_EQ(write(5, {0x1015, 0}, {std::byte{9}, std::byte{0}}).error, Error{});
  EXPECT_EQ(in_device(0, {0x1015, 0}), 9U);
  EXPECT_EQ(read(5, {0x3000, 0}).error, to_error(AbortCode::no_object));
  EXPECT_EQ(write(5, {0x1000, 0}, std::vector<std::byte>(4)).error, to_error(AbortCode::read_only));
  EXPECT_EQ(read(9, {0x1000, 0}).error, to_error(AbortCode::timeout));
  EXPECT_EQ(line->state().counters.usdo_aborts, aborts + 3U);
}

TEST_F(FdPlant, ValuesOfManySegmentsOfADeviceAndOfTheOwnNode) {
  config.nodes = {node_of(5)};
  start();
  od::ObjectDescription object;
  object.index = 0x2F00;
  object.variables.push_back({.sub = 0, .type = od::DataType::domain, .access = od::Access::rw});
  ASSERT_TRUE(devices[0].device->dictionary().add(object).ok());
  std::vector<std::byte> sent(10'000);
  for (std::size_t i = 0; i < sent.size(); ++i) {
    sent[i] = static_cast<std::byte>(i * 7);
  }
  EXPECT_EQ(write(5, {0x2F00, 0}, sent).error, Error{});
  const line::Reply reply = read(5, {0x2F00, 0});
  const auto* const value = std::get_if<std::vector<std::byte>>(&reply.data);
  ASSERT_NE(value, nullptr);
  EXPECT_EQ(*value, sent);
}

TEST_F(FdPlant, ProgramsAreLoadedByUsdo) {
  config.nodes = {node_of(5, "drive")};
  start("drive");
  EXPECT_EQ(line->node_state(5).state, nmt::State::operational);
  std::vector<std::byte> content(20'000);
  for (std::size_t i = 0; i < content.size(); ++i) {
    content[i] = static_cast<std::byte>(i * 7);
  }
  const line::Reply reply = execute(line::ProgramDownload{
      .node = 5, .number = 1, .program = sim::make_program(0x0001'0002, content)});
  EXPECT_EQ(reply.error, Error{});
  const auto software = devices[0].device->dictionary().read({0x1F56, 1});
  ASSERT_TRUE(software.ok());
  EXPECT_EQ(load_le(*software), 0x0001'0002U);
  run(2s);
  EXPECT_EQ(line->node_state(5).state, nmt::State::operational);
}

TEST_F(FdPlant, ScansReadByUsdo) {
  config.nodes = {node_of(5), node_of(6)};
  start();
  const line::Reply reply = execute(line::Scan{});
  EXPECT_EQ(reply.error, Error{});
  const auto* const found = std::get_if<std::vector<scan::ScannedNode>>(&reply.data);
  ASSERT_NE(found, nullptr);
  ASSERT_EQ(found->size(), 2U);
  EXPECT_EQ((*found)[1].id, 6);
  EXPECT_EQ((*found)[1].number({0x1018, 2}), 0x401FU);
}

TEST_F(FdPlant, LostFramesAreRepeatedIfTheCommandSaysSo) {
  config.nodes = {node_of(5)};
  start();
  unsigned losses = 1;
  bus.set_disturbance([&](const can::Frame& frame, sim::Bus::Endpoint /*sender*/) {
    const bool lost = frame.id == 0x585 && losses > 0;
    losses -= lost ? 1U : 0U;
    return lost ? sim::Fate::lost : sim::Fate::delivered;
  });
  EXPECT_EQ(execute(line::SdoRead{.node = 5, .address = {0x1001, 0}, .repeats = 1}).error, Error{});
}

TEST_F(FdPlant, ABusThatReturnsCarriesAtMostOneRequestThatTimedOut) {
  config.nodes = {node_of(5)};
  start();
  const auto writes = [this] {
    const std::vector<can::Frame> requests = frames_of(0x600 + kFdOwn);
    return std::ranges::count_if(
        requests, [](const can::Frame& frame) { return frame.data[1] == std::byte{0x01}; });
  };
  unacknowledged = true;
  for (std::uint8_t value = 1; value <= 10; ++value) {
    EXPECT_EQ(write(5, {0x1015, 0}, {std::byte{value}, std::byte{0}}).error,
              to_error(AbortCode::timeout));
  }
  seen.clear();
  unacknowledged = false;
  run(2s);
  EXPECT_LE(writes(), 1);
  EXPECT_LE(in_device(0, {0x1015, 0}), 1U);
  EXPECT_EQ(write(5, {0x1015, 0}, {std::byte{20}, std::byte{0}}).error, Error{});
  EXPECT_EQ(in_device(0, {0x1015, 0}), 20U);
}

TEST_F(FdPlant, WhatIsNotDefinedForCanopenFdIsRefused) {
  config.nodes = {node_of(5)};
  start();
  EXPECT_EQ(
      execute(line::MpdoWrite{.node = 5, .address = {0x6200, 1}, .data = {std::byte{1}}}).error,
      to_error(line::Refusal::wrong_interface));
  EXPECT_EQ(execute(line::LssRequest{.procedure = lss::Procedure::assign}).error,
            to_error(line::Refusal::wrong_interface));
  EXPECT_EQ(
      execute(line::LocalWrite{.address = {0x1F80, 0}, .data = std::vector<std::byte>(4)}).error,
      to_error(AbortCode::invalid_value));
  ASSERT_TRUE(line->dictionary().set({0x1F80, 0}, std::uint32_t{0}));
  run(1s);
  EXPECT_EQ(read(5, {0x1000, 0}).error, Error{});
}

TEST_F(FdPlant, ADeviceThatDiesAndReturnsIsBootedAgain) {
  config.nodes = {node_of(5)};
  start();
  devices[0].device->kill();
  run(1s);
  EXPECT_NE(line->node_state(5).state, nmt::State::operational);
  devices[0].device->revive(now);
  run(3s);
  EXPECT_EQ(line->node_state(5).state, nmt::State::operational);
  EXPECT_EQ(in_device(0, {0x1017, 0}), 100U);
}

// Both directions; the history of the device has the error, too.
TEST_F(FdPlant, EmcysOfTwentyBytesAreSentAndReceived) {
  config.nodes = {node_of(5)};
  config.emcy_fd = true;
  start();
  std::vector<Event> events(200);
  (void)line->pop_events(events);
  seen.clear();
  node::Node& device = devices[0].device->node();
  EXPECT_EQ(device.report_error(0x5000, 0, {}, now), emcy::SendResult::sent);
  EXPECT_EQ(execute(line::EmcySend{.code = 0x6100}).error, Error{});
  run(100ms);
  ASSERT_EQ(frames_of(0x085).size(), 1U);
  EXPECT_EQ(frames_of(0x085)[0].length, 20);
  ASSERT_EQ(frames_of(0x080 + kFdOwn).size(), 1U);
  EXPECT_EQ(frames_of(0x080 + kFdOwn)[0].length, 20);
  events.resize(200);
  events.resize(line->pop_events(events));
  const auto received = std::ranges::find(events, EventKind::emcy, &Event::kind);
  ASSERT_NE(received, events.end());
  EXPECT_EQ(received->get<event::Emcy>()->fd.profile, 401);
  EXPECT_EQ(received->get<event::Emcy>()->fd.status, emcy::kStatusActive);
  const auto sent = std::ranges::find(events, EventKind::emcy_sent, &Event::kind);
  ASSERT_NE(sent, events.end());
  EXPECT_TRUE(sent->get<event::EmcySent>()->fd.any);
  EXPECT_EQ(read(5, {0x1003, 1}).error, Error{});
  EXPECT_EQ(in_device(0, {0x1003, 1}) & 0xFFFFU, 0x5000U);
  EXPECT_EQ(line->state().counters.frames_malformed, 0U);
}

TEST_F(FdPlant, EmcysOfTwentyBytesAreMalformedIfTheLineExpectsNone) {
  config.nodes = {node_of(5)};
  start();
  const std::uint64_t malformed = line->state().counters.frames_malformed;
  emcy::Message message{.code = 0x5000, .error_register = 1};
  message.fd.any = true;
  ASSERT_TRUE(bus.submit(witness, emcy::encode(message, can::CobId{0x85}), now));
  run(100ms);
  EXPECT_EQ(line->state().counters.frames_malformed, malformed + 1);
}

// Both directions of the image, as the manager has them.
TEST_F(FdPlant, AnObserverShowsTheImageOfTheManager) {
  config.nodes = {node_of(5)};
  for (std::uint32_t i = 0; i < 64; ++i) {
    config.defaults.push_back({.entry = i, .value = i + 100});
  }
  line::LineConfig beside = config;
  beside.role = line::Role::observer;
  beside.node_id = 0;
  line::Line& observer = join(beside);
  start();
  run(1s);
  ASSERT_EQ(observer.layout(image::Direction::inputs).id,
            line->layout(image::Direction::inputs).id);
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    image::Snapshot observed;
    image::Snapshot managed;
    observer.snapshot(direction, observed, now, false);
    line->snapshot(direction, managed, now, false);
    EXPECT_EQ(observed.bytes, managed.bytes);
    EXPECT_EQ(observed.valid, managed.valid);
    EXPECT_TRUE(observed.is_valid(63));
  }
  EXPECT_EQ(observer.node_state(5).state, nmt::State::operational);
  EXPECT_EQ(observer.node_state(5).product, 0x401FU) << "the manager has read it by USDO";
  EXPECT_EQ(observer.state().counters.frames_malformed, 0U);
}

// The manager boots a device of another gateway, which has 64 bytes in each direction.
TEST_F(FdPlant, OwnDevicesAreServedByUsdo) {
  config.nodes = {node_of(6)};
  line::LineConfig below;
  below.name = "below";
  below.role = line::Role::device;
  below.node_id = 0;
  below.canopen_fd = true;
  below.emcy_fd = config.emcy_fd = true;
  below.devices.push_back({6, "io", node_of(6).device, false});
  config.nodes[0].boot = true;
  line::Line& device = join(below);
  power_on_line();
  run(3s);
  EXPECT_EQ(line->node_state(6).boot, manager::kBooted);
  EXPECT_EQ(line->node_state(6).state, nmt::State::operational);
  line::OutputWrite write;
  write.layout_id = line->layout(image::Direction::outputs).id;
  for (std::uint8_t sub = 1; sub <= 64; ++sub) {
    write.values.push_back({.entry = entry(image::Direction::outputs, 6, {0x6200, sub}),
                            .length = 1,
                            .data = {std::byte{sub}}});
  }
  ASSERT_EQ(line->write_outputs(write, now), line::OutputRefusal::none);
  run(100ms);
  const auto& inputs = device.layout(image::Direction::inputs).entries;
  const auto found = std::ranges::find_if(inputs, [](const image::Entry& each) {
    return od::Address{each.index, each.sub} == od::Address{0x6200, 64};
  });
  ASSERT_NE(found, inputs.end());
  EXPECT_EQ(device.input(static_cast<std::uint32_t>(found - inputs.begin())).value, 64U);
  EXPECT_EQ(read(6, {0x1008, 0}).error, Error{});
  EXPECT_EQ(write_object_of(6), Error{});
  EXPECT_EQ(frames_of(0x606).size(), 0U);
}

// A line in the role device without devices of its own: its node serves USDO.
TEST_F(FdPlant, TheOwnNodeOfALineInTheRoleDeviceIsServedByUsdo) {
  line::LineConfig below;
  below.name = "below";
  below.role = line::Role::device;
  below.node_id = 9;
  below.canopen_fd = true;
  (void)join(below);
  power_on_line();
  run(1s);
  EXPECT_EQ(read(9, {0x1000, 0}).error, Error{});
  EXPECT_EQ(read(9, {0x3333, 0}).error, to_error(AbortCode::no_object));
}

// It leaves the network to its master, and 1F80h bit 0 does not change that.
TEST_F(FdPlant, ALineInTheRoleDeviceNeverBecomesTheMaster) {
  config.role = line::Role::device;
  config.node_id = 9;
  power_on_line();
  run(2s);
  EXPECT_EQ(line->state().role, line::Role::device);
  const auto write_startup = [&](std::uint8_t value) {
    return execute(line::LocalWrite{.address = {0x1F80, 0}, .data = {std::byte{value}, {}, {}, {}}})
        .error;
  };
  EXPECT_EQ(write_startup(1), to_error(AbortCode::invalid_value));
  EXPECT_EQ(write_startup(4), Error{});
  run(1s);
  EXPECT_EQ(line->state().role, line::Role::device);
  EXPECT_TRUE(frames_of(can::kNmtId).empty());
  EXPECT_FALSE(frames_of(0x700U + config.node_id).empty());
}

TEST_F(FdPlant, AnotherClientUsesTheServersAtTheSameTime) {
  config.nodes = {node_of(5)};
  start();
  can::Frame request;
  request.id = 0x603;
  request.flags = can::Frame::kFd;
  request.length = 6;
  const std::uint8_t bytes[] = {5, 0x11, 1, 0, 8, 0x10};
  std::ranges::transform(bytes, request.data.begin(), [](std::uint8_t b) { return std::byte{b}; });
  seen.clear();
  ASSERT_TRUE(bus.submit(witness, request, now));
  EXPECT_EQ(read(5, {0x1001, 0}).error, Error{});
  request.data[0] = std::byte{kFdOwn};
  request.data[4] = std::byte{0x00};
  ASSERT_TRUE(bus.submit(witness, request, now));
  run(100ms);
  ASSERT_EQ(frames_of(0x580 + kFdOwn).size(), 1U);
  EXPECT_EQ(frames_of(0x580 + kFdOwn)[0].data[1], std::byte{0x31});
  std::vector<Event> events(100);
  events.resize(line->pop_events(events));
  EXPECT_TRUE(std::ranges::none_of(
      events, [](const Event& event) { return event.get<event::ForeignSdo>() != nullptr; }));
}

TEST_F(FdPlant, SdoFramesAreNotServed) {
  config.nodes = {node_of(5)};
  start();
  seen.clear();
  const auto classical = can::make_frame(0x600 + kFdOwn, {0x40, 0, 0x10, 0, 0, 0, 0, 0});
  ASSERT_TRUE(bus.submit(witness, classical, now));
  ASSERT_TRUE(bus.submit(witness, can::make_frame(0x605, {0x40, 0, 0x10, 0, 0, 0, 0, 0}), now));
  run(100ms);
  EXPECT_TRUE(frames_of(0x580 + kFdOwn).empty());
  EXPECT_TRUE(frames_of(0x585).empty());
}

// Frames are lost, devices lose their power, clients write and read. Afterwards every node is
// Operational again, and an observer has the image of the manager.
TEST(FdRandom, NetworksRecoverFromLossesAndPowerCuts) {
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    FdNetwork network;
    network.profiles = {{5, "fd-io"}, {6, "drive"}, {7, "encoder"}};
    for (const auto& [node, profile] : network.profiles) {
      network.config.nodes.push_back(FdNetwork::node_of(node, profile));
    }
    network.config.emcy_fd = seed % 2 == 0;
    network.config.sync_period = 20ms;
    line::LineConfig beside = network.config;
    beside.role = line::Role::observer;
    beside.node_id = 0;
    const line::Line& observer = network.join(beside);
    network.start("");
    network.bus.set_disturbance([&](const can::Frame& /*frame*/, sim::Bus::Endpoint /*sender*/) {
      return random() % 100 < 2 ? sim::Fate::lost : sim::Fate::delivered;
    });
    for (int step = 0; step < 200; ++step) {
      FdDevice& device = network.devices[random() % network.devices.size()];
      switch (random() % 6) {
        case 0:
          device.device->alive() ? device.device->kill() : device.device->revive(network.now);
          break;
        case 1:
          network.line->execute({.tag = ++network.tags,
                                 .request = line::SdoRead{.node = device.device->options().node_id,
                                                          .address = {0x1008, 0}}},
                                network.now);
          break;
        case 2: {
          line::OutputWrite write;
          const image::Layout& outputs = network.line->layout(image::Direction::outputs);
          write.layout_id = outputs.id;
          for (std::uint32_t i = 0; i < outputs.entries.size(); ++i) {
            line::OutputValue value{.entry = i};
            value.length = static_cast<std::uint8_t>(outputs.entries[i].bit_length / 8);
            value.data[0] = static_cast<std::byte>(random());
            write.values.push_back(value);
          }
          EXPECT_EQ(network.line->write_outputs(write, network.now), line::OutputRefusal::none);
          break;
        }
        default:
          break;
      }
      network.run(std::chrono::milliseconds(random() % 100));
    }
    network.bus.set_disturbance({});
    for (const FdDevice& each : network.devices) {
      each.device->kill();
    }
    network.run(5s);
    for (const FdDevice& each : network.devices) {
      each.device->revive(network.now);
    }
    network.run(5s);
    EXPECT_EQ(network.line->state().nodes_operational, 3);
    EXPECT_EQ(network.line->state().counters.frames_malformed, 0U);
    EXPECT_EQ(observer.state().counters.frames_malformed, 0U);
    EXPECT_EQ(observer.layout(image::Direction::inputs).id,
              network.line->layout(image::Direction::inputs).id);
    const std::size_t inputs = network.line->layout(image::Direction::inputs).entries.size();
    for (std::uint32_t i = 0; i < inputs; ++i) {
      EXPECT_TRUE(network.line->input(i).valid) << i;
      EXPECT_EQ(observer.input(i).value, network.line->input(i).value) << i;
    }
  }
}

// Two lines of one gateway; outputs of one follow inputs of the other.
class FdForwarding : public testing::Test {
 protected:
  struct Joint {
    FdNetwork& from;
    FdNetwork& to;
    line::FollowedInputs inputs;
    line::FollowingOutputs outputs;
  };

  FdForwarding() { slow.config.canopen_fd = false; }

  // The output of the line that belongs to the object, which follows an input.
  static std::uint32_t bound_output(FdNetwork& network, od::Address object, std::uint8_t node = 5) {
    const auto plan = line::link_plan(network.config);
    const auto found =
        std::ranges::find_if(plan.value->outputs.entries, [&](const image::Entry& entry) {
          return entry.node == node && od::Address{entry.index, entry.sub} == object;
        });
    const auto entry = static_cast<std::uint32_t>(found - plan.value->outputs.entries.begin());
    network.config.bound.push_back(entry);
    std::ranges::sort(network.config.bound);
    return entry;
  }
  // Call it before start().
  void forward(FdNetwork& from, od::Address input, FdNetwork& to, od::Address output,
               std::uint32_t bits = 8, line::WhenLost when_lost = line::WhenLost::hold) {
    std::vector<line::Following> parts;
    line::add_parts({.input = {5, input},
                     .output_entry = bound_output(to, output),
                     .when_lost = when_lost,
                     .forwarded = true},
                    bits, parts);
    joints.push_back({from, to, line::FollowedInputs(parts), line::FollowingOutputs(parts)});
  }

  // The other outputs are 0: a PDO is sent when all of its values are known.
  static void default_others(FdNetwork& network) {
    const auto plan = line::link_plan(network.config);
    for (std::uint32_t i = 0; i < plan.value->outputs.entries.size(); ++i) {
      if (!std::ranges::binary_search(network.config.bound, i)) {
        network.config.defaults.push_back({.entry = i, .value = 0});
      }
    }
  }

  void start() {
    default_others(fast);
    default_others(slow);
    fast.power_on("fd-io");
    slow.power_on(slow.config.canopen_fd ? "fd-io" : "digital-io");
    run(2s);
  }
  void run(Duration time) {
    const Instant end = now + time;
    while (now < end) {
      for (FdNetwork* const network : {&fast, &slow}) {
        network->now = now;
        network->turn();
      }
      for (Joint& joint : joints) {
        if (joint.inputs.look(*joint.from.line)) {
          joint.outputs.take(*joint.to.line, joint.inputs.values(), now);
        }
      }
      now = std::min(std::max(earlier(fast.next(), slow.next()), now + 10us), end);
    }
  }

  FdNetwork fast;
  FdNetwork slow;
  std::vector<Joint> joints;
  Instant now{1s};
};

TEST_F(FdForwarding, ValuesCrossBothWaysBetweenFdAndClassicalLines) {
  fast.config.nodes = {FdNetwork::node_of(5)};
  slow.config.nodes = {FdNetwork::node_of(5, "digital-io")};
  forward(fast, {0x6000, 1}, slow, {0x6200, 1});  // counts
  forward(slow, {0x6000, 1}, fast, {0x6200, 2});
  start();
  run(1s);
  const std::vector<can::Frame> classical = slow.frames_of(0x205);
  ASSERT_GE(classical.size(), 2U);
  EXPECT_FALSE(classical.back().fd());
  EXPECT_EQ(slow.in_device(0, {0x6200, 1}), fast.in_device(0, {0x6000, 1}));
  EXPECT_EQ(fast.in_device(0, {0x6200, 2}), slow.in_device(0, {0x6000, 1}));
}

TEST_F(FdForwarding, APdoOfManyValuesIsDividedAmongClassicalOnes) {
  fast.config.nodes = {FdNetwork::node_of(5)};
  slow.config.nodes = {FdNetwork::node_of(5, "digital-io"), FdNetwork::node_of(6, "digital-io")};
  for (const std::uint8_t sub : {std::uint8_t{1}, std::uint8_t{2}}) {
    line::Following rule{.input = {5, {0x6000, sub}}, .forwarded = true};
    rule.output_entry = bound_output(slow, {0x6200, 1}, static_cast<std::uint8_t>(sub + 4));
    joints.push_back(
        {fast, slow, line::FollowedInputs({&rule, 1}), line::FollowingOutputs({&rule, 1})});
  }
  start();
  run(1s);
  line::OutputWrite write;
  write.layout_id = fast.line->layout(image::Direction::outputs).id;
  for (std::uint8_t sub = 1; sub <= 64; ++sub) {
    write.values.push_back({.entry = fast.entry(image::Direction::outputs, 5, {0x6200, sub}),
                            .length = 1,
                            .data = {std::byte{0x42}}});
  }
  ASSERT_EQ(fast.line->write_outputs(write, now), line::OutputRefusal::none);
  run(1s);
  EXPECT_EQ(slow.in_device(0, {0x6200, 1}), fast.in_device(0, {0x6000, 1}));
  EXPECT_EQ(slow.in_device(1, {0x6200, 1}), 0x42U) << "the FD device mirrors it";
  EXPECT_FALSE(slow.frames_of(0x205).empty());
  EXPECT_FALSE(slow.frames_of(0x206).empty());
}

// The first input and output are strings of 20 bytes, alone in their PDOs.
line::NodeConfig node_with_long_values() {
  constexpr std::uint8_t kBytes = 20;
  line::NodeConfig node = FdNetwork::node_of(5);
  node.boot = false;
  for (const auto& [mapping, object] :
       {std::pair<std::uint16_t, std::uint16_t>{0x1600, 0x6200}, {0x1A00, 0x6000}}) {
    od::VariableDescription& value = *node.device.find({object, 1});
    value.type = od::DataType::octet_string;
    value.value.assign(kBytes, std::byte{0});
    node.device.find({mapping, 0})->value = {std::byte{1}};
    store_le(std::span(node.device.find({mapping, 1})->value),
             std::uint32_t{object} << 16U | 0x100U | 8U * kBytes);
  }
  return node;
}

// Both lines have a node 5 with such values, which the test simulates.
class FdLongForwarding : public FdForwarding {
 protected:
  static constexpr std::uint8_t kBytes = 20;

  void start_long(line::WhenLost when_lost) {
    slow.config.canopen_fd = true;
    fast.config.nodes = {node_with_long_values()};
    slow.config.nodes = {node_with_long_values()};
    forward(fast, {0x6000, 1}, slow, {0x6200, 1}, 8 * kBytes, when_lost);
    fast.power_on("fd-io");
    slow.power_on("fd-io");
    tpdo.id = 0x185;
    tpdo.flags = can::Frame::kFd | can::Frame::kBitRateSwitch;
    tpdo.length = kBytes;
  }
  void live(std::initializer_list<FdNetwork*> nodes) {
    for (FdNetwork* const network : nodes) {
      ASSERT_TRUE(network->bus.submit(network->witness, can::make_frame(0x705, {5}), now));
    }
    run(50ms);
  }
  // The RPDOs that the node on the slow line received after this TPDO of the other.
  std::vector<can::Frame> sent_for(std::uint8_t first) {
    for (unsigned i = 0; i < kBytes; ++i) {
      tpdo.data[i] = static_cast<std::byte>(first + i);
    }
    return sent_again();
  }
  std::vector<can::Frame> sent_again() {
    live({&fast, &slow});
    slow.seen.clear();
    EXPECT_TRUE(fast.bus.submit(fast.witness, tpdo, now));
    live({&fast, &slow});
    return slow.frames_of(0x205);
  }
  void lose_the_source() {
    slow.seen.clear();
    for (int i = 0; i < 40; ++i) {
      live({&slow});
    }
  }
  static bool has_data_of(const can::Frame& frame, const can::Frame& other) {
    return std::ranges::equal(frame.bytes(), other.bytes());
  }

  can::Frame tpdo;
};

TEST_F(FdLongForwarding, ValuesCrossAsAWhole) {
  start_long(line::WhenLost::hold);
  for (std::uint8_t round = 1; round <= 3; ++round) {
    const std::vector<can::Frame> sent = sent_for(static_cast<std::uint8_t>(16 * round));
    ASSERT_EQ(sent.size(), 1U) << int{round};
    EXPECT_EQ(sent[0].length, kBytes);
    EXPECT_TRUE(has_data_of(sent[0], tpdo));
    EXPECT_EQ(slow.line->state().routing.values, round);
  }
  tpdo.data[17] = std::byte{0xEE};  // of the last part alone
  const std::vector<can::Frame> sent = sent_again();
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_TRUE(has_data_of(sent[0], tpdo));
  lose_the_source();
  for (const can::Frame& frame : slow.frames_of(0x205)) {
    EXPECT_TRUE(has_data_of(frame, tpdo)) << "it may be sent again, as a whole";
  }
}

TEST_F(FdLongForwarding, ALostValueIsZeroAsAWhole) {
  start_long(line::WhenLost::zero);
  ASSERT_EQ(sent_for(1).size(), 1U);
  lose_the_source();
  const std::vector<can::Frame> all = slow.frames_of(0x205);
  ASSERT_FALSE(all.empty());
  const auto is_zero = [](const can::Frame& frame) {
    return std::ranges::all_of(frame.bytes(), [](std::byte b) { return b == std::byte{}; });
  };
  EXPECT_TRUE(is_zero(all.back()));
  for (const can::Frame& frame : all) {
    EXPECT_TRUE(is_zero(frame) || has_data_of(frame, tpdo)) << "no part of it is lost alone";
  }
  const std::vector<can::Frame> sent = sent_again();
  ASSERT_FALSE(sent.empty());
  EXPECT_TRUE(has_data_of(sent.back(), tpdo));
}

TEST_F(FdLongForwarding, ALostValueIsHeldBackAsAWhole) {
  start_long(line::WhenLost::stop);
  ASSERT_EQ(sent_for(1).size(), 1U);
  lose_the_source();
  for (const can::Frame& frame : slow.frames_of(0x205)) {
    EXPECT_TRUE(has_data_of(frame, tpdo)) << "sent before the loss was noticed";
  }
  image::Snapshot outputs;
  slow.line->snapshot(image::Direction::outputs, outputs, now, false);
  EXPECT_FALSE(outputs.is_known(slow.entry(image::Direction::outputs, 5, {0x6200, 1})));
  const std::vector<can::Frame> sent = sent_for(2);
  ASSERT_FALSE(sent.empty());
  for (const can::Frame& frame : sent) {
    EXPECT_TRUE(has_data_of(frame, tpdo)) << "no part of it is that of before";
  }
}

TEST_F(FdPlant, AnOutputOfMoreThanEightBytesIsWrittenAsAWhole) {
  config.nodes = {node_with_long_values()};
  power_on("fd-io");
  ASSERT_TRUE(bus.submit(witness, can::make_frame(0x705, {5}), now));
  run(50ms);
  line::OutputValue value{.entry = entry(image::Direction::outputs, 5, {0x6200, 1}), .length = 20};
  for (std::size_t i = 0; i < 20; ++i) {
    value.data[i] = static_cast<std::byte>(i + 1);
  }
  line::OutputWrite write;
  write.layout_id = line->layout(image::Direction::outputs).id;
  write.values = {value};
  seen.clear();
  ASSERT_EQ(line->write_outputs(write, now), line::OutputRefusal::none);
  run(50ms);
  ASSERT_EQ(frames_of(0x205).size(), 1U);
  EXPECT_TRUE(std::ranges::equal(frames_of(0x205)[0].bytes(), std::span(value.data).first(20)));
  write.values[0].length = 8;
  EXPECT_EQ(line->write_outputs(write, now), line::OutputRefusal::bad_length);
}

}  // namespace
}  // namespace linegate::plant
