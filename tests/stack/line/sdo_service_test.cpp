// SPDX-License-Identifier: Apache-2.0
#include "stack/line/sdo_service.h"

#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/sdo/protocol.h"

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

constexpr std::uint64_t kUploadResponse = 0x43;
constexpr std::uint64_t kDownloadResponse = 0x60;

// The test plays node 5.
struct SdoServiceTest : testing::Test, ScanCache {
  const std::vector<std::byte>* cached(std::uint8_t node, od::Address address) const override {
    return node == kAxis && address == kType && !known.empty() ? &known : nullptr;
  }
  void forget_cached(std::uint8_t /*node*/, od::Address /*address*/) override { known.clear(); }

  void execute(CommandKind kind, std::uint8_t node, std::uint16_t code = 0, Duration timeout = {},
               std::uint16_t network = 0) {
    const bool read = kind == CommandKind::sdo_read || kind == CommandKind::network_read;
    service.execute(
        {.tag = ++tag,
         .kind = kind,
         .node = node,
         .network = network,
         .index = kType.index,
         .code = code,
         .timeout = timeout,
         .data = read ? std::vector<std::byte>() : std::vector<std::byte>(4, std::byte{1})},
        now);
  }
  // To the request, which is handed out before.
  void respond(std::uint64_t command, std::uint32_t value = 0) {
    for (can::Frame request; parts.node->next_frame(request, now);) {
    }
    can::Frame response{.id = can::kSdoResponseBase + kAxis, .length = sdo::kFrameSize};
    response.time = now;
    store_le(response.data.data(),
             command | std::uint64_t{kType.index} << 8U | std::uint64_t{value} << 32U);
    arbiter.receive({.service = can::Service::sdo_client, .index = kAxis}, response);
    arbiter.deliver_completions(now);
  }

  NodeParts parts{config_with_axis()};
  Instant now = parts.now;
  sdo::Arbiter arbiter{parts.node->dispatch(), parts.node->transmit(), parts.events};
  routing::MessageQueue messages{64};
  routing::Counters counters;
  RecordingHost host;
  RoutingService routing{host,         parts.config, *parts.node, arbiter,
                         parts.events, messages,     counters};
  ServiceStub local{host};
  diagnosis::ControlSettings settings;
  std::vector<std::byte> known;  // what a scan read
  SdoService service{host,
                     parts.config,
                     {.sdo = arbiter,
                      .node = *parts.node,
                      .image = parts.image,
                      .routing = routing,
                      .cache = *this,
                      .local = local,
                      .settings = settings}};
  std::uint64_t tag = 0;
};

TEST_F(SdoServiceTest, AReadIsAnsweredWithTheValue) {
  execute(CommandKind::sdo_read, kAxis);
  EXPECT_FALSE(host.answer(tag));
  respond(kUploadResponse, 0x192);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_EQ(load_le<std::uint32_t>(host.data(tag).data()), 0x192U);
}

TEST_F(SdoServiceTest, AWriteIsAnsweredAndAnObjectWriteSaysItsWay) {
  execute(CommandKind::sdo_write, kAxis);
  respond(kDownloadResponse);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_TRUE(host.data(tag).empty());
  execute(CommandKind::object_write, kAxis);
  respond(kDownloadResponse);
  EXPECT_EQ(host.data(tag), std::vector<std::byte>{std::byte{kBySdo}});
}

TEST_F(SdoServiceTest, AnAbortIsTheReply) {
  execute(CommandKind::sdo_read, kAxis);
  respond(0x80, static_cast<std::uint32_t>(AbortCode::no_object));
  EXPECT_EQ(host.answer(tag), to_error(AbortCode::no_object));
}

TEST_F(SdoServiceTest, IsRefusedWhereItMakesNoSense) {
  execute(CommandKind::sdo_read, 0);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  execute(CommandKind::network_read, kAxis, 0, {}, 99);
  EXPECT_EQ(host.answer(tag), to_error(AbortCode::invalid_value)) << "there is no route";
  host.set_usable(false);
  execute(CommandKind::sdo_read, kAxis);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::line_down));
  host.set_manages(false);
  execute(CommandKind::sdo_read, kAxis);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_role));
}

TEST_F(SdoServiceTest, TheOwnNodeIsALocalAccess) {
  execute(CommandKind::sdo_read, parts.config.node_id, kFromCache);
  execute(CommandKind::sdo_write, parts.config.node_id);
  ASSERT_EQ(local.taken.size(), 2U);
  EXPECT_EQ(local.taken[0].kind, CommandKind::local_read);
  EXPECT_EQ(local.taken[0].code, 0);
  EXPECT_EQ(local.taken[1].kind, CommandKind::local_write);
}

TEST_F(SdoServiceTest, WhatAScanReadMayBeTheAnswer) {
  known.assign(2, std::byte{7});
  execute(CommandKind::sdo_read, kAxis, kFromCache);
  EXPECT_EQ(host.data(tag), known);
  settings.use_scanned_entries = true;
  execute(CommandKind::sdo_read, kAxis);
  EXPECT_EQ(host.data(tag), known);
  execute(CommandKind::sdo_write, kAxis);
  EXPECT_TRUE(known.empty()) << "it was written";
}

TEST_F(SdoServiceTest, ACommandEndsAtItsOwnTime) {
  execute(CommandKind::sdo_read, kAxis, 0, milliseconds(100));
  execute(CommandKind::sdo_read, kAxis, 0, milliseconds(50));
  EXPECT_EQ(service.next_wake(), now + milliseconds(50));
  service.advance(now + milliseconds(50));
  EXPECT_EQ(host.answer(2), to_error(Refusal::timed_out));
  EXPECT_FALSE(host.answer(1));
  arbiter.deliver_completions(now);
  EXPECT_EQ(service.next_wake(), now + milliseconds(100));
}

TEST_F(SdoServiceTest, EndAnswersAllCommandsUnderWayOnce) {
  execute(CommandKind::sdo_read, kAxis);
  execute(CommandKind::sdo_write, kAxis);
  service.end(Refusal::cancelled, now);
  EXPECT_EQ(host.answer(1), to_error(Refusal::cancelled));
  EXPECT_EQ(host.answer(2), to_error(Refusal::cancelled));
  arbiter.deliver_completions(now);
  service.end(Refusal::cancelled, now);
}

}  // namespace
}  // namespace linegate::line
