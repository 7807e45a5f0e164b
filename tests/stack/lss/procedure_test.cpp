// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/procedure.h"

#include <gtest/gtest.h>

#include "tests/stack/lss/slaves.h"

namespace linegate::lss {
namespace {

using testing::Subject;
using Data = std::vector<std::byte>;

Data data_of(std::initializer_list<int> bytes) {
  Data out;
  for (const int byte : bytes) {
    out.push_back(static_cast<std::byte>(byte));
  }
  return out;
}

const Data kDone3 = data_of({0, 0, 0});
const Data kNoAnswer3 = data_of({1, 0, 0});

// One slave with the address 44332211h, 88776655h, CCBBAA99h, 100FFEEDh.
class LssCourse : public ::testing::Test {
 protected:
  // The reply; empty if the arguments are invalid.
  Data run(Procedure procedure, const Data& arguments = {}) {
    auto course = Course::make(procedure, arguments);
    if (!course) {
      return {};
    }
    while (!course->over()) {
      if (const auto node = course->node_to_check()) {
        checks.push_back(*node);
        course->checked(*node != in_use);
        continue;
      }
      Master master;
      master.start(course->request());
      can::Frame frame;
      while (master.next_frame(frame, Instant{})) {
        subject.slave.receive(frame, subject.out);
        if (two) {
          other.slave.receive(frame, other.out);
        }
      }
      while (subject.out.pop(frame) || other.out.pop(frame)) {
        master.receive(frame);
      }
      master.advance(Instant{std::chrono::seconds(10)});
      course->answered(master.take().value());
    }
    return course->reply();
  }
  Data address() const {
    Data out;
    put(testing::kAddress, out);
    return out;
  }
  static Data after_head(const Data& rest) {
    Data out(kReplyHead);
    out.insert(out.end(), rest.begin(), rest.end());
    return out;
  }

  Subject subject;
  Subject other{{}, {1, 2, 3, 4}};
  bool two = false;  // whether the second slave is connected
  int in_use = 0;
  std::vector<int> checks;
};

TEST_F(LssCourse, ANodeIdInUseIsNotGivenUnlessForced) {
  in_use = 9;
  EXPECT_EQ(run(Procedure::switch_selective, address()), kDone3);
  EXPECT_EQ(run(Procedure::configure_node_id, data_of({9})), data_of({4, 0, 0}));
  EXPECT_EQ(subject.slave.pending().node_id, kNoNodeId);
  EXPECT_EQ(run(Procedure::configure_node_id, data_of({10})), kDone3);
  EXPECT_EQ(checks, (std::vector{9, 10}));
  EXPECT_EQ(run(Procedure::configure_node_id, data_of({9, 1})), kDone3);
  EXPECT_EQ(subject.slave.pending().node_id, 9);
  subject.slave.reset(false);
  EXPECT_EQ(run(Procedure::configure_node_id, data_of({9})), kDone3) << "the node-ID is unchanged";
  EXPECT_EQ(run(Procedure::configure_node_id, data_of({255})), kDone3);
  EXPECT_EQ(checks, (std::vector{9, 10}));
  EXPECT_EQ(run(Procedure::configure_node_id, data_of({9, 2})), Data{});
}

TEST_F(LssCourse, AnInquiryThatSeveralDevicesAnswerIsAnsweredWithThat) {
  two = true;
  EXPECT_EQ(run(Procedure::switch_global, data_of({1})), kDone3);
  EXPECT_EQ(run(Procedure::inquire_address), data_of({3, 0, 0}));
  EXPECT_EQ(run(Procedure::inquire_node_id), data_of({3, 0, 0}));
  EXPECT_EQ(run(Procedure::configure_node_id, data_of({9})), data_of({3, 0, 0}));
}

TEST_F(LssCourse, ServicesOneByOne) {
  EXPECT_EQ(run(Procedure::identify_unconfigured), kDone3);
  EXPECT_EQ(run(Procedure::inquire_node_id), kNoAnswer3) << "no slave in configuration";
  EXPECT_EQ(run(Procedure::switch_selective, address()), kDone3);
  EXPECT_EQ(run(Procedure::inquire_address), after_head(address()));
  EXPECT_EQ(run(Procedure::inquire_node_id), data_of({0, 0, 0, 255}));
  EXPECT_EQ(run(Procedure::configure_node_id, data_of({9})), kDone3);
  EXPECT_EQ(run(Procedure::configure_bit_timing, data_of({0, 3})), kDone3);
  EXPECT_EQ(run(Procedure::configure_bit_timing, data_of({1, 3})), data_of({2, 1, 0}));
  EXPECT_EQ(run(Procedure::store), kDone3);
  EXPECT_EQ(subject.host.asked, (Settings{.node_id = 9, .bit_timing = 3}));
  EXPECT_EQ(run(Procedure::activate_bit_timing, data_of({0x10, 0})), kDone3);
  EXPECT_TRUE(subject.slave.silent());
}

TEST_F(LssCourse, SwitchStateGlobal) {
  EXPECT_EQ(run(Procedure::switch_global, data_of({1})), kDone3);
  EXPECT_EQ(subject.slave.state(), SlaveState::configuration);
  EXPECT_EQ(run(Procedure::switch_global, data_of({0})), kDone3);
  EXPECT_EQ(subject.slave.state(), SlaveState::waiting);
}

TEST_F(LssCourse, Identify) {
  Data range;
  put({0x44332211, 0x88776655, 0, 0xFFFFFFFF}, range);
  put({0, 0xFFFFFFFF, 0, 0}, range);
  range.resize(24);
  EXPECT_EQ(run(Procedure::identify, range), kDone3);
  range.front() = std::byte{0};
  EXPECT_EQ(run(Procedure::identify, range), kNoAnswer3);
}

TEST_F(LssCourse, FastscanWithAndWithoutKnownParts) {
  EXPECT_EQ(run(Procedure::fastscan), after_head(address()));
  EXPECT_EQ(subject.slave.state(), SlaveState::configuration);
  EXPECT_EQ(run(Procedure::fastscan), kNoAnswer3) << "a found slave does not respond";
  run(Procedure::switch_global, data_of({0}));
  Data known = data_of({0x03});
  put(testing::kAddress, known);
  EXPECT_EQ(run(Procedure::fastscan, known), after_head(address()));
  run(Procedure::switch_global, data_of({0}));
  known[1] = std::byte{0};
  EXPECT_EQ(run(Procedure::fastscan, known), kNoAnswer3) << "another vendor-ID";
}

TEST_F(LssCourse, ArgumentsThatAreNone) {
  for (unsigned i = 0; i < kProcedures; ++i) {
    EXPECT_FALSE(Course::make(static_cast<Procedure>(i), Data(5))) << i;
  }
  EXPECT_FALSE(Course::make(Procedure::switch_global, data_of({2})));
  EXPECT_FALSE(Course::make(Procedure::configure_node_id, data_of({0})));
  EXPECT_FALSE(Course::make(Procedure::configure_node_id, data_of({128})));
  EXPECT_TRUE(Course::make(Procedure::configure_node_id, data_of({255})));
  EXPECT_FALSE(Course::make(Procedure::fastscan, [] {
    Data out(17);
    out[0] = std::byte{0x10};
    return out;
  }()));
  EXPECT_FALSE(Course::make(Procedure::assign, {}));
}

}  // namespace
}  // namespace linegate::lss
