// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/slave.h"

#include <gtest/gtest.h>

#include "tests/stack/lss/slaves.h"

namespace linegate::lss {
namespace {

using namespace std::chrono_literals;
using testing::Bytes;
using testing::Subject;
using Frames = std::vector<Bytes>;

const Frames kNothing;

Frames one(Bytes bytes) {
  bytes.resize(8);
  return {bytes};
}

Bytes number(int command, std::uint32_t value) {
  Bytes out{command};
  for (int i = 0; i < 4; ++i) {
    out.push_back(static_cast<int>(value >> (8 * i)) & 0xFF);
  }
  out.resize(8);
  return out;
}

TEST(LssSlave, SwitchStateGlobal) {
  Subject subject;
  EXPECT_EQ(subject.slave.state(), SlaveState::waiting);
  EXPECT_EQ(subject.say({0x04, 1, 0, 0, 0, 0, 0, 0}), kNothing);
  EXPECT_EQ(subject.slave.state(), SlaveState::configuration);
  EXPECT_EQ(subject.say({0x04, 0, 0, 0, 0, 0, 0, 0}), kNothing);
  EXPECT_EQ(subject.slave.state(), SlaveState::waiting);
  EXPECT_TRUE(subject.well_formed);
  subject.say({0x04, 2, 0, 0, 0, 0, 0, 0});
  EXPECT_FALSE(subject.well_formed);
  EXPECT_EQ(subject.slave.state(), SlaveState::waiting);
}

TEST(LssSlave, SwitchStateSelective) {
  Subject subject;
  EXPECT_EQ(subject.say({0x40, 0x11, 0x22, 0x33, 0x44, 0, 0, 0}), kNothing);
  EXPECT_EQ(subject.say({0x41, 0x55, 0x66, 0x77, 0x88, 0, 0, 0}), kNothing);
  EXPECT_EQ(subject.say({0x42, 0x99, 0xAA, 0xBB, 0xCC, 0, 0, 0}), kNothing);
  EXPECT_EQ(subject.say({0x43, 0xED, 0xFE, 0x0F, 0x10, 0, 0, 0}), one({0x44}));
  EXPECT_EQ(subject.slave.state(), SlaveState::configuration);
  EXPECT_TRUE(subject.right_id);
}

TEST(LssSlave, IsNotSelectedByAnotherAddressOrAnotherOrder) {
  for (int wrong = 0; wrong < 4; ++wrong) {
    Subject subject;
    for (int part = 0; part < 4; ++part) {
      const std::uint32_t right = testing::kAddress[static_cast<std::size_t>(part)];
      EXPECT_EQ(subject.say(number(0x40 + part, part == wrong ? right ^ 1U : right)), kNothing);
    }
    EXPECT_EQ(subject.slave.state(), SlaveState::waiting);
  }
  Subject subject;
  for (const int part : {1, 0, 2, 3}) {
    EXPECT_EQ(subject.say(number(0x40 + part, testing::kAddress[static_cast<std::size_t>(part)])),
              kNothing);
  }
}

TEST(LssSlave, ConfigureNodeId) {
  Subject subject({.node_id = 5});
  subject.configuration();
  EXPECT_EQ(subject.say({0x11, 127, 0, 0, 0, 0, 0, 0}), one({0x11, 0, 0}));
  EXPECT_EQ(subject.slave.pending().node_id, 127);
  EXPECT_EQ(subject.slave.active_node_id(), 5);
  EXPECT_EQ(subject.slave.persistent().node_id, 5);
  EXPECT_EQ(subject.say({0x11, 0xFF, 0, 0, 0, 0, 0, 0}), one({0x11, 0, 0}));
  EXPECT_EQ(subject.slave.pending().node_id, kNoNodeId);
  for (const int wrong : {0, 128, 254}) {
    EXPECT_EQ(subject.say({0x11, wrong, 0, 0, 0, 0, 0, 0}), one({0x11, 1, 0}));
    EXPECT_EQ(subject.slave.pending().node_id, kNoNodeId);
  }
}

TEST(LssSlave, ConfigureBitTiming) {
  Subject subject;
  subject.configuration();
  EXPECT_EQ(subject.say({0x13, 0, 3, 0, 0, 0, 0, 0}), one({0x13, 0, 0}));
  EXPECT_EQ(subject.slave.pending().bit_timing, 3);
  EXPECT_EQ(subject.say({0x13, 0, 4, 0, 0, 0, 0, 0}), one({0x13, 1, 0}));
  EXPECT_EQ(subject.say({0x13, 1, 3, 0, 0, 0, 0, 0}), one({0x13, 1, 0}));
  EXPECT_EQ(subject.slave.pending().bit_timing, 3);
}

TEST(LssSlave, ActivateBitTimingIsSilentForTheDelayBeforeAndAfterTheSwitch) {
  Subject subject;
  subject.configuration();
  subject.say({0x15, 0x2C, 0x01, 0, 0, 0, 0, 0}, 1s);
  EXPECT_FALSE(subject.slave.silent()) << "no bit timing was configured";
  subject.say({0x13, 0, 2, 0, 0, 0, 0, 0});
  EXPECT_EQ(subject.say({0x15, 0x2C, 0x01, 0, 0, 0, 0, 0}, 1s), kNothing);
  EXPECT_TRUE(subject.slave.silent());
  EXPECT_EQ(subject.slave.next_wake(), Instant{1300ms});
  subject.slave.advance(Instant{1299ms});
  EXPECT_EQ(subject.host.used, -1);
  EXPECT_EQ(subject.say({0x5E, 0, 0, 0, 0, 0, 0, 0}, 1299ms), kNothing) << "it receives nothing";
  subject.slave.advance(Instant{1300ms});
  EXPECT_EQ(subject.host.used, 2);
  EXPECT_EQ(subject.host.used_at, Instant{1300ms});
  EXPECT_TRUE(subject.slave.silent());
  subject.slave.advance(Instant{1600ms});
  EXPECT_FALSE(subject.slave.silent());
  EXPECT_EQ(subject.slave.next_wake(), kNever);
  EXPECT_EQ(subject.say({0x5E, 0, 0, 0, 0, 0, 0, 0}, 1700ms).size(), 1U);
}

TEST(LssSlave, AResetWhileItWaitsForTheSwitchDoesNotChangeTheBitTiming) {
  Subject subject;
  subject.configuration();
  subject.say({0x13, 0, 2, 0, 0, 0, 0, 0});
  subject.say({0x15, 0x2C, 0x01, 0, 0, 0, 0, 0}, 1s);
  subject.slave.reset(true);
  EXPECT_EQ(subject.slave.pending().bit_timing, kNoBitTiming);
  subject.slave.advance(Instant{1300ms});
  EXPECT_EQ(subject.host.used, 2) << "the other nodes switch, too";
}

TEST(LssSlave, Store) {
  Subject subject;
  subject.configuration();
  subject.say({0x11, 9, 0, 0, 0, 0, 0, 0});
  subject.say({0x13, 0, 3, 0, 0, 0, 0, 0});
  EXPECT_EQ(subject.say({0x17, 0, 0, 0, 0, 0, 0, 0}), one({0x17, 0, 0}));
  EXPECT_EQ(subject.host.asked, (Settings{.node_id = 9, .bit_timing = 3}));
  EXPECT_EQ(subject.slave.persistent(), subject.host.asked);
}

TEST(LssSlave, StoreThatIsNotSupportedOrFailsSaysSo) {
  Subject subject;
  subject.configuration();
  subject.say({0x11, 9, 0, 0, 0, 0, 0, 0});
  subject.host.result = StoreResult::unsupported;
  EXPECT_EQ(subject.say({0x17, 0, 0, 0, 0, 0, 0, 0}), one({0x17, 1, 0}));
  subject.host.result = StoreResult::failed;
  EXPECT_EQ(subject.say({0x17, 0, 0, 0, 0, 0, 0, 0}), one({0x17, 2, 0}));
  EXPECT_EQ(subject.slave.persistent().node_id, kNoNodeId);
  Slave without_host(testing::kAddress, nullptr);
  without_host.power_on({});
  can::TransmitQueue out{8};
  without_host.receive(testing::frame_of(kMasterId, {0x04, 1, 0, 0, 0, 0, 0, 0}), out);
  without_host.receive(testing::frame_of(kMasterId, {0x17, 0, 0, 0, 0, 0, 0, 0}), out);
  can::Frame answer;
  ASSERT_TRUE(out.pop(answer));
  EXPECT_EQ(testing::bytes_of(answer), (Bytes{0x17, 1, 0, 0, 0, 0, 0, 0}));
}

TEST(LssSlave, ASlowMediumAnswersWhenItIsDone) {
  for (const bool good : {true, false}) {
    Subject subject;
    subject.configuration();
    subject.say({0x11, 9, 0, 0, 0, 0, 0, 0});
    subject.host.result = StoreResult::later;
    EXPECT_EQ(subject.say({0x17, 0, 0, 0, 0, 0, 0, 0}), kNothing);
    EXPECT_EQ(subject.say({0x17, 0, 0, 0, 0, 0, 0, 0}), kNothing);
    subject.say({0x11, 10, 0, 0, 0, 0, 0, 0});
    subject.slave.stored(good, subject.out);
    EXPECT_EQ(subject.answers(), one({0x17, good ? 0 : 2, 0}));
    EXPECT_EQ(subject.slave.persistent().node_id, good ? 9 : kNoNodeId);
    subject.slave.stored(good, subject.out);
    EXPECT_EQ(subject.answers(), kNothing);
  }
}

TEST(LssSlave, Inquire) {
  Subject subject({.node_id = 5});
  subject.configuration();
  subject.say({0x11, 9, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(subject.say({0x5A, 0, 0, 0, 0, 0, 0, 0}), one({0x5A, 0x11, 0x22, 0x33, 0x44}));
  EXPECT_EQ(subject.say({0x5B, 0, 0, 0, 0, 0, 0, 0}), one({0x5B, 0x55, 0x66, 0x77, 0x88}));
  EXPECT_EQ(subject.say({0x5C, 0, 0, 0, 0, 0, 0, 0}), one({0x5C, 0x99, 0xAA, 0xBB, 0xCC}));
  EXPECT_EQ(subject.say({0x5D, 0, 0, 0, 0, 0, 0, 0}), one({0x5D, 0xED, 0xFE, 0x0F, 0x10}));
  EXPECT_EQ(subject.say({0x5E, 0, 0, 0, 0, 0, 0, 0}), one({0x5E, 5})) << "the active node-ID";
}

TEST(LssSlave, ServesConfigurationInThatStateAlone) {
  Subject subject;
  for (const int command : {0x11, 0x13, 0x15, 0x17, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E}) {
    EXPECT_EQ(subject.say({command, 0, 2, 0, 0, 0, 0, 0}), kNothing);
    EXPECT_TRUE(subject.well_formed);
  }
}

TEST(LssSlave, IdentifyRemoteSlaves) {
  struct Range {
    std::uint32_t vendor, product, revision_low, revision_high, serial_low, serial_high;
    bool fits;
  };
  const auto [v, p, r, s] = testing::kAddress;
  const Range ranges[] = {{v, p, r, r, s, s, true},
                          {v, p, 0, 0xFFFFFFFF, 0, 0xFFFFFFFF, true},
                          {v + 1, p, r, r, s, s, false},
                          {v, p + 1, r, r, s, s, false},
                          {v, p, r + 1, 0xFFFFFFFF, s, s, false},
                          {v, p, 0, r - 1, s, s, false},
                          {v, p, r, r, s + 1, 0xFFFFFFFF, false},
                          {v, p, r, r, 0, s - 1, false}};
  for (const bool configuration : {false, true}) {
    Subject subject({.node_id = 5});
    if (configuration) {
      subject.configuration();
    }
    for (const Range& range : ranges) {
      EXPECT_EQ(subject.say(number(0x46, range.vendor)), kNothing);
      EXPECT_EQ(subject.say(number(0x47, range.product)), kNothing);
      EXPECT_EQ(subject.say(number(0x48, range.revision_low)), kNothing);
      EXPECT_EQ(subject.say(number(0x49, range.revision_high)), kNothing);
      EXPECT_EQ(subject.say(number(0x4A, range.serial_low)), kNothing);
      EXPECT_EQ(subject.say(number(0x4B, range.serial_high)), range.fits ? one({0x4F}) : kNothing);
    }
  }
}

TEST(LssSlave, IdentifyNonConfigured) {
  Subject subject;
  EXPECT_EQ(subject.say({0x4C, 0, 0, 0, 0, 0, 0, 0}), one({0x50}));
  subject.configuration();
  EXPECT_EQ(subject.say({0x4C, 0, 0, 0, 0, 0, 0, 0}), one({0x50}));
  subject.say({0x11, 5, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(subject.say({0x4C, 0, 0, 0, 0, 0, 0, 0}), kNothing);
  EXPECT_EQ(Subject({.node_id = 5}).say({0x4C, 0, 0, 0, 0, 0, 0, 0}), kNothing);
}

TEST(LssSlave, Fastscan) {
  Subject subject;
  EXPECT_EQ(subject.say({0x51, 0, 0, 0, 0, 0x80, 0, 0}), one({0x4F}));
  EXPECT_EQ(subject.say({0x51, 0, 0, 0, 0, 31, 0, 0}), one({0x4F})) << "bit 31 of 44332211h is 0";
  EXPECT_EQ(subject.say({0x51, 0, 0, 0, 0, 30, 0, 0}), kNothing) << "bit 30 is 1";
  EXPECT_EQ(subject.say({0x51, 0, 0, 0, 0x40, 29, 0, 0}), one({0x4F}));
  EXPECT_EQ(subject.say({0x51, 0x55, 0x66, 0x77, 0x88, 0, 1, 2}), kNothing) << "it is at sub 0";
  EXPECT_EQ(subject.say({0x51, 0x11, 0x22, 0x33, 0x44, 0, 0, 1}), one({0x4F}));
  EXPECT_EQ(subject.say({0x51, 0x11, 0x22, 0x33, 0x44, 0, 0, 1}), kNothing) << "it is at sub 1";
  EXPECT_EQ(subject.say({0x51, 0x55, 0x66, 0x77, 0x88, 0, 1, 2}), one({0x4F}));
  EXPECT_EQ(subject.say({0x51, 0x99, 0xAA, 0xBB, 0xCC, 0, 2, 3}), one({0x4F}));
  EXPECT_EQ(subject.slave.state(), SlaveState::waiting);
  EXPECT_EQ(subject.say({0x51, 0xED, 0xFE, 0x0F, 0x10, 0, 3, 0}), one({0x4F}));
  EXPECT_EQ(subject.slave.state(), SlaveState::configuration);
  EXPECT_EQ(subject.say({0x51, 0, 0, 0, 0, 0x80, 0, 0}), kNothing) << "the slave was already found";
}

TEST(LssSlave, FastscanIsForThoseWithoutANodeId) {
  Subject configured({.node_id = 5});
  EXPECT_EQ(configured.say({0x51, 0, 0, 0, 0, 0x80, 0, 0}), kNothing);
  Subject pending;
  pending.configuration();
  pending.say({0x11, 5, 0, 0, 0, 0, 0, 0});
  pending.waiting();
  EXPECT_EQ(pending.say({0x51, 0, 0, 0, 0, 0x80, 0, 0}), kNothing);
}

TEST(LssSlave, ThreeNodeIds) {
  Subject subject({.node_id = 5});
  subject.configuration();
  subject.say({0x11, 9, 0, 0, 0, 0, 0, 0});
  subject.waiting();
  EXPECT_FALSE(subject.slave.pop_reset()) << "the NMT master decides on the reset";
  EXPECT_EQ(subject.slave.active_node_id(), 5);
  EXPECT_EQ(subject.slave.reset(false), 9) << "reset communication: pending becomes active";
  EXPECT_EQ(subject.slave.active_node_id(), 9);
  EXPECT_EQ(subject.slave.reset(true), 5) << "reset node: persistent becomes pending";
  EXPECT_EQ(subject.slave.active_node_id(), 5);
}

TEST(LssSlave, WithoutANodeIdItBootsWhenItLeavesConfigurationWithOne) {
  Subject subject;
  EXPECT_EQ(subject.slave.active_node_id(), kNoNodeId);
  subject.configuration();
  subject.waiting();
  EXPECT_FALSE(subject.slave.pop_reset());
  subject.configuration();
  subject.say({0x11, 9, 0, 0, 0, 0, 0, 0});
  EXPECT_FALSE(subject.slave.pop_reset());
  subject.waiting();
  EXPECT_TRUE(subject.slave.pop_reset());
  EXPECT_FALSE(subject.slave.pop_reset());
  EXPECT_EQ(subject.slave.reset(false), 9);
}

TEST(LssSlave, MalformedFramesAreCountedAndHarmless) {
  Subject subject;
  const Frames wrong = {{},
                        {0x04, 1, 0, 0, 0, 0, 0},
                        {0x04, 0xFF, 0, 0, 0, 0, 0, 0},
                        {0x51, 0, 0, 0, 0, 32, 0, 0},
                        {0x51, 0, 0, 0, 0, 0x81, 0, 0},
                        {0x51, 0, 0, 0, 0, 0, 4, 0},
                        {0x51, 0, 0, 0, 0, 0, 0, 4}};
  for (const Bytes& bytes : wrong) {
    EXPECT_EQ(subject.say(bytes), kNothing);
    EXPECT_FALSE(subject.well_formed);
  }
  EXPECT_EQ(subject.slave.malformed(), wrong.size());
  for (const bool configuration : {false, true}) {
    for (int command = 0; command < 256; ++command) {
      if (configuration) {
        subject.configuration();
      }
      EXPECT_LE(subject.say({command, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0}).size(), 1U);
    }
  }
  EXPECT_EQ(subject.say({0x4C, 0, 0, 0, 0, 0, 0, 0}), one({0x50}));
}

}  // namespace
}  // namespace linegate::lss
