// SPDX-License-Identifier: Apache-2.0
#include "stack/line/mpdo_service.h"

#include <vector>

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

constexpr std::uint16_t kOwnIndex = 0x2100;

OwnObject mpdo_object(std::uint8_t sub, od::Access access, bool in_image) {
  OwnObject out{.index = kOwnIndex, .variable = {}};
  out.variable.sub = sub;
  out.variable.type = od::DataType::unsigned32;
  out.variable.access = access;
  out.variable.mappable = true;
  out.variable.value.resize(4);
  out.in_image = in_image;
  return out;
}

pdo::Parameters mpdo_record(std::uint16_t number, std::uint32_t id, pdo::MpdoMode mode) {
  pdo::Parameters out;
  out.number = number;
  out.cob_id = {id | can::CobId::kNoRtrBit};
  out.mpdo = mode;
  return out;
}

// TPDO 100 is an MPDO in destination address mode, TPDO 101 in source address mode; it sends
// 2100h:02h of the outputs.
LineConfig mpdo_config() {
  LineConfig config = config_with_axis();
  config.own_objects = {mpdo_object(1, od::Access::rw, false),
                        mpdo_object(2, od::Access::ro, true)};
  config.forwarding.tpdos = {mpdo_record(100, 0x1F0, pdo::MpdoMode::destination),
                             mpdo_record(101, 0x1F1, pdo::MpdoMode::source)};
  config.forwarding.tpdos[0].mapping = {{{kOwnIndex, 1}, 32}};
  config.mpdo_scanner = {0x01'2100'02};
  return config;
}

struct MpdoServiceTest : testing::Test {
  void execute(std::vector<std::byte> data, std::uint16_t number = 0) {
    service.execute(
        {.tag = ++tag,
         .request =
             MpdoWrite{.node = 5, .address = {0x6000, 1}, .data = std::move(data), .tpdo = number}},
        parts.now);
  }
  // The next frame of these two TPDOs; empty if none is sent.
  std::string sent() {
    for (can::Frame frame; parts.node->next_frame(frame, parts.now);) {
      if (frame.id == 0x1F0 || frame.id == 0x1F1) {
        return text(frame);
      }
    }
    return {};
  }

  NodeParts parts{mpdo_config()};
  RecordingHost host;
  ManagerParts managed{false};
  NoFlyingMaster flying{host, parts, managed.manager};
  MpdoService service{host, *parts.node, parts.own_objects, parts.config, flying.service};
  std::uint64_t tag = 0;
};

TEST_F(MpdoServiceTest, AValueIsSentToTheObjectOfTheNode) {
  execute({std::byte{0x34}, std::byte{0x12}});
  EXPECT_EQ(sent(), "1F0#8500600134120000");
  EXPECT_FALSE(host.answer(tag));
  host.acknowledge();
  EXPECT_EQ(host.data(tag), ReplyData{SentByMpdo{100}});
}

TEST_F(MpdoServiceTest, IsRefusedWhereItMakesNoSense) {
  execute({});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  execute(std::vector<std::byte>(5));
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  execute({std::byte{1}}, 101);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::unknown_entry)) << "it has source address mode";
  parts.node->command(nmt::Command::enter_pre_operational, parts.now);
  execute({std::byte{1}});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
}

TEST_F(MpdoServiceTest, WhatWaitsIsRefusedWhenTheOwnNodeLeavesOperational) {
  execute({std::byte{1}});
  service.advance(parts.now);
  EXPECT_FALSE(host.answer(tag));
  parts.node->command(nmt::Command::stop, parts.now);
  service.advance(parts.now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
}

TEST_F(MpdoServiceTest, WithoutAnAcknowledgementItSaysWhatTheFrameWaitsFor) {
  execute({std::byte{1}});
  execute({std::byte{2}});
  host.sendings()[0].frames[0].number = 1;
  host.expire(service, parts.now);
  EXPECT_EQ(host.answer(1), to_error(Refusal::no_acknowledge));
  EXPECT_EQ(host.answer(2), to_error(Refusal::awaits_turn));
}

}  // namespace
}  // namespace linegate::line
