// SPDX-License-Identifier: Apache-2.0
// The loop that an executor is compared with: epoll, batches of 64 with kernel stamps, nothing
// else.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <linux/can.h>
#include <sys/socket.h>

namespace linegate::bench {

class BareLoop {
 public:
  static constexpr std::size_t kBatch = 64;

  // Reads from the descriptor. The caller keeps its ownership.
  explicit BareLoop(int descriptor);
  ~BareLoop();
  BareLoop(const BareLoop&) = delete;
  BareLoop& operator=(const BareLoop&) = delete;

  // Waits until the descriptor is readable, at most `at_most` ns; negative values count as 0.
  void wait(std::int64_t at_most = 1'000'000'000);

  // Reads until nothing is left. Calls take(frame, stamp in ns of the wall clock) for each frame.
  template <class Take>
  void drain(Take take) {
    for (;;) {
      const std::size_t count = read();
      for (std::size_t i = 0; i < count; ++i) {
        take(frames_[i], stamp(i));
      }
      if (count < kBatch) {
        return;
      }
    }
  }

 private:
  std::size_t read();
  std::int64_t stamp(std::size_t i);

  int descriptor_;
  int epoll_;
  std::array<mmsghdr, kBatch> headers_{};
  std::array<iovec, kBatch> vectors_{};
  std::array<can_frame, kBatch> frames_{};
  struct alignas(cmsghdr) Control {
    std::array<std::byte, CMSG_SPACE(sizeof(timespec))> bytes;
  };
  std::array<Control, kBatch> controls_{};
};

}  // namespace linegate::bench
