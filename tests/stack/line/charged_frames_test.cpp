// SPDX-License-Identifier: Apache-2.0
// Invariant: each frame of a procedure that a command started counts once, for the client of that
// command, and none after the end of the procedure.
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/scan/scanned_node.h"

#include "tests/stack/line/counted_pace.h"
#include "tests/stack/line/line_fixture.h"
#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

using testing::Contains;
using Counted = std::map<std::uint32_t, int>;

constexpr std::uint32_t kBooting = 7;
constexpr std::uint32_t kScanning = 8;
constexpr const char* kResetNode = "000#8105";
constexpr const char* kResetCommunication = "000#8205";

class ChargedFrames : protected WithPace, public LineTest {
 protected:
  void SetUp() override {
    LineConfig config = config_without_error_control();
    config.scanned.push_back({.id = 5});  // so that a scan may be applied
    make(std::move(config));
    line_->set_pace(pace_);
    pace_.left = 1'000'000;
    boot();
    ASSERT_TRUE(pace_.counted.empty()) << "the line boots the node on its own";
  }
  void execute(std::uint32_t client, Request request, Duration timeout = {}) {
    line_->execute(
        {.tag = ++tag_, .timeout = timeout, .client = client, .request = std::move(request)}, now_);
  }
  void confirm_restored() { hear(0x585, {0x60, 0x11, 0x10, 0x01, 0, 0, 0, 0}); }
  void answer_device_type() { hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00}); }
  // The scan has reset the node, and waits for its boot-up message. 5 frames.
  void scan_until_reset(Duration timeout = {}) {
    execute(kScanning, ScanApply{.node = 5, .restore = true}, timeout);
    pass(milliseconds(1));
    answer_device_type();
    confirm_restored();
    ASSERT_THAT(sent(), Contains(kResetNode));
  }

  std::uint64_t tag_ = 0;
};

TEST_F(ChargedFrames, AScanCountsItsOwn) {
  scan_until_reset();
  EXPECT_EQ(pace_.counted, (Counted{{kScanning, 5}}));
  hear(0x705, {0x00});
  EXPECT_EQ(pace_.counted, (Counted{{kScanning, 7}})) << "the message, and the next request";
  hear(0x705, {0x00});
  EXPECT_EQ(pace_.counted, (Counted{{kScanning, 7}})) << "the node restarted by itself";
}

// The boot process ends when the scan begins.
TEST_F(ChargedFrames, AScanAfterABootDoesNotCountForTheBoot) {
  execute(kBooting, Boot{.node = 5});
  ASSERT_THAT(sent(), Contains(kResetCommunication));
  EXPECT_EQ(pace_.counted, (Counted{{kBooting, 1}}));
  scan_until_reset();
  hear(0x705, {0x00});
  EXPECT_EQ(pace_.counted, (Counted{{kBooting, 1}, {kScanning, 7}}));
}

TEST_F(ChargedFrames, ABootDuringAScanCountsEachFrameOnce) {
  execute(kScanning, ScanApply{.node = 5, .restore = true});
  execute(kBooting, Boot{.node = 5});
  ASSERT_THAT(sent(), Contains(kResetCommunication));
  EXPECT_EQ(pace_.counted, (Counted{{kBooting, 1}, {kScanning, 1}}));
  answer_device_type();
  confirm_restored();
  ASSERT_THAT(sent(), Contains(kResetNode));
  EXPECT_EQ(pace_.counted, (Counted{{kBooting, 1}, {kScanning, 5}}));
  hear(0x705, {0x00});
  sent();
  EXPECT_EQ(pace_.counted[kBooting] + pace_.counted[kScanning], 8)
      << "the message, and one request at a time";
}

// Else a client could have the network booted again and again, and none of it would count.
TEST_F(ChargedFrames, ABootOfTheNetworkAfterAScanThatTimedOutCounts) {
  scan_until_reset(milliseconds(100));
  const int before = pace_.counted[kScanning];
  pass(milliseconds(100));
  ASSERT_THAT(sent(), Contains("000#8200"));
  EXPECT_EQ(pace_.counted, (Counted{{kScanning, before + 1}}));
  hear(0x705, {0x00});
  EXPECT_EQ(pace_.counted, (Counted{{kScanning, before + 3}}));
}

TEST_F(ChargedFrames, ABootOfTheNetworkAfterAResetOfTheOwnNodeCounts) {
  execute(kBooting, NmtRequest{.node = kOwnNode, .command = nmt::Command::reset_node});
  pass(milliseconds(1));
  ASSERT_THAT(sent(), Contains("000#8200"));
  EXPECT_EQ(pace_.counted, (Counted{{kBooting, 1}}));
  hear(0x705, {0x00});
  EXPECT_EQ(pace_.counted, (Counted{{kBooting, 3}}));
}

// --- the client of a boot process ----------------------------------------------------------------

TEST(BootProcessOfAClient, EndsWithItsClient) {
  const std::map<std::string, std::function<void(manager::Manager&, Instant)>> ends{
      {"stop", [](auto& manager, Instant now) { manager.stop(now); }},
      {"halt", [](auto& manager, Instant now) { manager.halt(now); }},
      {"hand over", [](auto& manager, Instant now) { manager.hand_over(now); }},
      {"boot by the line", [](auto& manager, Instant now) { manager.boot(5, now); }},
      {"download",
       [](auto& manager, Instant now) {
         manager.hold(5);
         manager.release(5, now);
       }},
  };
  for (const auto& [name, end] : ends) {
    ManagerParts parts;
    parts.manager.boot(5, parts.now, kBooting);
    EXPECT_EQ(parts.manager.client_of(5), kBooting) << name;
    end(parts.manager, parts.now);
    EXPECT_EQ(parts.manager.client_of(5), 0U) << name;
  }
}

}  // namespace
}  // namespace linegate::line
