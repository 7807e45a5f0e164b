// SPDX-License-Identifier: Apache-2.0
// PDO forwarding: the objects B000h.. of several lines, and the values that are forwarded between
// them.
#include "stack/routing/forward.h"

#include <array>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/eds/reader.h"
#include "stack/line/following.h"
#include "stack/line/line.h"
#include "stack/od/dictionary.h"

#include "tests/bench/allocations.h"
#include "tests/stack/line/device_file.h"

namespace linegate::routing {
namespace {

using namespace std::chrono_literals;
using Data = std::vector<unsigned>;

constexpr od::Address kFirst{0xB100, 1};   // UNSIGNED16
constexpr od::Address kSecond{0xB100, 2};  // UNSIGNED16
constexpr od::Address kByte{0xB040, 1};    // UNSIGNED8

TEST(ForwardObject, IsArrangedAsNetworkVariablesAre) {
  using od::DataType;
  EXPECT_EQ(forward_address(DataType::integer8, 8, 0), (od::Address{0xB000, 1}));
  EXPECT_EQ(forward_address(DataType::boolean, 1, 3), (od::Address{0xB080, 4}));
  EXPECT_EQ(forward_address(DataType::unsigned16, 16, 253), (od::Address{0xB100, 254}));
  EXPECT_EQ(forward_address(DataType::unsigned16, 16, 254), (od::Address{0xB101, 1}));
  EXPECT_EQ(forward_address(DataType::real32, 32, 0), (od::Address{0xB240, 1}));
  EXPECT_EQ(forward_address(DataType::unsigned64, 64, 0), (od::Address{0xB440, 1}));
  EXPECT_EQ(forward_address(DataType::unsigned16, 16, 64U * 254U), std::nullopt);
  EXPECT_EQ(shown_address({0xB000, 1}), (od::Address{0xB480, 1}));
  EXPECT_EQ(shown_address({0xB440, 7}), (od::Address{0xB8C0, 7}));
  EXPECT_EQ(forward_type({0xB100, 9}), DataType::unsigned16);
  EXPECT_EQ(forward_type({0xB100, 255}), std::nullopt);
  EXPECT_EQ(forward_type({0xB480, 1}), std::nullopt) << "the second half has the same values";
  EXPECT_EQ(forward_type({0xA100, 1}), std::nullopt);
  EXPECT_EQ(forward_type({0xB900, 1}), std::nullopt);
}

pdo::Parameters pdo_of(std::uint16_t number, std::uint32_t cob_id, std::vector<od::Address> objects,
                       std::uint8_t type = pdo::kEventProfile) {
  pdo::Parameters out{.number = number, .cob_id = {cob_id}, .type = type};
  for (const od::Address object : objects) {
    const auto bits = object.index == kByte.index ? 8 : 16;
    out.mapping.push_back({object, static_cast<std::uint8_t>(bits)});
  }
  return out;
}

// Lines that only have an own node, which is a slave of another master, and all forwarding paths
// between them.
class ForwardingLinesTest : public testing::Test {
 protected:
  static constexpr std::size_t kLines = 3;

  line::LineConfig& config(std::size_t line) { return configs_[line]; }

  ForwardingLinesTest() {
    for (std::size_t i = 0; i < kLines; ++i) {
      configs_[i].name = "line" + std::to_string(i);
      configs_[i].role = line::Role::device;
      configs_[i].forwarding.objects = {
          {kFirst, "first", {}}, {kSecond, "second", {}}, {kByte, "byte", {}}};
    }
  }

  void make() {
    for (std::size_t i = 0; i < kLines; ++i) {
      auto made = line::Line::make(configs_[i]);
      ASSERT_TRUE(made.ok()) << to_string(made.diagnostics.front());
      lines_.push_back(*std::move(made.value));
      lines_[i]->start(now_);
      hear(i, 0x000, {0x01, 0x00});
      (void)sent(i);
    }
    std::vector<line::Following> all;
    for (std::uint32_t object = 0; object < 3; ++object) {
      all.push_back({.input = {0, configs_[0].forwarding.objects[object].address},
                     .output_entry = line::Line::kForwarded | object,
                     .forwarded = true});
    }
    for (std::size_t from = 0; from < kLines; ++from) {
      sources_.emplace_back(all);
      for (std::size_t to = 0; to < kLines; ++to) {
        targets_[from].emplace_back(all);
      }
    }
  }

  void hear(std::size_t line, std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    now_ += 1us;
    can::Frame frame = can::make_frame(id, data);
    frame.time = now_;
    lines_[line]->receive({&frame, 1}, now_);
  }
  // Hands the received values over to all other lines.
  void hand_over() {
    for (std::size_t from = 0; from < kLines; ++from) {
      if (!sources_[from].look(*lines_[from])) {
        continue;
      }
      for (std::size_t to = 0; to < kLines; ++to) {
        if (to != from) {
          (void)targets_[from][to].take(*lines_[to], sources_[from].values(), now_);
        }
      }
    }
  }
  struct Sent {
    std::uint32_t id = 0;
    Data data;
    bool operator==(const Sent&) const = default;
  };
  std::vector<Sent> sent(std::size_t line) {
    std::vector<Sent> out;
    for (can::Frame frame; lines_[line]->next_frame(frame, now_);) {
      Sent& one = out.emplace_back(Sent{frame.id, {}});
      for (std::size_t i = 0; i < frame.length; ++i) {
        one.data.push_back(std::to_integer<unsigned>(frame.data[i]));
      }
    }
    return out;
  }
  od::Dictionary& dictionary(std::size_t line) { return lines_[line]->dictionary(); }
  void write(std::size_t line, od::Address address, std::uint32_t value, std::size_t size) {
    std::array<std::byte, 4> data{};
    store_le(std::span(data), std::uint64_t{value});
    ASSERT_EQ(dictionary(line).write(address, std::span(data).first(size)), AbortCode::none)
        << std::hex << address.index << ':' << int{address.sub};
  }
  // In the order that CiA 301 requires.
  void remap(std::size_t line, pdo::PdoKind kind, std::uint32_t cob_id,
             std::initializer_list<od::Address> objects) {
    const std::uint16_t record = pdo::communication_base(kind);
    const std::uint16_t mapping = pdo::mapping_base(kind);
    write(line, {record, 1}, cob_id | can::CobId::kInvalidBit, 4);
    write(line, {mapping, 0}, 0, 1);
    std::uint8_t sub = 0;
    for (const pdo::Mapping& mapped : pdo_of(1, cob_id, objects).mapping) {
      write(line, {mapping, ++sub}, mapped.raw(), 4);
    }
    write(line, {mapping, 0}, sub, 1);
    write(line, {record, 1}, cob_id, 4);
  }

  Instant now_{10s};
  std::array<line::LineConfig, kLines> configs_;
  std::vector<std::unique_ptr<line::Line>> lines_;
  std::vector<line::FollowedInputs> sources_;
  std::array<std::vector<line::FollowingOutputs>, kLines> targets_;
};

TEST_F(ForwardingLinesTest, WhatAnRpdoAndATpdoOfOtherLinesMapIsForwarded) {
  config(0).forwarding.rpdos = {pdo_of(1, 0x181, {kFirst, kSecond, kByte})};
  config(1).forwarding.tpdos = {pdo_of(1, 0x191, {kByte, kSecond})};
  config(2).forwarding.tpdos = {pdo_of(1, 0x1A1, {kFirst})};
  make();
  hear(0, 0x181, {0x11, 0x12, 0x21, 0x22, 0x31});
  hand_over();
  EXPECT_EQ(sent(0), std::vector<Sent>{});
  EXPECT_EQ(sent(1), (std::vector<Sent>{{0x191, {0x31, 0x21, 0x22}}}));
  EXPECT_EQ(sent(2), (std::vector<Sent>{{0x1A1, {0x11, 0x12}}}));
  hand_over();
  EXPECT_EQ(sent(1), std::vector<Sent>{});
  hear(0, 0x181, {0x11, 0x12, 0x21, 0x22, 0x31});
  hand_over();
  EXPECT_EQ(sent(1).size(), 1U) << "the same values once more are an event, too";
}

TEST_F(ForwardingLinesTest, EveryLineThatMapsAnObjectShowsItsValue) {
  config(0).forwarding.rpdos = {pdo_of(1, 0x181, {kFirst})};
  config(1).forwarding.tpdos = {pdo_of(1, 0x191, {shown_address(kFirst)})};
  make();
  hear(0, 0x181, {0x34, 0x12});
  hand_over();
  EXPECT_EQ(sent(1), (std::vector<Sent>{{0x191, {0x34, 0x12}}}));
  for (const std::size_t line : {0U, 1U, 2U}) {
    EXPECT_EQ(dictionary(line).number(kFirst), 0x1234U);
    EXPECT_EQ(dictionary(line).number(shown_address(kFirst)), 0x1234U);
  }
  EXPECT_EQ(dictionary(1).check(shown_address(kFirst), std::array<std::byte, 2>{}),
            AbortCode::read_only);
}

TEST_F(ForwardingLinesTest, OneReceivedPdoFeedsOnePdoOfAnotherLine) {
  config(0).forwarding.rpdos = {pdo_of(1, 0x181, {kFirst, kSecond})};
  config(1).forwarding.tpdos = {pdo_of(1, 0x191, {kSecond}), pdo_of(2, 0x291, {kFirst})};
  config(2).forwarding.tpdos = {pdo_of(1, 0x191, {kSecond}), pdo_of(2, 0x291, {kFirst})};
  config(2).forwarding.feeds_every_tpdo = true;
  make();
  hear(0, 0x181, {1, 0, 2, 0});
  hand_over();
  EXPECT_EQ(sent(1), (std::vector<Sent>{{0x191, {2, 0}}}));
  EXPECT_EQ(sent(2), (std::vector<Sent>{{0x191, {2, 0}}, {0x291, {1, 0}}}));
}

TEST_F(ForwardingLinesTest, TheListFollowsEveryChangeOfTheMapping) {
  config(0).forwarding.rpdos = {pdo_of(1, 0x181, {kFirst})};
  config(1).forwarding.tpdos = {pdo_of(1, 0x191, {kFirst})};
  make();
  hear(0, 0x181, {1, 0});
  hand_over();
  EXPECT_EQ(sent(1), (std::vector<Sent>{{0x191, {1, 0}}}));
  remap(0, pdo::PdoKind::rpdo, 0x181, {kSecond});
  hand_over();
  hear(0, 0x181, {2, 0});
  hand_over();
  EXPECT_EQ(sent(1), std::vector<Sent>{}) << "the mapped object has no source";
  remap(1, pdo::PdoKind::tpdo, 0x192, {kSecond, kFirst});
  (void)sent(1);
  hear(0, 0x181, {3, 0});
  hand_over();
  EXPECT_EQ(sent(1), (std::vector<Sent>{{0x192, {3, 0, 1, 0}}}));
  write(0, {0x1400, 1}, 0x181U | can::CobId::kInvalidBit, 4);
  hear(0, 0x181, {4, 0});
  hand_over();
  EXPECT_EQ(sent(1), std::vector<Sent>{});
}

TEST_F(ForwardingLinesTest, TypesInhibitTimesAndSyncsOfEachSideAreKept) {
  config(0).forwarding.rpdos = {pdo_of(1, 0x181, {kFirst}, 1)};
  config(1).forwarding.tpdos = {pdo_of(1, 0x191, {kFirst}, 2)};
  config(2).forwarding.tpdos = {pdo_of(1, 0x1A1, {kFirst})};
  config(2).forwarding.tpdos[0].inhibit = 10ms;
  make();
  now_ += 20ms;  // the inhibit times of the first frames have passed
  hear(0, 0x181, {1, 0});
  hand_over();
  EXPECT_EQ(sent(2), std::vector<Sent>{}) << "before the SYNC of the source";
  hear(0, 0x080, {});
  hand_over();
  EXPECT_EQ(sent(2), (std::vector<Sent>{{0x1A1, {1, 0}}}));
  EXPECT_EQ(sent(1), std::vector<Sent>{});
  hear(1, 0x080, {});
  EXPECT_EQ(sent(1), std::vector<Sent>{});
  hear(1, 0x080, {});
  EXPECT_EQ(sent(1), (std::vector<Sent>{{0x191, {1, 0}}})) << "with every second SYNC";
  hear(0, 0x181, {2, 0});
  hear(0, 0x080, {});
  hand_over();
  EXPECT_EQ(sent(2), std::vector<Sent>{});
  now_ += 11ms;
  lines_[2]->advance(now_);
  EXPECT_EQ(sent(2), (std::vector<Sent>{{0x1A1, {2, 0}}}));
}

// PDOs are bridged from one network to the next one only.
TEST_F(ForwardingLinesTest, WhatWasForwardedIsNotForwardedAgain) {
  config(0).forwarding.rpdos = {pdo_of(1, 0x181, {kFirst})};
  for (const std::size_t line : {1U, 2U}) {
    config(line).forwarding.rpdos = {pdo_of(1, 0x181, {kFirst})};
    config(line).forwarding.tpdos = {pdo_of(1, 0x191, {kFirst})};
  }
  make();
  hear(0, 0x181, {1, 0});
  for (int round = 0; round < 5; ++round) {
    hand_over();
  }
  EXPECT_EQ(sent(1).size(), 1U);
  EXPECT_EQ(sent(2).size(), 1U);
}

TEST_F(ForwardingLinesTest, NothingIsAllocatedOnTheWay) {
  config(0).forwarding.rpdos = {pdo_of(1, 0x181, {kFirst, kSecond})};
  config(1).forwarding.tpdos = {pdo_of(1, 0x191, {kSecond, kFirst})};
  make();
  can::Frame frame = can::make_frame(0x181, {1, 2, 3, 4});
  can::Frame out;
  std::uint64_t gone = 0;
  const auto pass = [&] {
    now_ += 1us;
    frame.time = now_;
    frame.data[0] = static_cast<std::byte>(gone);
    lines_[0]->receive({&frame, 1}, now_);
    hand_over();
    while (lines_[1]->next_frame(out, now_)) {
      ++gone;
    }
  };
  pass();
  const std::uint64_t before = bench::allocations();
  for (int i = 0; i < 1000; ++i) {
    pass();
  }
  EXPECT_EQ(bench::allocations(), before);
  EXPECT_EQ(gone, 1001U);
}

TEST_F(ForwardingLinesTest, WhatCannotBeIsTold) {
  const auto told = [&](const Forwarding& forwarding) {
    line::LineConfig wrong = config(0);
    wrong.forwarding = forwarding;
    const auto made = line::Line::make(std::move(wrong));
    return made.ok() ? "" : made.diagnostics.front().text;
  };
  EXPECT_EQ(told({.objects = {{{0xB480, 1}, "x", {}}}}),
            "\"x\" is no object B000h..B47Fh, sub-index 1..254");
  EXPECT_EQ(told({.objects = {{kFirst, "x", {}}, {kFirst, "y", {}}}}),
            "\"y\" has the object of another");
  EXPECT_EQ(told({.rpdos = {pdo_of(513, 0x181, {})}}), "RPDO 513 of the own node is not in 1..512");
  EXPECT_EQ(told({.tpdos = {pdo_of(3, 0x181, {}), pdo_of(3, 0x182, {})}}),
            "TPDO 3 of the own node is there twice");
}

// An entry of the image as an object B000h..: the two ends of a forwarding rule in plant.yaml.
TEST(ForwardedEntry, IsAnObjectOfTheDictionaryAndOfTheMappingRecord) {
  line::LineConfig config;
  config.name = "press";
  config.role = line::Role::device;
  line::NodeConfig node{.id = 5, .name = "axis"};
  node.device = *eds::load(line::kDeviceFile, "axis.eds", 5).value;
  config.nodes.push_back(std::move(node));
  config.forwarding.objects = {
      {kFirst, "status", ForwardedObject::Entry{image::Direction::inputs, 0}},
      {{0xB1C0, 1}, "setpoint", ForwardedObject::Entry{image::Direction::outputs, 0}}};
  auto made = line::Line::make(config);
  ASSERT_TRUE(made.ok());
  line::Line& line = **made.value;
  Instant now{10s};
  line.start(now);
  const auto hear = [&](std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    can::Frame frame = can::make_frame(id, data);
    frame.time = now;
    line.receive({&frame, 1}, now);
  };
  hear(0x000, {0x01, 0x00});
  EXPECT_EQ(line.dictionary().number({0x1600, 1}), 0xB100'0110U);
  EXPECT_EQ(line.dictionary().number({0x1A00, 1}), 0xB1C0'0120U);
  // The mapping of a static PDO cannot be changed at run time.
  for (const std::uint16_t record : std::array<std::uint16_t, 2>{0x1600, 0x1A00}) {
    EXPECT_EQ(line.dictionary().check({record, 0}, std::array{std::byte{0}}), AbortCode::read_only);
    EXPECT_EQ(line.dictionary().check({record, 1}, std::array<std::byte, 4>{}),
              AbortCode::read_only);
  }
  hear(0x185, {0x34, 0x12, 1, 0, 0, 0});
  EXPECT_EQ(line.dictionary().number(kFirst), 0x1234U);
  EXPECT_EQ(line.dictionary().number(shown_address(kFirst)), 0x1234U);
  line.write_bound(std::vector<line::BoundValue>{{.entry = 0, .value = 77, .always = true}}, now);
  EXPECT_EQ(line.dictionary().number({0xB1C0, 1}), 77U);
  EXPECT_EQ(line.dictionary().check({0xB1C0, 1}, std::array<std::byte, 4>{}), AbortCode::read_only);
  // Reset node: the objects keep the values of the devices and of the writers
  hear(0x000, {0x81, 0x00});
  EXPECT_EQ(line.input(0).value, 0x1234U);
  EXPECT_EQ(line.dictionary().number(kFirst), 0x1234U);
  EXPECT_EQ(line.dictionary().number({0xB1C0, 1}), 77U);
}

}  // namespace
}  // namespace linegate::routing
