// SPDX-License-Identifier: Apache-2.0
// A process that sends on several wires at once, like as many full buses: open-loop, at a fixed
// rate, whether or not the frames are read.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <sys/types.h>

#include "tests/bench/wire.h"

namespace linegate::bench {

// The rate of 8-byte frames with random data on a full bus at 1 Mbit/s.
inline constexpr std::int64_t kFramesPerSecond = 8757;

// The 8 bytes of a PDO: the number of the frame among those of the same PDO, from 1, and its
// complement, so that a value composed of two frames is detected.
std::uint64_t numbered(std::uint32_t number);
// Returns false if the bytes are from two frames. number 0: the image before the first frame.
bool number_of(std::uint64_t value, std::uint32_t& number);

struct SenderReport {
  std::uint64_t sent = 0;     // frames that the socket accepted
  std::uint64_t refused = 0;  // frames lost because the socket was full, as on a real bus
};

class LoadSender {
 public:
  // Forks, so it must be called before the program has a second thread. pdos: as for
  // pdo_identifiers(). The devices of the PDOs (8 PDOs each) answer on every wire from now on,
  // until go().
  LoadSender(const std::vector<std::unique_ptr<Wire>>& wires, std::size_t pdos);
  ~LoadSender();
  LoadSender(const LoadSender&) = delete;
  LoadSender& operator=(const LoadSender&) = delete;

  // Waits until the devices have answered all requests. Call it once, before go().
  void wait_ready() const;
  // Sends for `seconds`, the PDOs of a wire in turn. leave_out: one in this many frames of a wire
  // gets a number as if a frame had preceded it, to show that a loss is noticed; 0: none.
  void go(std::uint32_t seconds, std::uint32_t leave_out) const;
  // Waits until all frames are sent. Returns one report for each wire. late_ns: total time for
  // which the kernel did not run the sender. A bus cannot catch up, so the frames of that time were
  // never sent.
  std::vector<SenderReport> wait(std::uint64_t& late_ns);

  pid_t process() const { return process_; }

 private:
  pid_t process_ = -1;
  std::size_t wires_;
  int to_ = -1;
  int from_ = -1;
};

}  // namespace linegate::bench
