// SPDX-License-Identifier: Apache-2.0
// An SDO manager without a line, and the devices of its network, which a test controls answer by
// answer.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/manager/connections.h"
#include "stack/sdo/protocol.h"

namespace linegate::manager {

using Milliseconds = std::chrono::milliseconds;

inline constexpr std::uint32_t kNotValid = 0x8000'0000;
inline constexpr std::uint32_t kDynamic = 0x4000'0000;

// How a device treats a request.
struct Answer {
  enum class Kind : std::uint8_t { right, silent, executed, abort, nonsense } kind = Kind::right;
  AbortCode abort = AbortCode::general;
};

// The SDO records of a device.
class ConnectedDevice {
 public:
  void add(std::uint16_t record, std::uint32_t to_server = kNotValid,
           std::uint32_t to_client = kNotValid, bool has_node = true) {
    values_[{record, 1}] = to_server;
    values_[{record, 2}] = to_client;
    if (has_node) {
      values_[{record, 3}] = 0;
    }
    defaults_ = values_;
  }
  void remove() { values_.clear(); }
  // As 1010h.
  void store() { defaults_ = values_; }
  void reset() {
    values_ = defaults_;
    for (const auto& [address, value] : values_) {
      if (valid(address.index)) {
        deceive(address.index);
      }
    }
  }
  // The record is valid, or may be, although the manager was told otherwise, until it is written:
  // the device restored it, or confirmed a write that it did not execute.
  void deceive(std::uint16_t record) { deceiving_.insert(record); }
  bool deceives(std::uint16_t record) const { return deceiving_.contains(record); }
  std::uint32_t value(std::uint16_t record, std::uint8_t sub) const {
    return values_.at({record, sub});
  }
  bool has(od::Address address) const { return values_.contains(address); }
  bool valid(std::uint16_t record) const {
    return has({record, 1}) && ((value(record, 1) | value(record, 2)) & kNotValid) == 0;
  }
  const std::map<od::Address, std::uint32_t>& values() const { return values_; }

  // Executes an expedited request, and returns the response.
  std::uint64_t execute(std::uint64_t word) {
    const od::Address object = sdo::multiplexer(word);
    const auto command = static_cast<std::uint8_t>(word);
    const std::uint64_t head = word & 0xFFFF'FF00;
    const auto found = values_.find(object);
    if (found == values_.end()) {
      const bool has_object = has({object.index, 1});
      return sdo::abort_word(object, has_object ? AbortCode::no_sub_index : AbortCode::no_object);
    }
    const bool is_byte = object.sub == 3;
    if (command == 0x40) {
      return (is_byte ? 0x4FU : 0x43U) | head | std::uint64_t{found->second} << 32U;
    }
    if (command != (is_byte ? 0x2F : 0x23)) {
      return sdo::abort_word(object, AbortCode::length_mismatch);
    }
    found->second = static_cast<std::uint32_t>(word >> 32U);
    if (!valid(object.index)) {
      deceiving_.erase(object.index);
    }
    return 0x60 | head;
  }

 private:
  std::map<od::Address, std::uint32_t> values_;
  std::map<od::Address, std::uint32_t> defaults_;
  std::set<std::uint16_t> deceiving_;
};

class ConnectionNetwork : public ConnectionHost {
 public:
  static constexpr std::uint8_t kClient = 5;
  static constexpr std::uint8_t kServer = 8;

  explicit ConnectionNetwork(ConnectionPool pool = {0x680, 0x685}) : pool_(pool) {
    devices[kClient].add(0x1280);
    devices[kClient].add(0x1281);
    devices[kServer].add(0x1201);
    devices[kServer].add(0x1202);
  }

  // Runs until nothing is to be done before the next deadline, which is not awaited.
  void settle() {
    for (int round = 0; round < 10'000; ++round) {
      connections.advance(now);
      sdo.advance(now);
      sdo.deliver_completions(now);
      can::Frame request;
      if (transmit.pop(request)) {
        serve(request);
      } else if (connections.next_wake() > now && sdo.next_wake() > now) {
        return;
      }
    }
    FAIL() << "the connections do not come to rest";
  }
  // Runs until no request is under way.
  void run() {
    settle();
    for (int round = 0; round < 10'000 && connections.busy(); ++round) {
      now = std::max(now, std::min(connections.next_wake(), sdo.next_wake()));
      settle();
    }
    EXPECT_FALSE(connections.busy());
  }
  std::uint32_t open(std::uint8_t client = kClient, std::uint8_t server = kServer,
                     Duration timeout = {}) {
    const std::uint32_t number = connections.open(client, server, {.timeout = timeout}, now);
    EXPECT_NE(number, 0U);
    run();
    return number;
  }
  bool close(std::uint32_t number) {
    const bool begun = connections.close(number, {}, now);
    run();
    return begun;
  }
  void reset(std::uint8_t node) {
    devices[node].reset();
    connections.boot_up(node, now);
  }
  std::vector<event::SdoConnection> take_events() {
    std::vector<Event> taken(64);
    taken.resize(events.take(taken));
    std::vector<event::SdoConnection> out;
    for (const Event& each : taken) {
      if (const auto* const of = each.get<event::SdoConnection>()) {
        out.push_back(*of);
      }
    }
    return out;
  }
  // What ended() reported: "5: 06020000", "5: expired".
  std::vector<std::string> take_ended() { return std::exchange(ended_, {}); }

  Instant now{std::chrono::seconds(10)};
  std::map<std::uint8_t, ConnectedDevice> devices;
  std::function<Answer(std::uint8_t node, od::Address object, bool write)> answer;
  std::vector<std::string> log;  // each request: "8 1201:1 = 80000000"
  std::set<std::uint32_t> used;  // CAN-IDs of other services
  std::map<std::uint8_t, std::vector<std::uint16_t>> files;

 private:
  // ConnectionHost
  bool uses(std::uint32_t id) override { return used.contains(id); }
  std::vector<std::uint16_t> records(std::uint8_t node, std::uint16_t first,
                                     std::uint16_t last) const override {
    std::vector<std::uint16_t> out;
    const auto file = files.find(node);
    if (file != files.end()) {
      std::ranges::copy_if(file->second, std::back_inserter(out),
                           [=](std::uint16_t index) { return index >= first && index <= last; });
    }
    return out;
  }
  void ended(std::uint32_t number, AbortCode why, bool expired, Instant /*at*/) override {
    ended_.push_back(std::to_string(number) + ": " +
                     (expired ? "expired" : hex(static_cast<std::uint32_t>(why))));
  }

  static std::string hex(std::uint32_t value, int digits = 8) {
    std::array<char, 16> text{};
    (void)std::snprintf(text.data(), text.size(), "%0*X", digits, value);
    return text.data();
  }
  void serve(const can::Frame& request) {
    const auto node = static_cast<std::uint8_t>(request.id & 0x7FU);
    const std::uint64_t word = sdo::word_of(request);
    const auto command = static_cast<std::uint8_t>(word);
    if (command == 0x80) {
      return;  // an abort
    }
    const od::Address object = sdo::multiplexer(word);
    const bool write = command != 0x40;
    log.push_back(std::to_string(node) + ' ' + hex(object.index, 4) + ':' +
                  std::to_string(object.sub) +
                  (write ? " = " + hex(static_cast<std::uint32_t>(word >> 32U)) : ""));
    const auto device = devices.find(node);
    if (device == devices.end()) {
      return;
    }
    const Answer how = answer ? answer(node, object, write) : Answer{};
    switch (how.kind) {
      case Answer::Kind::right:
        respond(node, device->second.execute(word));
        break;
      case Answer::Kind::executed:
        (void)device->second.execute(word);
        break;
      case Answer::Kind::silent:
        break;
      case Answer::Kind::abort:
        respond(node, sdo::abort_word(object, how.abort));
        break;
      case Answer::Kind::nonsense:  // two bytes, whatever the request is
        if (write) {
          device->second.deceive(object.index);
        }
        respond(node, (write ? 0x60U : 0x4BU) | (word & 0xFFFF'FF00) | 0x1234ULL << 32U);
        break;
    }
    check();
  }
  void respond(std::uint8_t node, std::uint64_t word) {
    can::Frame response{.id = can::kSdoResponseBase + node, .length = sdo::kFrameSize};
    response.time = now;
    store_le(response.data.data(), word);
    sdo.receive({.service = can::Service::sdo_client, .index = node}, response);
    sdo.deliver_completions(now);
  }
  // The invariants of connections.h, at any time.
  void check() {
    std::multiset<std::uint32_t> of_clients;
    for (const auto& [node, device] : devices) {
      for (const auto& [address, value] : device.values()) {
        if (address.sub == 3 || (value & kNotValid) != 0) {
          continue;
        }
        const std::uint32_t id = value & 0x7FF;
        ASSERT_FALSE(can::is_restricted(id)) << "node " << int{node};
        if (pool_.has(id) && address.index >= 0x1280 && device.valid(address.index) &&
            !device.deceives(address.index)) {
          of_clients.insert(id);
        }
      }
    }
    for (const std::uint32_t id : of_clients) {
      ASSERT_EQ(of_clients.count(id), 1U) << "two clients send on " << id;
    }
  }

  ConnectionPool pool_;
  std::vector<std::string> ended_;

 public:
  EventLog events;
  can::Dispatch dispatch;
  can::TransmitQueue transmit;
  sdo::Arbiter sdo{dispatch, transmit, events};
  Connections connections{{.pool = pool_, .sdo_timeout = Milliseconds(500)}, sdo, events, *this};
};

}  // namespace linegate::manager
