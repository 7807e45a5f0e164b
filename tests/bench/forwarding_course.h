// SPDX-License-Identifier: Apache-2.0
// What forwarding is measured on: frames go in at one end and come out at another.
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

  // CPU time of all clocks, ns.
  std::int64_t cpu() const;
  // From before a frame is sent to when it has been read at the far end, in ns.
  std::int64_t pass(unsigned number) const;

 protected:
  // Sockets on which frames are sent, and read; they stay the caller's.
  void between(int in, int out);
  void count(const ThreadClock& clock) { clocks_.push_back(&clock); }
  // Starts the nodes of forwarding lines: until a frame comes out. What else they say is dropped.
  void start_nodes() const;

 private:
  int in_ = -1;
  int out_ = -1;
  std::vector<const ThreadClock*> clocks_;
};

// On socket pairs.
class WiredCourse : public Course {
 public:
  WiredCourse() { between(in.near(), out.near()); }

 protected:
  Wire in;
  Wire out;
};

// What a loop does with a frame: the same data under the other identifier.
void send_on(int descriptor, can_frame frame);

// Of one repetition each.
struct ForwardingFigures {
  std::vector<double> p99;  // ns
  std::vector<double> cpu;  // ns a frame
};

// So many frames at 2000 a second. Gives the median latency in ns, and adds to the figures.
double measure_forwarding(const Course& course, std::size_t frames, ForwardingFigures& figures);

// The figures as those of a contestant; the repetition that does not count is left out.
Contestant beside(const Contestant& one, std::vector<double> figures);

}  // namespace linegate::bench
