// SPDX-License-Identifier: Apache-2.0
// The floor of "received PDO -> image": the minimum for any program that finds the place of a
// frame's values by its identifier, copies them and sets the same marks. It has no protocol: no
// lengths, remote frames, deadlines, bits or counters.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/can/frame.h"

namespace linegate::bench {

// One image of as many PDOs of 8 bytes as there are identifiers, one after the other.
class Floor {
 public:
  // ids: identifier of PDO 0, 1, ...; each below 800h.
  explicit Floor(std::span<const std::uint32_t> ids);

  // Returns the number of accepted frames.
  std::uint64_t receive(std::span<const can::Frame> frames);
  // For synchronous PDOs: the newest values of each PDO are held until SYNC (080h), which copies
  // them to the image. Returns the number of accepted frames without those that are held.
  std::uint64_t receive_synchronous(std::span<const can::Frame> frames);

  // Covers bytes and marks, so that the compiler can omit nothing.
  std::uint64_t checksum() const;

 private:
  struct Plan {
    std::uint32_t offset = 0;
    std::uint32_t pdo = 0;
  };
  struct Mark {
    std::int64_t time = 0;
    std::uint32_t count = 0;
    std::uint32_t valid = 0;
  };
  struct Held {
    std::uint64_t word = 0;
    std::int64_t time = 0;
    std::uint32_t count = 0;  // frames since SYNC; 0: none
    std::uint32_t plan = 0;
  };
  void put(const Plan& plan, std::uint64_t after, std::int64_t time, std::uint32_t count);
  std::uint64_t commit();

  std::vector<std::uint16_t> plan_of_;  // by identifier; 0: none
  std::vector<Plan> plans_;
  std::vector<std::byte> image_;
  std::vector<std::byte> dirty_;
  std::vector<std::uint64_t> generations_;
  std::vector<Mark> marks_;
  std::vector<std::uint64_t> touched_;
  // The first held_count_ entries are in use, in the order of their first frames.
  std::vector<Held> held_;
  std::vector<std::uint32_t> place_;  // by PDO: its place in held_, from 1; 0: none
  std::size_t held_count_ = 0;
  std::uint64_t generation_ = 1;
};

}  // namespace linegate::bench
