// SPDX-License-Identifier: Apache-2.0
#include "stack/line/nmt_service.h"

#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/od/objects.h"

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

struct NmtServiceTest : testing::Test, NmtHost {
  void nmt_sent(nmt::Command command, std::uint8_t node, Instant /*now*/) override {
    noted.emplace_back(command, node);
  }
  bool has_failed() const override { return failed; }

  void execute(nmt::Command command, std::uint8_t node) {
    service.execute({.tag = ++tag, .request = NmtRequest{.node = node, .command = command}}, now);
  }
  std::string next_frame() {
    can::Frame frame;
    return transmit.pop(frame) ? text(frame) : "";
  }

  using Noted = std::vector<std::pair<nmt::Command, std::uint8_t>>;

  bool failed = false;
  Noted noted;
  NodeParts parts{config_with_axis()};
  ManagerParts managed;
  Instant now = parts.now;
  can::TransmitQueue transmit;
  nmt::Master master{transmit, &parts.node->dictionary()};
  RecordingHost host;
  NmtService service{host, *this, master, *parts.node, managed.manager, kOwnNode};
  std::uint64_t tag = 0;
};

TEST_F(NmtServiceTest, ACommandToANodeIsAnsweredWhenItsFrameIsAcknowledged) {
  execute(nmt::Command::stop, 5);
  EXPECT_EQ(next_frame(), "000#0205");
  EXPECT_EQ(noted, (Noted{{nmt::Command::stop, 5}}));
  EXPECT_FALSE(host.answer(tag));
  host.acknowledge();
  EXPECT_EQ(host.answer(tag), Error{});
}

TEST_F(NmtServiceTest, TheOwnNodeObeysAtOnceAndNothingIsSent) {
  execute(nmt::Command::enter_pre_operational, kOwnNode);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_EQ(parts.node->state(), nmt::State::pre_operational);
  EXPECT_EQ(next_frame(), "");
  EXPECT_TRUE(noted.empty());
}

TEST_F(NmtServiceTest, IsRefusedWhereItMakesNoSense) {
  execute(nmt::Command::start, 128);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  execute(static_cast<nmt::Command>(3), 5);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  host.set_manages(false);
  execute(nmt::Command::start, 5);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_role));
  EXPECT_FALSE(service.send_to_others(nmt::Command::start, 5, now));
  EXPECT_EQ(next_frame(), "");
}

TEST_F(NmtServiceTest, AfterAFatalErrorAResetOfAllStartsTheNetworkAnew) {
  managed.manager.halt(now);
  failed = true;
  execute(nmt::Command::reset_node, 0);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_EQ(parts.node->counters().resets, 1U);
  EXPECT_TRUE(managed.manager.active());
  EXPECT_EQ(next_frame(), "") << "the manager resets the nodes";
}

TEST_F(NmtServiceTest, WithoutAnAcknowledgementItSaysWhetherTheInhibitTimeRuns) {
  parts.node->dictionary().set({od::objects::kNmtInhibitTime, 0}, std::uint16_t{10'000});  // 1 s
  execute(nmt::Command::stop, 5);
  execute(nmt::Command::start, 5);
  host.sendings()[0].frames[0].number = 1;
  host.expire(service, now);
  EXPECT_EQ(host.answer(1), to_error(Refusal::no_acknowledge));
  EXPECT_EQ(host.answer(2), to_error(Refusal::awaits_turn));
}

TEST_F(NmtServiceTest, ALineThatIsNoMasterAnyMoreRefusesThoseThatWait) {
  execute(nmt::Command::stop, 5);
  service.end(Refusal::wrong_role, now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_role));
}

}  // namespace
}  // namespace linegate::line
