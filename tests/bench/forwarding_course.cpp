// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/forwarding_course.h"

#include <algorithm>

#include <poll.h>
#include <sys/socket.h>

namespace linegate::bench {
namespace {

constexpr std::int64_t kPace = 500'000;  // ns
constexpr int kStartTries = 100;

bool readable(int descriptor, int milliseconds) {
  pollfd one{descriptor, POLLIN, 0};
  return poll(&one, 1, milliseconds) == 1;
}

can_frame status_frame(unsigned number) {
  can_frame frame{};
  frame.can_id = kForwardedIn;
  frame.len = 3;
  frame.data[0] = static_cast<std::uint8_t>(number);
  frame.data[1] = static_cast<std::uint8_t>(number >> 8U);
  frame.data[2] = static_cast<std::uint8_t>(number % 7);
  return frame;
}

void send_frame(int descriptor, const can_frame& frame) {
  require(::send(descriptor, &frame, sizeof frame, 0) == sizeof frame, "a frame was not sent");
}

}  // namespace

void Course::between(int in, int out) {
  in_ = in;
  out_ = out;
}

std::int64_t Course::cpu() const {
  std::int64_t sum = 0;
  for (const ThreadClock* clock : clocks_) {
    sum += clock->now();
  }
  return sum;
}

std::int64_t Course::pass(unsigned number) const {
  const can_frame frame = status_frame(number);
  const std::int64_t begin = read_clock(CLOCK_MONOTONIC);
  send_frame(in_, frame);
  can_frame came{};
  require(readable(out_, 1000), "nothing was forwarded");
  require(recv(out_, &came, sizeof came, 0) == sizeof came, "nothing was read");
  const std::int64_t end = read_clock(CLOCK_MONOTONIC);
  require(came.can_id == kForwardedOut && came.data[0] == frame.data[0] &&
              came.data[1] == frame.data[1] && came.data[2] == frame.data[2],
          "something else was forwarded");
  return end - begin;
}

void Course::start_nodes() const {
  can_frame start{};
  start.len = 2;
  start.data[0] = 1;
  bool forwarded = false;
  for (int i = 0; i < kStartTries && !forwarded; ++i) {
    send_frame(in_, start);
    send_frame(out_, start);
    send_frame(in_, status_frame(0));
    can_frame came{};
    while (!forwarded && readable(out_, 50)) {
      require(recv(out_, &came, sizeof came, 0) > 0, "the peer closed the socket");
      forwarded = came.can_id == kForwardedOut;
    }
  }
  require(forwarded, "the lines forward nothing");
  can_frame ignored{};
  while (readable(out_, 100)) {
    require(recv(out_, &ignored, sizeof ignored, 0) > 0, "the peer closed the socket");
  }
}

void send_on(int descriptor, can_frame frame) {
  frame.can_id = kForwardedOut;
  send_frame(descriptor, frame);
}

double measure_forwarding(const Course& course, std::size_t frames, ForwardingFigures& figures) {
  std::vector<std::int64_t> latencies;
  const std::int64_t before = course.cpu();
  Pacer pacer(kPace);
  for (std::size_t i = 0; i < frames; ++i) {
    pacer.wait();
    latencies.push_back(course.pass(static_cast<unsigned>(i)));
  }
  figures.cpu.push_back(static_cast<double>(course.cpu() - before) / static_cast<double>(frames));
  std::sort(latencies.begin(), latencies.end());
  figures.p99.push_back(static_cast<double>(latencies[frames * 99 / 100]));
  return static_cast<double>(latencies[frames / 2]);
}

Contestant beside(const Contestant& one, std::vector<double> figures) {
  figures.erase(figures.begin());
  return {one.name, {}, std::move(figures)};
}

}  // namespace linegate::bench
