// SPDX-License-Identifier: Apache-2.0
// The frames of a TPDO that were handed out to the bus and are not acknowledged yet: the oldest,
// the newest, and the bits that were sampled differently since each of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/byte_order.h"
#include "stack/can/frame.h"

namespace linegate::pdo {

class ValuesUnderWay {
 public:
  using Data = std::array<std::byte, can::kMaxFdData>;

  bool any() const { return oldest_.number != 0; }
  void clear() { oldest_.number = 0; }

  // A frame with the last sample was handed out. number: ascending.
  void handed_out(std::uint64_t number, const Data& data) {
    newest_ = {number, data, {}};
    if (!any()) {
      oldest_ = newest_;
    }
  }

  // A different sample was taken, to be sent. bytes: length of the PDO; the bytes behind it are
  // always 0.
  void sampled(const Data& data, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; i += 8) {
      oldest_.mark(data, i);
      newest_.mark(data, i);
    }
  }

  // The frames up to that number are acknowledged. Returns false if none of them is stored here.
  // differs: the bits of `now`, the present values, that the receivers may not have; they have all
  // others.
  bool acknowledged(std::uint64_t number, const Data& now, Data& differs) {
    if (!any() || oldest_.number > number) {
      return false;
    }
    const bool all = newest_.number <= number;
    Frame& had = all ? newest_ : oldest_;
    for (std::size_t i = 0; i < now.size(); i += 8) {
      had.mark(now, i);
    }
    differs = had.differs;
    if (all) {
      clear();
    } else {
      oldest_ = newest_;
    }
    return true;
  }

  // Whether the oldest or the newest frame is in first .. last.
  bool any_of(std::uint64_t first, std::uint64_t last) const {
    const auto is_one = [&](std::uint64_t number) { return number >= first && number <= last; };
    return any() && (is_one(oldest_.number) || is_one(newest_.number));
  }

 private:
  struct Frame {
    // Marks the differing bits of eight bytes from i on.
    void mark(const Data& other, std::size_t i) {
      const auto mine = load_le<std::uint64_t>(data.data() + i);
      const auto its = load_le<std::uint64_t>(other.data() + i);
      const auto marked = load_le<std::uint64_t>(differs.data() + i);
      store_le(differs.data() + i, marked | (mine ^ its));
    }

    std::uint64_t number = 0;  // 0 = none
    Data data{};
    Data differs{};  // bits that were sampled differently since
  };
  Frame oldest_;
  Frame newest_;
};

}  // namespace linegate::pdo
