// SPDX-License-Identifier: Apache-2.0
// The control record of the CANopenIA manual (6.2) and generic CAN frames as values.
#include <gmock/gmock.h>

#include "tests/stack/diagnosis/canopen_ia_fixture.h"

namespace linegate::diagnosis {
namespace {

using std::chrono::milliseconds;
using testing::IsEmpty;

class CanopenIaControl : public CanopenIaTest {
 protected:
  static std::vector<std::byte> bytes(std::initializer_list<unsigned> values) {
    std::vector<std::byte> out;
    for (const unsigned value : values) {
      out.push_back(static_cast<std::byte>(value));
    }
    return out;
  }
  AbortCode frame(std::uint8_t sub, std::initializer_list<unsigned> value) {
    return dictionary_.write({0x5F4C, sub}, bytes(value));
  }
  std::vector<std::byte> heard(std::uint8_t sub) {
    const auto value = dictionary_.read({0x5F4C, sub});
    return value ? std::vector<std::byte>(value->begin(), value->end()) : std::vector<std::byte>();
  }
};

TEST_F(CanopenIaControl, BitsOfTheManagerControl) {
  make({});
  EXPECT_FALSE(records_->settings().use_scanned_entries);
  EXPECT_EQ(write(0x5F41, 4, kFixedControl | 0x70U, 4), AbortCode::none);
  EXPECT_TRUE(records_->settings().use_scanned_entries);
  EXPECT_TRUE(records_->settings().enforce_sdo);
  EXPECT_TRUE(records_->settings().manual_trigger);
  EXPECT_FALSE(records_->settings().keep_operational);
  EXPECT_EQ(read(0x5F41, 4), kFixedControl | 0x70U);
  EXPECT_EQ(write(0x5F41, 4, kFixedControl | 0x80U, 4), AbortCode::invalid_value) << "reserved bit";
  EXPECT_EQ(write(0x5F41, 4, kFixedControl & ~0x04U, 4), AbortCode::invalid_value)
      << "reception of PDOs cannot be disabled";
  EXPECT_EQ(write(0x5F41, 4, kFixedControl, 4), AbortCode::none);
  EXPECT_FALSE(records_->settings().manual_trigger);
}

TEST_F(CanopenIaControl, TimesBeginAsConfiguredAndAreWritten) {
  make({.settings = {.heartbeat = milliseconds(200), .update_time = milliseconds(20)}});
  EXPECT_EQ(read(0x5F41, 0), 0x0CU);
  EXPECT_EQ(read(0x5F41, 5), 200U);
  EXPECT_EQ(read(0x5F41, 6), 500U) << "2.5 heartbeat times";
  EXPECT_EQ(read(0x5F41, 7), 20U);
  EXPECT_EQ(write(0x5F41, 5, 1000, 2), AbortCode::none);
  EXPECT_EQ(write(0x5F41, 5, 0, 2), AbortCode::value_too_low);
  EXPECT_EQ(write(0x5F41, 6, 1000, 2), AbortCode::read_only);
  EXPECT_EQ(write(0x5F41, 7, 30, 1), AbortCode::none);
  EXPECT_EQ(records_->settings().heartbeat, milliseconds(1000));
  EXPECT_EQ(records_->settings().update_time, milliseconds(30));
  EXPECT_EQ(read(0x5F41, 6), 2500U);
}

TEST_F(CanopenIaControl, WhatIsLongerThanItsObjectReadsAsTheLongest) {
  make({.settings = {.heartbeat = milliseconds(60'000), .update_time = milliseconds(300)}});
  EXPECT_EQ(read(0x5F41, 6), 0xFFFFU);
  EXPECT_EQ(read(0x5F41, 7), 0xFFU);
}

TEST_F(CanopenIaControl, TimesOfPdosAreAsConfiguredUntilTheyAreWritten) {
  make({});
  EXPECT_EQ(read(0x5F41, 8), 0U);
  EXPECT_FALSE(records_->settings().event_time);
  EXPECT_FALSE(records_->waits());
  EXPECT_EQ(write(0x5F41, 8, 100, 2), AbortCode::none);
  EXPECT_TRUE(records_->waits());
  EXPECT_TRUE(records_->pop_pdo_times_written());
  EXPECT_FALSE(records_->pop_pdo_times_written());
  EXPECT_EQ(write(0x5F41, 9, 50, 2), AbortCode::none);
  EXPECT_TRUE(records_->pop_pdo_times_written());
  EXPECT_EQ(records_->settings().event_time, 100);
  EXPECT_EQ(records_->settings().inhibit_time, 50);
  EXPECT_EQ(read(0x5F41, 9), 50U);
}

TEST_F(CanopenIaControl, AScanAndATriggerAreOrdered) {
  make({});
  EXPECT_EQ(write(0x5F41, 0x0A, 5, 1), AbortCode::none);
  EXPECT_EQ(write(0x5F41, 0x0C, 0x0501, 2), AbortCode::none);
  CanopenIa::Order order;
  ASSERT_TRUE(records_->take(order));
  EXPECT_EQ(order.kind, CanopenIa::OrderKind::scan);
  EXPECT_EQ(order.node, 5);
  ASSERT_TRUE(records_->take(order));
  EXPECT_EQ(order.kind, CanopenIa::OrderKind::trigger);
  EXPECT_EQ(order.node, 5);
  EXPECT_EQ(order.rpdo, 1);
  EXPECT_FALSE(records_->waits());
}

TEST_F(CanopenIaControl, WhatTheLineCannotDoIsRefused) {
  make({});
  EXPECT_EQ(write(0x5F41, 0x0A, 6, 1), AbortCode::device_state);
  EXPECT_EQ(write(0x5F41, 0x0A, 0, 1), AbortCode::invalid_value);
  EXPECT_EQ(write(0x5F41, 0x0A, 0x85, 1), AbortCode::invalid_value) << "bit 7 is reserved";
  EXPECT_EQ(write(0x5F41, 0x0C, 0x0502, 2), AbortCode::invalid_value);
  EXPECT_EQ(write(0x5F41, 0x0C, 0x0500, 2), AbortCode::invalid_value);
  EXPECT_EQ(write(0x5F41, 0x0C, 0x0001, 2), AbortCode::invalid_value);
  EXPECT_EQ(dictionary_.read({0x5F41, 0x0A}).error(), to_error(AbortCode::write_only));
  EXPECT_EQ(dictionary_.read({0x5F41, 0x0C}).error(), to_error(AbortCode::write_only));
  EXPECT_FALSE(records_->waits());
}

TEST_F(CanopenIaControl, FramesAreSentWhenThatIsEnabled) {
  make({});
  EXPECT_EQ(frame(4, {0x50, 0x01, 0x11, 0x22, 0x33, 0x44}), AbortCode::device_state);
  EXPECT_EQ(write(0x5F41, 0x0B, 0x01, 1), AbortCode::none);
  EXPECT_EQ(read(0x5F41, 0x0B), 0x01U);
  EXPECT_EQ(frame(4, {0x50, 0x01, 0x11, 0x22, 0x33, 0x44}), AbortCode::none);
  EXPECT_EQ(frame(1, {0x51, 0x01, 0x99}), AbortCode::none);
  EXPECT_EQ(frame(8, {0xFF, 0x07, 1, 2, 3, 4, 5, 6, 7, 8}), AbortCode::none);
  ASSERT_EQ(sent_.size(), 3U);
  EXPECT_TRUE(can::same_content(sent_[0], can::make_frame(0x150, {0x11, 0x22, 0x33, 0x44})));
  EXPECT_TRUE(can::same_content(sent_[1], can::make_frame(0x151, {0x99})));
  EXPECT_TRUE(can::same_content(sent_[2], can::make_frame(0x7FF, {1, 2, 3, 4, 5, 6, 7, 8})));
  EXPECT_EQ(write(0x5F41, 0x0B, 0x10, 1), AbortCode::none);
  EXPECT_EQ(frame(1, {0x51, 0x01, 0x99}), AbortCode::device_state) << "only reception is enabled";
  EXPECT_EQ(write(0x5F41, 0x0B, 0x02, 1), AbortCode::invalid_value);
  EXPECT_EQ(write(0x5F41, 0x0B, 0x21, 1), AbortCode::invalid_value);
}

TEST_F(CanopenIaControl, WhatIsNoFrameIsRefused) {
  make({.settings = {.sends_frames = true}});
  EXPECT_EQ(frame(2, {0x50, 0x01, 0x11}), AbortCode::length_too_low);
  EXPECT_EQ(frame(2, {0x50, 0x01, 1, 2, 3}), AbortCode::length_too_high);
  EXPECT_EQ(frame(1, {0x00, 0x08, 1}), AbortCode::invalid_value) << "more than 11 bits";
  EXPECT_EQ(frame(9, {0x50, 0x01}), AbortCode::no_sub_index);
  EXPECT_EQ(frame(1, {0x80, 0x00, 1}), AbortCode::local_control) << "a service uses the identifier";
  EXPECT_EQ(frame(0, {0x50, 0x01}), AbortCode::read_only) << "the highest sub-index";
  EXPECT_THAT(sent_, IsEmpty());
}

TEST_F(CanopenIaControl, TheLastFrameOfEachLengthIsKept) {
  make({});
  EXPECT_FALSE(records_->hear(can::make_frame(0x150, {1, 2}))) << "reception is not enabled";
  EXPECT_EQ(dictionary_.read({0x5F4C, 2}).error(), to_error(AbortCode::no_data));
  EXPECT_EQ(write(0x5F41, 0x0B, 0x11, 1), AbortCode::none);
  EXPECT_TRUE(records_->hear(can::make_frame(0x150, {1, 2})));
  EXPECT_TRUE(records_->hear(can::make_frame(0x151, {3, 4})));
  EXPECT_TRUE(records_->hear(can::make_frame(0x152, {1, 2, 3, 4, 5, 6, 7, 8})));
  EXPECT_EQ(heard(2), bytes({0x51, 0x01, 3, 4}));
  EXPECT_EQ(heard(8), bytes({0x52, 0x01, 1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(heard(0), bytes({8})) << "the highest sub-index";
  EXPECT_EQ(frame(2, {0x50, 0x02, 7, 7}), AbortCode::none);
  EXPECT_EQ(heard(2), bytes({0x51, 0x01, 3, 4})) << "sent frames are not shown";
}

TEST_F(CanopenIaControl, OtherFramesAreToldButHaveNoPlace) {
  make({.settings = {.receives_frames = true}});
  can::Frame extended = can::make_frame(0x150, {1});
  extended.flags = can::Frame::kExtended;
  EXPECT_TRUE(records_->hear(extended));
  can::Frame remote = can::make_frame(0x150, {1});
  remote.flags = can::Frame::kRemote;
  EXPECT_TRUE(records_->hear(remote));
  can::Frame fd;
  fd.flags = can::Frame::kFd;
  fd.length = 64;
  EXPECT_TRUE(records_->hear(fd));
  EXPECT_EQ(dictionary_.read({0x5F4C, 1}).error(), to_error(AbortCode::no_data));
}

}  // namespace
}  // namespace linegate::diagnosis
