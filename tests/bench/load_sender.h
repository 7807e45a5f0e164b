// SPDX-License-Identifier: Apache-2.0
// A process of its own that sends on several wires at once like so many full buses: open-loop, at a
// fixed rate, whether anybody reads or not.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <sys/types.h>

#include "tests/bench/wire.h"

namespace linegate::bench {

// 8-byte frames with random data on a bus at 1 Mbit/s.
inline constexpr std::int64_t kFramesPerSecond = 8757;

// What stands in the 8 bytes of a PDO: the number of the frame among those of the same PDO, from 1,
// and its complement, so that a frame put together from two is found out.
std::uint64_t numbered(std::uint32_t number);
// Nothing if the bytes are of two frames; 0 is what an image has before the first.
bool number_of(std::uint64_t value, std::uint32_t& number);

struct SenderReport {
  std::uint64_t sent = 0;     // frames taken by the socket
  std::uint64_t refused = 0;  // the socket was full: lost, as on a real bus
};

class LoadSender {
 public:
  // Forks: to be called before the program has a second thread. pdos: as in pdo_identifiers(). The
  // devices that the PDOs belong to (8 PDOs each) answer on every wire from now on, until go().
  LoadSender(const std::vector<std::unique_ptr<Wire>>& wires, std::size_t pdos);
  ~LoadSender();
  LoadSender(const LoadSender&) = delete;
  LoadSender& operator=(const LoadSender&) = delete;

  // Until the devices have answered all that was asked; once, before go().
  void wait_ready() const;
  // Sends for that long, every PDO of a wire in turn. leave_out: of so many frames of a wire one is
  // numbered as if there had been another before it; 0 = none. To show that it would be noticed.
  void go(std::uint32_t seconds, std::uint32_t leave_out) const;
  // One of each wire, when all was sent. late_ns: for so long altogether the sender itself was not
  // run by the kernel: a bus cannot catch up, so those frames were never sent.
  std::vector<SenderReport> wait(std::uint64_t& late_ns);

  pid_t process() const { return process_; }

 private:
  pid_t process_ = -1;
  std::size_t wires_;
  int to_ = -1;
  int from_ = -1;
};

}  // namespace linegate::bench
