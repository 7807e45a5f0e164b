// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/configuration_objects.h"

#include <array>
#include <map>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/manager/plan.h"
#include "stack/sdo/server.h"

#include "tests/stack/manager/numbers.h"

namespace linegate::manager {
namespace {

class ConfigurationObjectsTest : public testing::Test {
 protected:
  ConfigurationObjectsTest() {
    NodePlan plan{.id = 5};
    plan.writes = {{{0x1017, 0}, {std::byte{100}, std::byte{0}}}};
    plan.expected = {.date = 3, .time = 4};
    plan.restore = 1;
    plans_.push_back(plan);
    plan.id = 7;
    plan.store = 2;
    plans_.push_back(plan);
    plans_.push_back({.id = 9});
    od::DeviceDescription device;
    device.objects = configuration_objects(plans_);
    dictionary_ = od::Dictionary(device);
    objects_.emplace(dictionary_, plans_);
    objects_->set_may_configure([this](std::uint8_t node) {
      const auto known = answers_.find(node);
      return known == answers_.end() ? AbortCode::invalid_value : known->second;
    });
  }

  std::uint64_t value(std::uint16_t index, std::uint8_t sub) {
    return dictionary_.number({index, sub}).value_or(0xDEAD);
  }

  std::vector<NodePlan> plans_;
  od::Dictionary dictionary_;
  std::optional<ConfigurationObjects> objects_;
  std::map<std::uint8_t, AbortCode> answers_;
};

TEST_F(ConfigurationObjectsTest, ShowWhatThePlansSay) {
  const auto concise = dictionary_.read({0x1F22, 5});
  ASSERT_TRUE(concise.ok());
  const std::vector<std::byte> bytes(concise->begin(), concise->end());
  EXPECT_EQ(bytes, write_concise_dcf(plans_[0].writes));
  EXPECT_EQ(value(0x1F22, 0), 127U);
  EXPECT_EQ(value(0x1F25, 0), 128U);
  EXPECT_EQ(value(0x1F26, 5), 3U);
  EXPECT_EQ(value(0x1F27, 5), 4U);
  EXPECT_EQ(value(0x1F26, 9), 0U);
  const ConfigurationOrder order = objects_->order(5);
  ASSERT_EQ(order.writes.size(), 1U);
  EXPECT_EQ(order.expected, (ConfigurationDate{.date = 3, .time = 4}));
  EXPECT_EQ(order.restore, 1);
  EXPECT_EQ(order.store, 0);
  EXPECT_EQ(objects_->order(7).store, 2);
  EXPECT_FALSE(objects_->has_configuration(9));
}

TEST_F(ConfigurationObjectsTest, AConciseDcfIsTakenWholeOrNotAtAll) {
  const std::vector<ObjectWrite> other = {{{0x2000, 1}, number(8)}};
  auto bytes = write_concise_dcf(other);
  bytes.pop_back();
  EXPECT_EQ(dictionary_.write({0x1F22, 5}, bytes), AbortCode::length_mismatch);
  EXPECT_EQ(objects_->order(5).writes.at(0).address, (od::Address{0x1017, 0}));
  EXPECT_EQ(dictionary_.write({0x1F22, 5}, write_concise_dcf(other)), AbortCode::none);
  EXPECT_EQ(objects_->order(5).writes.at(0).address, (od::Address{0x2000, 1}));
}

// Segments of two downloads and of an upload in turn: the servers share no transfer state.
TEST_F(ConfigurationObjectsTest, SeveralConciseDcfsAreWrittenAtOnceAndReadMeanwhile) {
  EventLog events;
  can::TransmitQueue queue{4};
  sdo::Server first(dictionary_, can::CobId{0x67F}, can::CobId{0x5FF}, events);
  sdo::Server second(dictionary_, can::CobId{0x640}, can::CobId{0x641}, events);
  sdo::Server reader(dictionary_, can::CobId{0x642}, can::CobId{0x643}, events);
  const auto ask = [](sdo::Server& server, const std::array<std::uint8_t, 8>& request) {
    can::Frame frame = can::make_frame(server.request_id().id(), std::as_bytes(std::span(request)));
    can::Frame out;
    EXPECT_TRUE(server.answer(frame, out));
    return std::to_integer<unsigned>(out.bytes()[0]);
  };
  // 15 bytes: one object of 4 bytes.
  const auto segments = [](std::uint16_t index, std::uint8_t value) {
    const auto low = static_cast<std::uint8_t>(index);
    const auto high = static_cast<std::uint8_t>(index >> 8U);
    return std::array<std::array<std::uint8_t, 8>, 3>{
        {{0x00, 1, 0, 0, 0, low, high, 1}, {0x10, 4, 0, 0, 0, value, 0, 0}, {0x0D, 0}}};
  };
  const auto one = segments(0x2000, 8);
  const auto two = segments(0x2100, 9);
  EXPECT_EQ(ask(first, {0x21, 0x22, 0x1F, 5, 15, 0, 0, 0}), 0x60U);
  EXPECT_EQ(ask(second, {0x21, 0x22, 0x1F, 7, 15, 0, 0, 0}), 0x60U);
  EXPECT_EQ(ask(reader, {0x40, 0x22, 0x1F, 5, 0, 0, 0, 0}), 0x41U);
  for (std::size_t i = 0; i < 3; ++i) {
    const unsigned toggle = i % 2 == 1 ? 0x10 : 0x00;
    EXPECT_EQ(ask(first, one[i]), 0x20U | toggle);
    EXPECT_EQ(ask(second, two[i]), 0x20U | toggle);
    if (i < 2) {
      EXPECT_EQ(ask(reader, {static_cast<std::uint8_t>(0x60U | toggle), 0}) & 0xF0U, toggle);
    }
  }
  EXPECT_EQ(objects_->order(5).writes.at(0).address, (od::Address{0x2000, 1}));
  EXPECT_EQ(objects_->order(7).writes.at(0).address, (od::Address{0x2100, 1}));
  EXPECT_EQ(first.counters().aborts + second.counters().aborts + reader.counters().aborts, 0U);
  EXPECT_EQ(reader.counters().uploads, 1U) << "reads the concise DCF from its begin";
}

TEST_F(ConfigurationObjectsTest, WhatIsExpectedBelongsToTheNewestConciseDcf) {
  const std::vector<ObjectWrite> undated = {{{0x2000, 1}, number(8)}};
  ASSERT_EQ(dictionary_.write({0x1F22, 5}, write_concise_dcf(undated)), AbortCode::none);
  EXPECT_FALSE(objects_->order(5).expected.known()) << "always to be configured";
  const std::vector<ObjectWrite> dated = {{{0x1020, 1}, number(10)}, {{0x1020, 2}, number(11)}};
  ASSERT_EQ(dictionary_.write({0x1F22, 5}, write_concise_dcf(dated)), AbortCode::none);
  EXPECT_EQ(objects_->order(5).expected, (ConfigurationDate{.date = 10, .time = 11}));
  ASSERT_EQ(dictionary_.write({0x1F22, 7}, write_concise_dcf(undated)), AbortCode::none);
  EXPECT_EQ(objects_->order(7).expected, fingerprint_of(undated)) << "node 7 stores";
  ASSERT_EQ(dictionary_.write({0x1F26, 7}, number(12)), AbortCode::none);
  EXPECT_EQ(objects_->order(7).expected.date, 12U);
}

TEST_F(ConfigurationObjectsTest, RequestsAreRefusedInTheWordsOfCia302) {
  answers_[5] = AbortCode::none;
  answers_[7] = AbortCode::device_state;
  answers_[9] = AbortCode::none;
  EXPECT_EQ(dictionary_.write({0x1F25, 5}, number(1)), AbortCode::local_control);
  EXPECT_EQ(dictionary_.write({0x1F25, 6}, number(kConf)), AbortCode::invalid_value);
  EXPECT_EQ(dictionary_.write({0x1F25, 7}, number(kConf)), AbortCode::device_state);
  EXPECT_EQ(dictionary_.write({0x1F25, 9}, number(kConf)), AbortCode::no_data);
  EXPECT_FALSE(objects_->requested());
  EXPECT_EQ(dictionary_.write({0x1F25, 5}, number(kConf)), AbortCode::none);
  EXPECT_TRUE(objects_->requested());
  EXPECT_EQ(objects_->pop_requests().to_ullong(), 1U << 5U);
  EXPECT_FALSE(objects_->requested());
  EXPECT_FALSE(dictionary_.read({0x1F25, 5}).ok()) << "write-only";
}

TEST_F(ConfigurationObjectsTest, ARequestForAllIsForThoseThatCanBeConfigured) {
  answers_[5] = AbortCode::none;
  answers_[7] = AbortCode::device_state;
  EXPECT_EQ(dictionary_.write({0x1F25, 128}, number(kConf)), AbortCode::none);
  EXPECT_EQ(objects_->pop_requests().to_ullong(), 1U << 5U);
  answers_[5] = AbortCode::device_state;
  EXPECT_EQ(dictionary_.write({0x1F25, 128}, number(kConf)), AbortCode::device_state);
  objects_->set_may_configure(nullptr);
  EXPECT_EQ(dictionary_.write({0x1F25, 128}, number(kConf)), AbortCode::local_control);
}

}  // namespace
}  // namespace linegate::manager
