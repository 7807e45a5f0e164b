// SPDX-License-Identifier: Apache-2.0
// Two byte rings in memory that two processes share, one for each direction, and counters by which
// the second process shows that it makes progress.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "gateway/exchange/byte_ring.h"

namespace linegate::exchange {

class SharedRings {
 public:
  static constexpr std::size_t kRingBytes = std::size_t{8} << 20U;  // of each direction
  static constexpr std::size_t kCounters = 2;

  // Creates the memory. Its size is sealed: no process can truncate it, so no access to it fails.
  // Throws std::system_error.
  SharedRings();
  // Maps the memory of the process that created it. The descriptor may be closed afterwards. Throws
  // std::system_error, also if it is no such memory.
  explicit SharedRings(int descriptor);
  ~SharedRings();
  SharedRings(const SharedRings&) = delete;
  SharedRings& operator=(const SharedRings&) = delete;

  // -1 unless this object created the memory.
  int descriptor() const { return descriptor_; }

  // The ends of the process that created the memory.
  ByteRingProducer outgoing() { return {header(0), bytes(0)}; }
  ByteRingConsumer incoming() { return {header(1), bytes(1)}; }
  // The ends of the other process.
  ByteRingConsumer other_incoming() { return {header(0), bytes(0)}; }
  ByteRingProducer other_outgoing() { return {header(1), bytes(1)}; }

  // Each has one thread that increments it. A reader must not rely on its value except that it
  // changes.
  void add_progress(std::size_t counter);
  std::uint64_t progress(std::size_t counter) const;

 private:
  struct Head;
  void map(int descriptor);
  ByteRingHeader& header(std::size_t ring) const;
  std::span<std::byte> bytes(std::size_t ring) const;

  int descriptor_ = -1;
  void* memory_ = nullptr;
};

}  // namespace linegate::exchange
