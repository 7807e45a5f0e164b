// SPDX-License-Identifier: Apache-2.0
// The indications that an application receives from the services of its node (README.md of
// stack/node, the table of the indications of the emotas stack), and the identifiers that a reset
// restores.
#include <gmock/gmock.h>

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using testing::pop_events;

// Records all indications in order.
class Hearing : public Application, public MasterServices {
 public:
  void state_changed(nmt::State state, Instant /*now*/) override {
    heard.push_back("state " + std::to_string(static_cast<int>(state)));
  }
  bool may_operate(Instant /*now*/) override {
    heard.emplace_back("may operate");
    return willing;
  }
  void receive(const can::Target& /*target*/, const can::Frame& /*frame*/) override {}
  void synced(Instant now) override {
    const std::uint64_t output = node->dictionary().number({0x2000, 2}).value_or(0);
    can::Frame frame;
    const bool sampled = node->next_frame(frame, now) && frame.id == 0x185;
    heard.push_back("synced, 2000h:2 = " + std::to_string(output) +
                    (sampled ? ", 185h is to be sent" : ""));
  }

  std::vector<std::string> heard;
  bool willing = true;
  Node* node = nullptr;
};

class IndicationsTest : public NodeTest {
 protected:
  IndicationsTest() {
    hearing_.node = node.get();
    node->set_application(&hearing_);
    node->set_master_services(&hearing_);
  }

  // Event own-state: the new state and the previous one.
  std::vector<std::pair<nmt::State, nmt::State>> own_states() {
    std::vector<std::pair<nmt::State, nmt::State>> out;
    for (const Event& event : pop_events(events)) {
      if (const auto* const own = event.get<event::OwnState>()) {
        out.emplace_back(own->state, own->before);
      }
    }
    return out;
  }

  Hearing hearing_;
};

TEST_F(IndicationsTest, NmtAsksMayOperateFirstAndThenIsHeardAsStateAndOwnState) {
  boot();
  hearing_.heard.clear();
  hearing_.willing = false;
  nmt(0x01);
  EXPECT_THAT(hearing_.heard, ::testing::ElementsAre("may operate"));
  EXPECT_TRUE(own_states().empty());
  hearing_.willing = true;
  nmt(0x01);
  nmt(0x02);
  EXPECT_THAT(hearing_.heard, ::testing::ElementsAre("may operate", "may operate", "state 5",
                                                     "state 5", "state 4", "state 4"))
      << "as Application, then as MasterServices";
  EXPECT_THAT(own_states(), ::testing::ElementsAre(
                                std::pair{nmt::State::operational, nmt::State::pre_operational},
                                std::pair{nmt::State::stopped, nmt::State::operational}));
}

TEST_F(IndicationsTest, SyncFinishedComesAfterRpdosWereCommittedAndTpdosSampled) {
  boot_and_start();
  hearing_.heard.clear();
  hear(1ms, 0x305, {0x34, 0x12});
  EXPECT_EQ(number(0x2000, 2), 0x2222U) << "type 1 waits for the SYNC";
  hear(2ms, 0x080, {});
  EXPECT_THAT(hearing_.heard, ::testing::ElementsAre("synced, 2000h:2 = 4660, 185h is to be sent"));
}

TEST_F(IndicationsTest, SyncLostIsAnEvent) {
  boot();
  ASSERT_EQ(sdo_write({0x1006, 0}, 4, 10'000), 0U);
  nmt(0x01);
  hear(0ms, 0x080, {});
  pop_events(events);
  advance(14ms);
  EXPECT_THAT(kinds(), ::testing::Not(::testing::Contains(EventKind::sync_lost)));
  advance(15ms);
  EXPECT_THAT(kinds(), ::testing::Contains(EventKind::sync_lost));
}

// USDO (CiA 1301) uses CAN FD frames.
TEST_F(IndicationsTest, AFrameOfCanFdIsNoSdo) {
  boot();
  can::Frame frame = frame_at(at(1ms), 0x605, {0x40, 0x00, 0x20, 0x01, 0, 0, 0, 0});
  frame.flags |= can::Frame::kFd;
  node->receive({&frame, 1});
  EXPECT_TRUE(drain(at(1ms)).empty());
  EXPECT_EQ(node->counters().malformed, 1U);
}

// SLEEP (CiA 320) uses 690h and 691h.
TEST_F(IndicationsTest, SleepIsNobodys) {
  boot_and_start();
  hearing_.heard.clear();
  const std::uint64_t unused = node->counters().unused;
  hear(1ms, 0x690, {0x01});
  hear(1ms, 0x691, {0x02});
  EXPECT_EQ(node->counters().unused, unused + 2);
  EXPECT_EQ(node->state(), nmt::State::operational);
  EXPECT_TRUE(drain(at(1ms)).empty());
  EXPECT_TRUE(pop_events(events).empty());
  EXPECT_TRUE(hearing_.heard.empty());
}

TEST_F(IndicationsTest, ResetCommunicationBringsTheIdentifiersBack) {
  boot();
  ASSERT_EQ(sdo_write({0x1400, 1}, 4, 0x8000'0205), 0U);
  ASSERT_EQ(sdo_write({0x1400, 1}, 4, 0x0000'0345), 0U);
  ASSERT_EQ(sdo_write({0x1801, 1}, 4, 0x8000'0285), 0U);
  ASSERT_EQ(sdo_write({0x1801, 1}, 4, 0x0000'0346), 0U);
  ASSERT_EQ(sdo_write({0x1014, 0}, 4, 0x8000'0085), 0U);
  ASSERT_EQ(sdo_write({0x1014, 0}, 4, 0x0000'0347), 0U);
  nmt(0x82, kNodeId, 1ms);
  EXPECT_EQ(drain(at(1ms)), (std::vector<Sent>{{at(1ms), 0x705, {0x00}}})) << "the boot-up message";
  EXPECT_EQ(number(0x1400, 1), 0x205U);
  EXPECT_EQ(number(0x1801, 1), 0x285U);
  EXPECT_EQ(number(0x1014, 0), 0x85U);
  nmt(0x01, kNodeId, 2ms);
  drain(at(2ms));
  hear(3ms, 0x345, {0x01, 0x00});
  EXPECT_EQ(number(0x2000, 1), 0x1111U);
  hear(3ms, 0x205, {0x01, 0x00});
  EXPECT_EQ(number(0x2000, 1), 1U);
  node->set_error(0x5000, {}, at(4ms));
  const auto sent = drain(at(4ms));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].id, 0x85U);
}

}  // namespace
}  // namespace linegate::node
