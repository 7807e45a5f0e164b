// SPDX-License-Identifier: Apache-2.0
#include "stack/line/record_service.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

#include "tests/stack/line/diagnosed_parts.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

constexpr std::uint16_t kControlRecord = od::objects::kCanopenIa + 1;
constexpr std::uint16_t kNmtRecord = od::objects::kCanopenIa + 0xA;
constexpr std::uint8_t kRecordNode = 5;

struct RecordServiceTest : testing::Test {
  template <class Value>
  AbortCode write(od::Address address, Value value) {
    std::array<std::byte, sizeof(Value)> data;
    store_le(data.data(), value);
    return parts.node.dictionary().write(address, data);
  }

  DiagnosedParts parts;
  RecordService& service = parts.records;
};

TEST_F(RecordServiceTest, WhatIsWrittenIsOrderedWhenTheAccessIsOver) {
  EXPECT_EQ(service.next_wake(), kNever);
  EXPECT_EQ(write({kNmtRecord, 1}, std::uint16_t{kRecordNode << 8U | 0x80}), AbortCode::none);
  EXPECT_EQ(write({kControlRecord, diagnosis::kTriggerSub}, std::uint16_t{kRecordNode << 8U | 1}),
            AbortCode::none);
  EXPECT_THAT(parts.ordered_nmt, IsEmpty());
  EXPECT_EQ(service.next_wake(), Instant{});
  service.advance(parts.now);
  EXPECT_THAT(parts.ordered_nmt,
              ElementsAre(Pair(nmt::Command::enter_pre_operational, kRecordNode)));
  EXPECT_THAT(parts.ordered_triggers, ElementsAre(Pair(kRecordNode, 1)));
  EXPECT_EQ(service.next_wake(), kNever);
}

TEST_F(RecordServiceTest, AScanIsForTheManagerAndOneAtATime) {
  const od::Address scan{kControlRecord, diagnosis::kScanSub};
  EXPECT_EQ(write(scan, parts.config.node_id), AbortCode::invalid_value);
  parts.host.set_manages(false);
  EXPECT_EQ(write(scan, kRecordNode), AbortCode::local_control);
  parts.host.set_manages(true);
  EXPECT_EQ(write(scan, kRecordNode), AbortCode::none);
  service.advance(parts.now);
  EXPECT_TRUE(parts.scanning.active());
  EXPECT_EQ(write(scan, kRecordNode), AbortCode::device_state);
}

TEST_F(RecordServiceTest, TheEventTimeIsThatOfEventDrivenPdos) {
  const od::Address timer{0x1800, 5};
  const auto before = parts.node.dictionary().number(timer);
  EXPECT_EQ(write({kControlRecord, diagnosis::kEventTimeSub}, std::uint16_t{77}), AbortCode::none);
  EXPECT_EQ(parts.node.dictionary().number(timer), before);
  EXPECT_EQ(service.next_wake(), Instant{});
  service.advance(parts.now);
  EXPECT_EQ(parts.node.dictionary().number(timer), 77U);
}

}  // namespace
}  // namespace linegate::line
