// SPDX-License-Identifier: Apache-2.0
// The CANopenIA records in their own dictionary; the test takes the place of the line.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/diagnosis/canopen_ia.h"

namespace linegate::diagnosis {

inline constexpr std::uint8_t kOwnNode = 127;

class CanopenIaTest : public testing::Test, public Source, public RecordHost {
 protected:
  NetworkFacts network() const override { return facts_; }
  const manager::NodeState& node_seen(std::uint8_t node) const override { return nodes_[node]; }
  Transmission transmission() const override { return transmission_; }
  AbortCode may_scan(std::uint8_t node) const override {
    return node == 5 ? AbortCode::none : AbortCode::device_state;
  }
  AbortCode may_trigger(std::uint8_t node, std::uint8_t number) const override {
    return node == 5 && number == 1 ? AbortCode::none : AbortCode::invalid_value;
  }
  AbortCode transmit(const can::Frame& frame) override {
    if (frame.id == 0x080) {
      return AbortCode::local_control;
    }
    sent_.push_back(frame);
    return AbortCode::none;
  }

  void make(CanopenIaOptions options) {
    options.own_node = kOwnNode;
    ASSERT_TRUE(add_canopen_ia(dictionary_, options.base).ok());
    records_.emplace(dictionary_, diagnosis_, *this, options);
    facts_.running = true;
    facts_.own = nmt::State::operational;
  }
  std::uint64_t read(std::uint16_t index, std::uint8_t sub) {
    const auto value = dictionary_.read({index, sub});
    EXPECT_TRUE(value) << index << ':' << unsigned{sub};
    return value ? load_le(*value) : 0;
  }
  AbortCode write(std::uint16_t index, std::uint8_t sub, std::uint64_t value, std::size_t size) {
    std::array<std::byte, 8> bytes{};
    store_le(bytes.data(), value);
    return dictionary_.write({index, sub}, std::span(bytes).first(size));
  }
  void bus(can::BusState state) { diagnosis_.emitted({.data = event::BusState{.state = state}}); }

  NetworkFacts facts_;
  Transmission transmission_;
  std::vector<can::Frame> sent_;
  std::array<manager::NodeState, 128> nodes_{};
  od::Dictionary dictionary_;
  Diagnosis diagnosis_{{.own_node = kOwnNode}, dictionary_, *this};
  std::optional<CanopenIa> records_;
};

}  // namespace linegate::diagnosis
