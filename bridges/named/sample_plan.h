// SPDX-License-Identifier: Apache-2.0
// Writes the samples of a named topic as CDR, by a plan that is made once from its type.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "bridges/named/device_types.h"
#include "stack/image/snapshot.h"

namespace linegate::named {

// The members of a sample that the process image does not have. Times are UTC in nanoseconds since
// 1970, 0 = never.
struct SampleHead {
  std::uint64_t incarnation = 0;
  std::uint64_t sequence_number = 0;
  std::int64_t time = 0;
  std::uint8_t clock = 0;
  std::span<const std::int64_t> pdo_times;  // as many as DeviceType::pdos
  // Outputs: of each member why it is not valid, if it is not; without any, it is not known.
  std::span<const std::uint8_t> waits{};
};

class SamplePlan {
 public:
  SamplePlan(const DeviceType& type, std::string_view gateway);

  // The greatest size of a sample in octets, including its encapsulation header.
  std::size_t max_size() const { return max_size_; }

  // Writes a sample in CDR, little-endian (encapsulation CDR_LE of RTPS 2.3, 10.2), and returns its
  // size. `to` has at least max_size() octets. Does not allocate. Preconditions: the snapshot has
  // the layout that the type was made from; there are no waits, or as many as members.
  std::size_t write(const SampleHead& head, const image::Snapshot& snapshot,
                    std::span<std::byte> to) const;

  // Its key in CDR, big-endian, without a header: what the key hash of its instance is made from
  // (RTPS 2.3, 9.6.3.8). Empty for a topic without a key.
  const std::vector<std::byte>& key() const { return key_; }

 private:
  struct Step {
    Form form;
    Reading reading;
    std::uint16_t length;
    std::uint16_t bit_length;
    std::uint32_t bit_offset;
    std::uint32_t entry;
  };

  std::vector<std::byte> prefix_;  // encapsulation, gateway and line
  std::vector<std::byte> key_;
  std::vector<Step> steps_;
  bool is_input_ = true;
  std::size_t max_size_ = 0;
};

}  // namespace linegate::named
