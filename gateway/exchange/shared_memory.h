// SPDX-License-Identifier: Apache-2.0
// Anonymous memory that two processes map. Its size is sealed, so that no access to it fails.
#pragma once

#include <cstddef>
#include <cstdint>

namespace linegate::exchange {

class SharedMemory {
 public:
  // What a process that receives the descriptor may do with the memory.
  enum class Other : std::uint8_t { reads, writes };

  // Creates it, full of zeros. Throws std::system_error.
  SharedMemory(std::size_t bytes, Other other);
  // Maps the memory of another process that created it. The descriptor may be closed afterwards.
  // Throws std::system_error, also if it is no such memory, or does not have that size.
  static constexpr std::size_t kAnySize = 0;
  SharedMemory(int descriptor, std::size_t bytes, Other self);
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  // -1 unless this object created the memory.
  int descriptor() const { return descriptor_; }
  std::size_t size() const { return size_; }
  std::byte* data() const { return static_cast<std::byte*>(memory_); }

 private:
  int descriptor_ = -1;
  std::size_t size_ = 0;
  void* memory_ = nullptr;
};

}  // namespace linegate::exchange
