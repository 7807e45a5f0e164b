// SPDX-License-Identifier: Apache-2.0
#include "stack/line/scan_service.h"

#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/scan/scanned_node.h"
#include "stack/sdo/protocol.h"

#include "tests/stack/line/diagnosed_parts.h"

namespace linegate::line {
namespace {

constexpr std::uint8_t kScannedNode = 9;
constexpr od::Address kScannedType{0x1000, 0};

// The test simulates the devices: each has only 1000h.
struct ScanServiceTest : testing::Test {
  std::uint64_t execute(Request request, Duration timeout = {}) {
    service.execute({.tag = ++tag, .timeout = timeout, .request = std::move(request)}, parts.now);
    return tag;
  }
  std::uint64_t execute(std::uint8_t node) { return execute(Scan{.node = node}); }

  // Answers the SDO requests in the transmit queue for the present devices; absent devices do not
  // answer.
  void answer_all() {
    can::Frame request;
    while (parts.node.transmit().pop_rest(request)) {
      const auto node = static_cast<std::uint8_t>(request.id & 0x7FU);
      if ((request.id & ~0x7FU) != can::kSdoRequestBase || !devices.contains(node)) {
        continue;
      }
      const std::uint64_t word = sdo::word_of(request);
      if (static_cast<std::uint8_t>(word) != 0x40) {
        continue;
      }
      const od::Address object = sdo::multiplexer(word);
      respond(node, object == kScannedType
                        ? 0x43 | (word & 0xFFFF'FF00) | std::uint64_t{devices.at(node)} << 32U
                        : sdo::abort_word(object, AbortCode::no_object));
    }
  }
  void respond(std::uint8_t node, std::uint64_t word) {
    can::Frame response{.id = can::kSdoResponseBase + node, .length = sdo::kFrameSize};
    response.time = parts.now;
    store_le(response.data.data(), word);
    parts.sdo.receive({.service = can::Service::sdo_client, .index = node}, response);
    parts.sdo.deliver_completions(parts.now);
  }
  // Runs until no transfer waits for a response.
  void run() {
    for (int round = 0; round < 10'000; ++round) {
      answer_all();
      if (!service.active()) {
        return;
      }
      if (parts.node.transmit().empty()) {
        parts.now = std::max(parts.now, parts.sdo.next_wake());
        parts.sdo.advance(parts.now);
        parts.sdo.deliver_completions(parts.now);
        service.advance(parts.now);
      }
    }
    FAIL() << "the scan does not end";
  }
  std::vector<std::uint8_t> reported(std::uint64_t of) const {
    const auto& report = std::get<std::vector<scan::ScannedNode>>(host.data(of));
    std::vector<std::uint8_t> nodes;
    for (const scan::ScannedNode& node : report) {
      nodes.push_back(node.id);
    }
    return nodes;
  }

  DiagnosedParts parts;
  RecordingHost& host = parts.host;
  ScanService& service = parts.scanning;
  std::map<std::uint8_t, std::uint32_t> devices;  // 1000h by node-ID
  std::uint64_t tag = 0;
};

TEST_F(ScanServiceTest, IsRefusedWhereItMakesNoSense) {
  EXPECT_EQ(host.answer(execute(parts.config.node_id)), to_error(Refusal::bad_request));
  EXPECT_EQ(host.answer(execute(128)), to_error(Refusal::bad_request));
  EXPECT_EQ(host.answer(execute(ScanApply{.node = 128})), to_error(Refusal::bad_request));
  EXPECT_EQ(host.answer(execute(ScanApply{.node = kScannedNode})), to_error(Refusal::wrong_state))
      << "node 5 is of the configuration";
  host.set_usable(false);
  EXPECT_EQ(host.answer(execute(kScannedNode)), to_error(Refusal::line_down));
  host.set_manages(false);
  EXPECT_EQ(host.answer(execute(kScannedNode)), to_error(Refusal::wrong_role));
  EXPECT_FALSE(service.active());
  EXPECT_EQ(service.next_wake(), kNever);
}

TEST_F(ScanServiceTest, ReportsTheNodesThatAnswer) {
  devices = {{3, 0x191}, {kScannedNode, 0x192}};
  const std::uint64_t of_all = execute(0);
  EXPECT_TRUE(service.scans_all());
  run();
  EXPECT_EQ(host.answer(of_all), Error{});
  EXPECT_EQ(reported(of_all), (std::vector<std::uint8_t>{3, kScannedNode}));
  EXPECT_FALSE(service.scans_all());
  devices.erase(3);
  const std::uint64_t of_one = execute(3);
  EXPECT_FALSE(service.scans_all());
  run();
  EXPECT_EQ(reported(of_one), (std::vector<std::uint8_t>{}));
}

TEST_F(ScanServiceTest, KeepsWhatItRead) {
  devices = {{kScannedNode, 0x192}};
  EXPECT_EQ(service.cached(kScannedNode, kScannedType), nullptr);
  EXPECT_TRUE(service.begin(kScannedNode, parts.now));
  EXPECT_FALSE(service.begin(kScannedNode, parts.now));
  run();
  const auto* const value = service.cached(kScannedNode, kScannedType);
  ASSERT_NE(value, nullptr);
  EXPECT_EQ(load_le<std::uint32_t>(value->data()), 0x192U);
  service.forget_cached(kScannedNode, kScannedType);
  EXPECT_EQ(service.cached(kScannedNode, kScannedType), nullptr);
}

TEST_F(ScanServiceTest, OneScanAtATime) {
  const std::uint64_t first = execute(kScannedNode);
  EXPECT_EQ(host.answer(execute(0)), to_error(Refusal::busy));
  run();
  EXPECT_EQ(host.answer(first), Error{});
}

TEST_F(ScanServiceTest, ACommandEndsAtItsOwnTime) {
  const std::uint64_t of_all = execute(Scan{}, milliseconds(5));
  EXPECT_EQ(service.next_wake(), parts.now + milliseconds(5));
  service.advance(parts.now + milliseconds(5) - Duration(1));
  EXPECT_FALSE(host.answer(of_all));
  service.advance(parts.now + milliseconds(5));
  EXPECT_EQ(host.answer(of_all), to_error(Refusal::timed_out));
  EXPECT_EQ(service.next_wake(), kNever);
}

TEST_F(ScanServiceTest, EndAnswersOnce) {
  const std::uint64_t of_all = execute(0);
  service.end(Refusal::cancelled, parts.now);
  EXPECT_EQ(host.answer(of_all), to_error(Refusal::cancelled));
  service.end(Refusal::cancelled, parts.now);
  parts.sdo.deliver_completions(parts.now);
  EXPECT_FALSE(service.active());
}

}  // namespace
}  // namespace linegate::line
