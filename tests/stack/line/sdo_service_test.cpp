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
constexpr od::Address kMapping{0x1A00, 1};

// The test simulates node 5.
struct SdoServiceTest : testing::Test, ScanCache {
  const std::vector<std::byte>* cached(std::uint8_t node, od::Address address) const override {
    return node == kAxis && address == kType && !known.empty() ? &known : nullptr;
  }
  void forget_cached(std::uint8_t /*node*/, od::Address /*address*/) override { known.clear(); }

  void execute(Request request, Duration timeout = {}) {
    service.execute({.tag = ++tag, .timeout = timeout, .request = std::move(request)}, now);
  }
  void read(std::uint8_t node, Duration timeout = {}) {
    execute(SdoRead{.node = node, .address = kType}, timeout);
  }
  void read_cached(std::uint8_t node) {
    execute(SdoRead{.node = node, .address = kType, .from_scan = true});
  }
  void write(std::uint8_t node, Duration timeout = {}) {
    execute(
        SdoWrite{.node = node, .address = kType, .data = std::vector<std::byte>(4, std::byte{1})},
        timeout);
  }
  // Answers the request after it was handed out.
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
  struct Rule final : sdo::WriteRule {
    AbortCode may_write(std::uint8_t node, od::Address address, std::span<const std::byte> value,
                        Instant /*now*/) const override {
      if (node != kAxis || address != kMapping || value.size() == 1) {
        return AbortCode::none;
      }
      return value.size() == 4 ? AbortCode::device_state : AbortCode::invalid_value;
    }
  } rule;
  ManagerParts managed{false};
  NoFlyingMaster flying{host, parts, managed.manager};
  RoutingService routing{host,     parts.config, *parts.node, arbiter,       parts.events,
                         messages, counters,     rule,        flying.service};
  ServiceStub local{host};
  diagnosis::ControlSettings settings;
  std::vector<std::byte> known;  // the values that a scan has read
  SdoService service{host,
                     parts.config,
                     {.sdo = arbiter,
                      .node = *parts.node,
                      .image = parts.image,
                      .rule = rule,
                      .routing = routing,
                      .flying = flying.service,
                      .cache = *this,
                      .local = local,
                      .settings = settings}};
  std::uint64_t tag = 0;
};

TEST_F(SdoServiceTest, AReadIsAnsweredWithTheValue) {
  read(kAxis);
  EXPECT_FALSE(host.answer(tag));
  respond(kUploadResponse, 0x192);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_EQ(load_le<std::uint32_t>(host.bytes(tag).data()), 0x192U);
}

TEST_F(SdoServiceTest, AWriteIsAnsweredAndAnObjectWriteSaysItsWay) {
  write(kAxis);
  respond(kDownloadResponse);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_EQ(host.data(tag), ReplyData{});
  execute(ObjectWrite{
      .node = kAxis, .address = kType, .data = std::vector<std::byte>(4, std::byte{1})});
  respond(kDownloadResponse);
  EXPECT_EQ(host.data(tag), ReplyData{WrittenBySdo{}});
}

// The image would not follow.
TEST_F(SdoServiceTest, AWriteThatChangesAPdoOfTheImageIsRefused) {
  const auto write_mapping = [this](std::size_t size) {
    execute(SdoWrite{.node = kAxis, .address = kMapping, .data = std::vector<std::byte>(size)});
  };
  write_mapping(4);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::image_pdo));
  execute(ObjectWrite{.node = kAxis, .address = kMapping, .data = std::vector<std::byte>(4)});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::image_pdo));
  execute(NetworkWrite{.network = parts.config.network_id,
                       .node = kAxis,
                       .address = kMapping,
                       .data = std::vector<std::byte>(4)});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::image_pdo));
  for (can::Frame frame; parts.node->next_frame(frame, now);) {
    EXPECT_NE(frame.id, can::kSdoRequestBase + kAxis) << "nothing was sent to the node";
  }
  write_mapping(2);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::identifier_in_use));
  write_mapping(1);
  EXPECT_FALSE(host.answer(tag)) << "permitted";
}

TEST_F(SdoServiceTest, AnAbortIsTheReply) {
  read(kAxis);
  respond(0x80, static_cast<std::uint32_t>(AbortCode::no_object));
  EXPECT_EQ(host.answer(tag), to_error(AbortCode::no_object));
}

TEST_F(SdoServiceTest, IsRefusedWhereItMakesNoSense) {
  read(0);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  execute(NetworkRead{.network = 99, .node = kAxis, .address = kType});
  EXPECT_EQ(host.answer(tag), to_error(AbortCode::invalid_value)) << "there is no route";
  host.set_usable(false);
  read(kAxis);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::line_down));
  host.set_manages(false);
  read(kAxis);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_role));
}

TEST_F(SdoServiceTest, TheOwnNodeIsALocalAccess) {
  read_cached(parts.config.node_id);
  write(parts.config.node_id);
  ASSERT_EQ(local.taken.size(), 2U);
  EXPECT_EQ(std::get<od::Address>(std::get<LocalRead>(local.taken[0].request).what), kType);
  EXPECT_FALSE(std::get<LocalWrite>(local.taken[1].request).as_owner);
}

TEST_F(SdoServiceTest, WhatAScanReadMayBeTheAnswer) {
  known.assign(2, std::byte{7});
  read_cached(kAxis);
  EXPECT_EQ(host.bytes(tag), known);
  settings.use_scanned_entries = true;
  read(kAxis);
  EXPECT_EQ(host.bytes(tag), known);
  write(kAxis);
  EXPECT_TRUE(known.empty()) << "it was written";
}

TEST_F(SdoServiceTest, ACommandEndsAtItsOwnTime) {
  read(kAxis, milliseconds(100));
  read(kAxis, milliseconds(50));
  EXPECT_EQ(service.next_wake(), now + milliseconds(50));
  service.advance(now + milliseconds(50));
  EXPECT_EQ(host.answer(2), to_error(Refusal::timed_out));
  EXPECT_FALSE(host.answer(1));
  arbiter.deliver_completions(now);
  EXPECT_EQ(service.next_wake(), now + milliseconds(100));
}

// Like a write that ends with the line.
TEST_F(SdoServiceTest, AWriteThatMayBeCarriedOutEndsAtItsOwnTimeAsATimeOutOfTheProtocol) {
  write(kAxis, milliseconds(50));
  write(kAxis, milliseconds(50));
  service.advance(now + milliseconds(50));
  EXPECT_EQ(host.answer(1), to_error(AbortCode::timeout));
  EXPECT_EQ(host.answer(2), to_error(Refusal::timed_out)) << "it waited";
  arbiter.deliver_completions(now);
}

TEST_F(SdoServiceTest, EndAnswersAllCommandsUnderWayOnce) {
  read(kAxis);
  write(kAxis);
  service.end(Refusal::cancelled, now);
  EXPECT_EQ(host.answer(1), to_error(Refusal::cancelled));
  EXPECT_EQ(host.answer(2), to_error(Refusal::cancelled));
  arbiter.deliver_completions(now);
  service.end(Refusal::cancelled, now);
}

// A refusal states that the command was not carried out.
TEST_F(SdoServiceTest, EndAnswersAWriteThatMayBeCarriedOutAsATimeOut) {
  write(kAxis);
  write(kAxis);
  service.end(Refusal::cancelled, now);
  EXPECT_EQ(host.answer(1), to_error(AbortCode::timeout));
  EXPECT_EQ(host.answer(2), to_error(Refusal::cancelled)) << "it waited";
  arbiter.deliver_completions(now);
  execute(SdoWrite{.node = kAxis, .address = kType, .data = std::vector<std::byte>(9)});
  service.end(Refusal::cancelled, now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::cancelled)) << "no segment was sent";
  arbiter.deliver_completions(now);
  execute(ObjectWrite{.node = kAxis, .address = kType, .data = std::vector<std::byte>(4)});
  service.end(Refusal::cancelled, now);
  EXPECT_EQ(host.answer(tag), to_error(AbortCode::timeout));
  EXPECT_EQ(host.data(tag), ReplyData{});
  arbiter.deliver_completions(now);
}

}  // namespace
}  // namespace linegate::line
