// SPDX-License-Identifier: Apache-2.0
// The courses on which forwarding is measured: frames enter at one end and leave at the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <linux/can.h>

#include "tests/bench/clock.h"
#include "tests/bench/measure.h"
#include "tests/bench/wire.h"

namespace linegate::bench {

inline constexpr std::uint32_t kForwardedIn = 0x185;
inline constexpr std::uint32_t kForwardedOut = 0x205;

class Course {
 public:
  virtual ~Course() = default;

  // Sum of the CPU times of all clocks, in ns.
  std::int64_t cpu() const;
  // Sends a frame and returns the time in ns until it has been read at the far end.
  std::int64_t pass(unsigned number) const;

 protected:
  // Sets the sockets on which frames are sent and read. The caller keeps their ownership.
  void between(int in, int out);
  void count(const ThreadClock& clock) { clocks_.push_back(&clock); }
  // Starts the nodes of forwarding lines and waits until a frame leaves the course. Discards all
  // other frames.
  void start_nodes() const;

 private:
  int in_ = -1;
  int out_ = -1;
  std::vector<const ThreadClock*> clocks_;
};

// A course on socket pairs.
class WiredCourse : public Course {
 public:
  WiredCourse() { between(in.near(), out.near()); }

 protected:
  Wire in;
  Wire out;
};

// Sends a frame like a loop: the same data with the other identifier.
void send_on(int descriptor, can_frame frame);

// One figure for each repetition.
struct ForwardingFigures {
  std::vector<double> p99;  // ns
  std::vector<double> cpu;  // ns per frame
};

// Sends `frames` frames at 2000 a second. Returns the median latency in ns, and appends to the
// figures.
double measure_forwarding(const Course& course, std::size_t frames, ForwardingFigures& figures);

// Returns the figures as those of a contestant, without the warm-up repetition.
Contestant beside(const Contestant& one, std::vector<double> figures);

}  // namespace linegate::bench
