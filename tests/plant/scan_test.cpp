// SPDX-License-Identifier: Apache-2.0
// Scans of a line without information about its devices, in virtual time.
#include <algorithm>

#include <gtest/gtest.h>

#include "stack/eds/reader.h"
#include "stack/scan/describe.h"
#include "stack/scan/scanned_node.h"

#include "tests/plant/world.h"

namespace linegate::plant {
namespace {

using namespace std::chrono_literals;
using image::Direction;

struct Seat {
  std::uint8_t node;
  const char* profile;
};
constexpr Seat kDevices[] = {
    {5, "drive"}, {7, "encoder"}, {8, "digital-io"}, {10, "analog-io"}, {126, "drive"}};

line::NodeConfig node_of(const Seat& seat, od::DeviceDescription device) {
  line::NodeConfig node;
  node.id = seat.node;
  node.name = seat.profile + std::to_string(seat.node);
  node.device = std::move(device);
  return node;
}

od::DeviceDescription file_of(const Seat& seat) {
  return *eds::load(sim::eds_text(seat.profile), sim::eds_name(seat.profile), seat.node).value;
}

class ScanTest : public testing::Test {
 protected:
  // A line with those devices on its bus and with `nodes` in its configuration.
  LineSeat& run(std::vector<line::NodeConfig> nodes) {
    line::LineConfig config;
    config.name = "press";
    config.heartbeat = 500ms;
    config.nodes = std::move(nodes);
    auto made = line::Line::make(std::move(config));
    EXPECT_TRUE(made.ok());
    world = std::make_unique<World>();
    LineSeat& seat = world->add_line(*std::move(made.value), {});
    for (const Seat& device : kDevices) {
      sim::DeviceOptions options;
      options.node_id = device.node;
      options.profile = device.profile;
      options.seed = device.node;
      world->add_device(seat, *std::move(sim::Device::make(options).value));
    }
    world->start();
    world->run(world->now() + 2s);
    return seat;
  }

  void apply(LineSeat& seat, std::uint64_t tag, line::ScanApply request, Duration timeout = 0s) {
    seat.line->execute({.tag = tag, .timeout = timeout, .request = request}, world->now());
    world->settle();
  }

  const line::Reply* execute(LineSeat& seat, std::uint64_t tag, line::Request request) {
    seat.line->execute({.tag = tag, .request = std::move(request)}, world->now());
    world->settle();
    return wait(seat, tag);
  }
  // The reply to reading or writing an object of a node.
  const line::Reply* sdo(LineSeat& seat, std::uint64_t tag, std::uint8_t node, od::Address object,
                         std::vector<std::byte> data = {}) {
    return data.empty()
               ? execute(seat, tag, line::SdoRead{.node = node, .address = object})
               : execute(seat, tag,
                         line::SdoWrite{.node = node, .address = object, .data = std::move(data)});
  }
  // What a scan read will do.
  const line::Reply* sdo_cached(LineSeat& seat, std::uint64_t tag, std::uint8_t node,
                                od::Address object) {
    return execute(seat, tag, line::SdoRead{.node = node, .address = object, .from_scan = true});
  }

  void scan(LineSeat& seat, std::uint64_t tag, std::uint8_t node = 0, Duration timeout = 0s) {
    line::Command command{.tag = tag, .timeout = timeout, .request = line::Scan{.node = node}};
    seat.line->execute(std::move(command), world->now());
    world->settle();
  }

  const line::Reply* wait(const LineSeat& seat, std::uint64_t tag) {
    for (int i = 0; i < 600 && !seat.replies.contains(tag); ++i) {
      world->run(world->now() + 100ms);
    }
    EXPECT_EQ(world->failure(), "");
    const auto found = seat.replies.find(tag);
    return found == seat.replies.end() ? nullptr : &found->second;
  }

  std::vector<scan::ScannedNode> found(const LineSeat& seat, std::uint64_t tag) {
    const line::Reply* const reply = wait(seat, tag);
    EXPECT_NE(reply, nullptr);
    EXPECT_TRUE(reply != nullptr && reply->ok());
    const auto* const nodes =
        reply == nullptr ? nullptr : std::get_if<std::vector<scan::ScannedNode>>(&reply->data);
    EXPECT_NE(nodes, nullptr);
    return nodes == nullptr ? std::vector<scan::ScannedNode>{} : *nodes;
  }

  std::unique_ptr<World> world;
};

// An SDO download: expedited, segmented or as block.
bool writes(const can::Frame& frame) {
  const auto command = std::to_integer<unsigned>(frame.data[0]) >> 5U;
  return frame.id > 0x600 && frame.id <= 0x67F && (command == 1 || command == 6);
}

TEST_F(ScanTest, FindsEveryDeviceAndWritesToNone) {
  LineSeat& seat = run({});
  scan(seat, 1);
  const auto nodes = found(seat, 1);
  ASSERT_EQ(nodes.size(), std::size(kDevices));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    EXPECT_EQ(nodes[i].id, kDevices[i].node);
    EXPECT_EQ(nodes[i].end, AbortCode::none);
    EXPECT_TRUE(scan::matches(file_of(kDevices[i]), nodes[i])) << kDevices[i].profile;
  }
  EXPECT_TRUE(std::ranges::none_of(seat.frames, writes));
  EXPECT_EQ(std::ranges::count(seat.events, EventKind::node_scanned, &Event::kind), 5);
  EXPECT_EQ(std::ranges::count(seat.events, EventKind::sdo_abort, &Event::kind), 0)
      << "a scan expects aborts";
}

TEST_F(ScanTest, WithTheirFilesTheImageIsThatOfAConfiguredPlant) {
  std::vector<line::NodeConfig> configured;
  for (const Seat& device : kDevices) {
    configured.push_back(node_of(device, file_of(device)));
  }
  const LineSeat& known = run(configured);
  const image::Layout inputs = known.line->layout(Direction::inputs);
  const image::Layout outputs = known.line->layout(Direction::outputs);
  ASSERT_FALSE(inputs.entries.empty());

  LineSeat& unknown = run({});
  scan(unknown, 1);
  std::vector<line::NodeConfig> learnt;
  for (const scan::ScannedNode& node : found(unknown, 1)) {
    const Seat& device = *std::ranges::find(kDevices, node.id, &Seat::node);
    learnt.push_back(node_of(device, scan::merge(file_of(device), node)));
  }
  const LineSeat& again = run(learnt);
  EXPECT_EQ(again.line->layout(Direction::inputs).id, inputs.id);
  EXPECT_EQ(again.line->layout(Direction::outputs).id, outputs.id);
}

TEST_F(ScanTest, WithoutFilesTheSameBytesStandAtTheSamePlaces) {
  std::vector<line::NodeConfig> configured;
  for (const Seat& device : kDevices) {
    configured.push_back(node_of(device, file_of(device)));
  }
  const LineSeat& known = run(configured);
  std::array<image::Layout, 2> wanted{known.line->layout(Direction::inputs),
                                      known.line->layout(Direction::outputs)};

  LineSeat& unknown = run({});
  scan(unknown, 1);
  std::vector<line::NodeConfig> learnt;
  for (const scan::ScannedNode& node : found(unknown, 1)) {
    const Seat& device = *std::ranges::find(kDevices, node.id, &Seat::node);
    learnt.push_back(node_of(device, scan::describe(node)));
  }
  LineSeat& again = run(learnt);
  for (const Direction direction : {Direction::inputs, Direction::outputs}) {
    const auto& layout = again.line->layout(direction);
    const auto& expected = wanted[static_cast<std::size_t>(direction)];
    ASSERT_EQ(layout.entries.size(), expected.entries.size());
    for (std::size_t i = 0; i < layout.entries.size(); ++i) {
      EXPECT_EQ(layout.entries[i].bit_offset, expected.entries[i].bit_offset) << i;
      EXPECT_EQ(layout.entries[i].bit_length, expected.entries[i].bit_length) << i;
      EXPECT_EQ(layout.entries[i].node, expected.entries[i].node) << i;
    }
  }
  EXPECT_EQ(again.line->state().nodes_operational, std::size(kDevices));
  EXPECT_TRUE(std::ranges::none_of(again.frames, writes)) << "there is nothing to configure";
}

TEST_F(ScanTest, ADeviceThatDiesMeanwhileIsToldWithWhatItSaid) {
  LineSeat& seat = run({});
  scan(seat, 1);
  world->run(world->now() + 100ms);
  seat.find(7)->device->kill();
  const auto nodes = found(seat, 1);
  ASSERT_EQ(nodes.size(), std::size(kDevices));
  EXPECT_EQ(nodes[1].id, 7);
  EXPECT_EQ(nodes[1].end, AbortCode::timeout);
  EXPECT_NE(nodes[1].number({0x1000, 0}), std::nullopt);
  EXPECT_EQ(nodes[2].end, AbortCode::none);
}

TEST_F(ScanTest, OneNodeCanBeReadAgain) {  // 5F01h
  LineSeat& seat = run({});
  scan(seat, 1, 8);
  const auto nodes = found(seat, 1);
  ASSERT_EQ(nodes.size(), 1U);
  EXPECT_EQ(nodes[0].id, 8);
  scan(seat, 2, 9);
  EXPECT_TRUE(found(seat, 2).empty()) << "no node found";
}

TEST_F(ScanTest, ThereIsOneAtATimeAndItsTimeOutEndsIt) {
  LineSeat& seat = run({});
  scan(seat, 1, 0, 50ms);
  scan(seat, 2);
  ASSERT_NE(wait(seat, 2), nullptr);
  EXPECT_EQ(seat.replies[2].error, to_error(line::Refusal::busy));
  ASSERT_NE(wait(seat, 1), nullptr);
  EXPECT_EQ(seat.replies[1].error, to_error(line::Refusal::timed_out));
  scan(seat, 3);
  EXPECT_EQ(found(seat, 3).size(), std::size(kDevices));
  EXPECT_EQ(seat.duplicate_replies, 0U);
}

TEST_F(ScanTest, IsRefusedForTheOwnNodeAndNodesThatCannotBe) {
  LineSeat& seat = run({});
  scan(seat, 1, 127);
  scan(seat, 2, 128);
  ASSERT_NE(wait(seat, 1), nullptr);
  ASSERT_NE(wait(seat, 2), nullptr);
  EXPECT_EQ(seat.replies[1].error, to_error(line::Refusal::bad_request));
  EXPECT_EQ(seat.replies[2].error, to_error(line::Refusal::bad_request));
}

TEST_F(ScanTest, IsCancelledWhenTheLineStops) {
  LineSeat& seat = run({});
  scan(seat, 1);
  world->run(world->now() + 10ms);
  seat.line->stop(world->now());
  world->settle();
  ASSERT_NE(wait(seat, 1), nullptr);
  EXPECT_EQ(seat.replies[1].error, to_error(line::Refusal::cancelled));
}

constexpr od::Address kHeartbeat{0x1017, 0};

bool resets_communication(const can::Frame& frame) {
  return frame.id == can::kNmtId && frame.data[0] == std::byte{0x82};
}

TEST_F(ScanTest, AppliedItSaysWhatIsToBeSetUpAndWritesNothingYet) {
  LineSeat& seat = run({});
  ASSERT_TRUE(sdo(seat, 1, 5, kHeartbeat, {std::byte{0}, std::byte{0}})->ok());
  seat.frames.clear();
  apply(seat, 2, {.set_up = true});
  const auto nodes = found(seat, 2);
  ASSERT_EQ(nodes.size(), std::size(kDevices));
  for (const scan::ScannedNode& node : nodes) {
    EXPECT_NE(node.number(kHeartbeat).value_or(0), 0U) << int{node.id};
  }
  EXPECT_EQ(nodes[0].number(kHeartbeat), 500U);
  EXPECT_TRUE(std::ranges::none_of(seat.frames, writes)) << "only the line made of the scan writes";
}

// 5F41h:5 of the own dictionary.
TEST_F(ScanTest, TheHeartbeatThatIsSetUpCanBeWritten) {
  constexpr std::uint8_t kOwn = 127;
  LineSeat& seat = run({});
  ASSERT_TRUE(sdo(seat, 1, 5, kHeartbeat, {std::byte{0}, std::byte{0}})->ok());
  ASSERT_TRUE(sdo(seat, 2, kOwn, {0x5F41, 5}, {std::byte{0xFA}, std::byte{0}})->ok());
  apply(seat, 3, {.set_up = true});
  const auto nodes = found(seat, 3);
  ASSERT_EQ(nodes.size(), std::size(kDevices));
  EXPECT_EQ(nodes[0].number(kHeartbeat), 250U);
}

TEST_F(ScanTest, DefaultsAreRestoredBeforeADeviceIsRead) {  // 1011h
  LineSeat& seat = run({});
  const auto delivered = sdo(seat, 1, 5, kHeartbeat)->bytes();
  ASSERT_TRUE(sdo(seat, 2, 5, kHeartbeat, {std::byte{77}, std::byte{0}})->ok());
  const std::vector<std::byte> save{std::byte{'s'}, std::byte{'a'}, std::byte{'v'}, std::byte{'e'}};
  ASSERT_TRUE(sdo(seat, 3, 5, {0x1010, 1}, save)->ok());
  apply(seat, 4, {});
  EXPECT_EQ(found(seat, 4)[0].number(kHeartbeat), 77U);
  apply(seat, 5, {.restore = true});
  const auto nodes = found(seat, 5);
  ASSERT_EQ(nodes.size(), std::size(kDevices));
  EXPECT_EQ(*nodes[0].find(kHeartbeat), delivered);
  EXPECT_EQ(std::ranges::count(seat.events, EventKind::sdo_abort, &Event::kind), 0);
}

TEST_F(ScanTest, ADeviceThatDoesNotComeBackFromItsResetIsTold) {
  LineSeat& seat = run({});
  apply(seat, 1, {.restore = true});
  world->run(world->now() + 20ms);
  seat.find(7)->device->kill();
  const auto nodes = found(seat, 1);
  EXPECT_EQ(std::ranges::count(nodes, AbortCode::none, &scan::ScannedNode::end), 4);
}

TEST_F(ScanTest, IsNotAppliedWhereNodesAreConfigured) {
  LineSeat& seat = run({node_of(kDevices[0], file_of(kDevices[0]))});
  apply(seat, 1, {});
  ASSERT_NE(wait(seat, 1), nullptr);
  EXPECT_EQ(seat.replies[1].error, to_error(line::Refusal::wrong_state));
  apply(seat, 2, {.node = 128});
  ASSERT_NE(wait(seat, 2), nullptr);
  EXPECT_EQ(seat.replies[2].error, to_error(line::Refusal::bad_request));
}

TEST_F(ScanTest, WhatIsTakenAsFoundIsRunWithoutAWriteOrAReset) {
  std::vector<line::NodeConfig> learnt;
  for (const Seat& device : kDevices) {
    od::DeviceDescription file = file_of(device);
    const_cast<od::VariableDescription*>(file.find(kHeartbeat))->configured = true;
    learnt.push_back(node_of(device, std::move(file)));
    learnt.back().as_found = true;
    learnt.back().objects.push_back({kHeartbeat, {std::byte{99}, std::byte{0}}});
  }
  const LineSeat& again = run(learnt);
  EXPECT_EQ(again.line->state().nodes_operational, std::size(kDevices));
  EXPECT_TRUE(std::ranges::none_of(again.frames, writes));
  EXPECT_TRUE(std::ranges::none_of(again.frames, resets_communication));
}

TEST_F(ScanTest, CommandsAreCarriedOutDuringTheScan) {
  LineSeat& seat = run({});
  scan(seat, 1);
  ASSERT_TRUE(sdo(seat, 2, 5, kHeartbeat, {std::byte{44}, std::byte{0}})->ok());
  EXPECT_FALSE(seat.replies.contains(1)) << "the scan goes on";
  EXPECT_EQ(sdo(seat, 3, 5, kHeartbeat)->bytes()[0], std::byte{44});
  EXPECT_FALSE(seat.replies.contains(1));
  EXPECT_EQ(found(seat, 1).size(), std::size(kDevices));
}

TEST_F(ScanTest, WhatItReadAnswersLaterReadsOnRequest) {
  LineSeat& seat = run({});
  scan(seat, 1);
  (void)found(seat, 1);
  const auto transfers = [&] { return seat.line->state().counters.sdo_transfers; };
  const std::uint64_t before = transfers();
  const line::Reply* vendor = sdo_cached(seat, 2, 5, {0x1018, 1});
  ASSERT_TRUE(vendor->ok());
  EXPECT_EQ(transfers(), before) << "no request to the device";
  EXPECT_EQ(sdo(seat, 3, 5, {0x1018, 1})->bytes(), vendor->bytes());
  EXPECT_EQ(transfers(), before + 1) << "without the request it is";
  EXPECT_TRUE(sdo_cached(seat, 4, 5, {0x6041, 0})->ok());
  EXPECT_EQ(transfers(), before + 2) << "a scan does not read 6041h";

  seat.find(5)->device->kill();
  EXPECT_TRUE(sdo_cached(seat, 5, 5, {0x1018, 1})->ok());
  seat.find(5)->device->revive(world->now());
  world->run(world->now() + 1s);
  ASSERT_TRUE(sdo(seat, 6, 5, kHeartbeat, {std::byte{44}, std::byte{0}})->ok());
  EXPECT_EQ(sdo_cached(seat, 7, 5, kHeartbeat)->bytes()[0], std::byte{44})
      << "what was written since is not from the cache";
}

}  // namespace
}  // namespace linegate::plant
