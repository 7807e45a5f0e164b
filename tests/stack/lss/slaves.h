// SPDX-License-Identifier: Apache-2.0
// LSS slaves without the rest of a device, and messages to them.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "stack/can/transmit_queue.h"
#include "stack/lss/slave.h"

namespace linegate::lss::testing {

using Bytes = std::vector<int>;

inline Bytes bytes_of(const can::Frame& frame) {
  Bytes out;
  for (const std::byte b : frame.bytes()) {
    out.push_back(std::to_integer<int>(b));
  }
  return out;
}

inline can::Frame frame_of(std::uint32_t id, const Bytes& bytes, Duration when = {}) {
  can::Frame frame;
  frame.id = id;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    frame.data[i] = static_cast<std::byte>(bytes[i]);
  }
  frame.time = Instant{when};
  return frame;
}

inline constexpr Address kAddress{0x44332211, 0x88776655, 0xCCBBAA99, 0x100FFEED};

struct Host final : SlaveHost {
  StoreResult store(const Settings& settings) override {
    asked = settings;
    return result;
  }
  bool has_bit_timing(std::uint8_t index) const override { return index == 2 || index == 3; }
  void use_bit_timing(std::uint8_t index, Instant now) override {
    used = index;
    used_at = now;
  }

  StoreResult result = StoreResult::stored;
  Settings asked;
  int used = -1;
  Instant used_at{};
};

// One slave after power-on.
struct Subject {
  explicit Subject(Settings kept = {}, Address address = kAddress) : slave(address, &host) {
    slave.power_on(kept);
  }

  // The responses to a frame on 7E5h: the bytes of each frame.
  std::vector<Bytes> say(const Bytes& bytes, Duration when = {}) {
    well_formed = slave.receive(frame_of(kMasterId, bytes, when), out);
    return answers();
  }
  std::vector<Bytes> answers() {
    std::vector<Bytes> all;
    can::Frame frame;
    while (out.pop(frame)) {
      right_id = right_id && frame.id == kSlaveId && frame.flags == 0;
      all.push_back(bytes_of(frame));
    }
    return all;
  }
  void configuration() { say({0x04, 1, 0, 0, 0, 0, 0, 0}); }
  void waiting() { say({0x04, 0, 0, 0, 0, 0, 0, 0}); }

  Host host;
  Slave slave;
  can::TransmitQueue out{8};
  bool well_formed = true;
  bool right_id = true;
};

}  // namespace linegate::lss::testing
