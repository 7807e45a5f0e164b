// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/load_sender.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <thread>

#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/bench/clock.h"
#include "tests/bench/measure.h"
#include "tests/bench/pdo_line.h"

namespace linegate::bench {
namespace {

constexpr std::size_t kPdosOfDevice = 8;
constexpr int kBootTime = 1500;  // ms
constexpr char kReady = 'r';
// If the system delays it by up to 15 ms, it sends the delayed frames at once: a burst that no bus
// produces, but the average rate is kept. After a longer delay the schedule is shifted: the delayed
// frames are never sent. Frames of each wire, less than half of a socket's queue
constexpr std::int64_t kMostBehind = 128;

// A bus does not wait for a processor, so its substitute runs before everything else, if the system
// permits a real-time priority. If not, the delay is reported.
void go_before_others() {
  const sched_param lowest{sched_get_priority_min(SCHED_FIFO)};
  (void)sched_setscheduler(0, SCHED_FIFO, &lowest);
}

template <class T>
bool put(int descriptor, const T& value) {
  return ::write(descriptor, &value, sizeof value) == ssize_t{sizeof value};
}
template <class T>
bool get(int descriptor, T& value) {
  return ::read(descriptor, &value, sizeof value) == ssize_t{sizeof value};
}

struct Job {
  std::uint32_t seconds = 0;
  std::uint32_t leave_out = 0;
};

// Sends the frames of one bus.
class Source {
 public:
  Source(int descriptor, std::size_t pdos, std::uint32_t leave_out)
      : descriptor_(descriptor),
        leave_out_(leave_out),
        ids_(pdo_identifiers(pdos)),
        numbers_(pdos, 0) {
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      vectors_[i] = {&frames_[i], sizeof(can_frame)};
      headers_[i].msg_hdr.msg_iov = &vectors_[i];
      headers_[i].msg_hdr.msg_iovlen = 1;
      frames_[i].len = 8;
    }
  }

  void send(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      frames_[i].can_id = ids_[at_];
      if (leave_out_ != 0 && ++made_ % leave_out_ == 0) {
        ++numbers_[at_];
      }
      const std::uint64_t value = numbered(++numbers_[at_]);
      std::memcpy(frames_[i].data, &value, sizeof value);
      at_ = (at_ + 1) % ids_.size();
    }
    const int sent = ::sendmmsg(descriptor_, headers_.data(), static_cast<unsigned>(count),
                                MSG_DONTWAIT | MSG_NOSIGNAL);
    const auto taken = static_cast<std::size_t>(std::max(sent, 0));
    report.sent += taken;
    report.refused += count - taken;
  }

  SenderReport report;

 private:
  int descriptor_;
  std::uint32_t leave_out_;
  std::uint32_t made_ = 0;
  std::vector<std::uint32_t> ids_;
  std::vector<std::uint32_t> numbers_;
  std::size_t at_ = 0;
  std::array<can_frame, kMostBehind> frames_{};
  std::array<iovec, kMostBehind> vectors_{};
  std::array<mmsghdr, kMostBehind> headers_{};
};

// Returns for how long, in ns, the schedule had to be shifted.
std::uint64_t send_all(std::vector<Source>& sources, std::uint32_t seconds) {
  const auto frames = std::int64_t{seconds} * kFramesPerSecond;
  std::int64_t start = read_clock(CLOCK_MONOTONIC);
  std::int64_t moved = 0;
  for (std::int64_t done = 0; done < frames;) {
    const auto due = [&](std::int64_t now) {
      return std::min(frames, (now - start) * kFramesPerSecond / 1'000'000'000 + 1);
    };
    std::int64_t count = due(read_clock(CLOCK_MONOTONIC)) - done;
    if (count > kMostBehind) {
      const std::int64_t by = (count - kMostBehind) * 1'000'000'000 / kFramesPerSecond;
      start += by;
      moved += by;
      count = kMostBehind;
    }
    if (count > 0) {
      for (Source& source : sources) {
        source.send(static_cast<std::size_t>(count));
      }
      done += count;
    }
    sleep_until(start + done * 1'000'000'000 / kFramesPerSecond);
  }
  return static_cast<std::uint64_t>(moved);
}

void play_devices(const std::vector<std::unique_ptr<Wire>>& wires, std::size_t pdos) {
  std::vector<std::jthread> threads;
  for (const auto& wire : wires) {
    threads.emplace_back(
        [&wire, pdos] { wire->play_devices(static_cast<int>(pdos / kPdosOfDevice), kBootTime); });
  }
}

[[noreturn]] void run_sender(const std::vector<std::unique_ptr<Wire>>& wires, std::size_t pdos,
                             int from, int to) {
  for (const auto& wire : wires) {
    ::close(wire->far());
  }
  play_devices(wires, pdos);
  Job job;
  if (!put(to, kReady) || !get(from, job)) {
    ::_exit(1);
  }
  std::vector<Source> sources;
  sources.reserve(wires.size());  // no reallocation: the objects contain pointers to themselves
  for (const auto& wire : wires) {
    sources.emplace_back(wire->near(), pdos, job.leave_out);
  }
  go_before_others();
  const std::uint64_t late = send_all(sources, job.seconds);
  bool good = true;
  for (const Source& source : sources) {
    good = good && put(to, source.report);
  }
  good = good && put(to, late);
  // The ends of the wires stay open until the other process has read everything.
  char last = 0;
  (void)!::read(from, &last, 1);
  ::_exit(good ? 0 : 1);
}

}  // namespace

std::uint64_t numbered(std::uint32_t number) {
  return std::uint64_t{~number} << 32U | number;
}

bool number_of(std::uint64_t value, std::uint32_t& number) {
  number = static_cast<std::uint32_t>(value);
  return value == 0 || value == numbered(number);
}

LoadSender::LoadSender(const std::vector<std::unique_ptr<Wire>>& wires, std::size_t pdos)
    : wires_(wires.size()) {
  int down[2] = {-1, -1};
  int up[2] = {-1, -1};
  require(::pipe(down) == 0 && ::pipe(up) == 0, "no pipe");
  process_ = ::fork();
  require(process_ >= 0, "the second process cannot be started");
  if (process_ == 0) {
    ::close(down[1]);
    ::close(up[0]);
    run_sender(wires, pdos, down[0], up[1]);
  }
  ::close(down[0]);
  ::close(up[1]);
  to_ = down[1];
  from_ = up[0];
}

LoadSender::~LoadSender() {
  ::close(to_);
  ::close(from_);
  ::waitpid(process_, nullptr, 0);
}

void LoadSender::wait_ready() const {
  char ready = 0;
  require(get(from_, ready) && ready == kReady, "the sender has ended");
}

void LoadSender::go(std::uint32_t seconds, std::uint32_t leave_out) const {
  require(put(to_, Job{seconds, leave_out}), "the sender has ended");
}

std::vector<SenderReport> LoadSender::wait(std::uint64_t& late_ns) {
  std::vector<SenderReport> reports(wires_);
  bool good = true;
  for (SenderReport& report : reports) {
    good = good && get(from_, report);
  }
  require(good && get(from_, late_ns), "the sender has ended");
  return reports;
}

}  // namespace linegate::bench
