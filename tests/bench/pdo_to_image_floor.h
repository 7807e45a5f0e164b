// SPDX-License-Identifier: Apache-2.0
// The floor under "received PDO -> image": what any program has to do that finds the place of a
// frame's values by its identifier, copies them and keeps the same marks. No protocol: no lengths,
// no remote frames, no deadlines, no bits, no counters.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/can/frame.h"

namespace linegate::bench {

// One image of `pdos` PDOs of 8 bytes, one after the other.
class Floor {
 public:
  // ids: identifier of PDO 0, 1, ...; each below 800h.
  explicit Floor(std::span<const std::uint32_t> ids);

  // Returns the number of frames taken.
  std::uint64_t receive(std::span<const can::Frame> frames);
  // As synchronous PDOs have it: the newest values of each wait until SYNC (080h), which puts them
  // into the image. Returns the number of frames taken, without those that wait.
  std::uint64_t receive_synchronous(std::span<const can::Frame> frames);

  // Bytes and marks, so that nothing can be left out.
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
    std::uint32_t count = 0;  // frames since SYNC; 0 = none
    std::uint32_t plan = 0;
  };
  void put(const Plan& plan, std::uint64_t after, std::int64_t time, std::uint32_t count);
  std::uint64_t commit();

  std::vector<std::uint16_t> plan_of_;  // by identifier; 0 = none
  std::vector<Plan> plans_;
  std::vector<std::byte> image_;
  std::vector<std::byte> dirty_;
  std::vector<std::uint64_t> generations_;
  std::vector<Mark> marks_;
  std::vector<std::uint64_t> touched_;
  std::vector<Held> held_;  // the first held_count_ of them, in the order of their first frames
  std::vector<std::uint32_t> place_;  // by PDO: in held_ from 1 on; 0 = none
  std::size_t held_count_ = 0;
  std::uint64_t generation_ = 1;
};

}  // namespace linegate::bench
