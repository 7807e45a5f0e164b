// SPDX-License-Identifier: Apache-2.0
// A PDO that is forwarded from one SocketCAN interface to another, compared with the kernel's own
// gateway (can-gw) and a loop that reads one socket and writes the other. Runs in the guest, see
// forwarding_in_guest.sh:
//
//   measure_forwarding_guest [--short] KERNEL_IN KERNEL_OUT LOOP_IN LOOP_OUT LINES_IN LINES_OUT
//
// A rule of can-gw connects the first pair of interfaces, and changes 185h to 205h like the others.
// --short: two repetitions, which only show that it works.
#include <array>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridges/can/socketcan.h"

#include "tests/bench/bare_loop.h"
#include "tests/bench/forwarding_course.h"
#include "tests/bench/forwarding_lines.h"
#include "tests/bench/measure.h"

namespace {

using namespace linegate;
using bench::Contestant;
using bench::require;

constexpr std::size_t kFrames = 100;  // in one repetition

// Receives only that identifier; absent: receives nothing.
int open_raw(const std::string& interface, std::optional<std::uint32_t> identifier) {
  const int descriptor = ::socket(AF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  require(descriptor >= 0, "the kernel has no CAN");
  const can_filter filter{identifier.value_or(0), CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG};
  const socklen_t size = identifier ? sizeof filter : 0;
  require(setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_FILTER, &filter, size) == 0, "no filter");
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  require(address.can_ifindex != 0 &&
              bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0,
          "there is no interface " + interface);
  return descriptor;
}

// The ends of a course on two interfaces, which is all that can-gw needs.
class OnInterfaces : public bench::Course {
 public:
  OnInterfaces(const std::string& in, const std::string& out)
      : in_(open_raw(in, std::nullopt)), out_(open_raw(out, bench::kForwardedOut)) {
    between(in_, out_);
  }
  ~OnInterfaces() override {
    close(in_);
    close(out_);
  }

 private:
  int in_;
  int out_;
};

class Loop final : public OnInterfaces {
 public:
  Loop(const std::string& in, const std::string& out)
      : OnInterfaces(in, out),
        from_(open_raw(in, bench::kForwardedIn)),
        to_(open_raw(out, std::nullopt)),
        thread_([this] { run(); }) {
    const int on = 1;
    require(setsockopt(from_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) == 0, "no stamps");
  }
  ~Loop() override {
    stop_ = true;
    thread_.join();
    close(from_);
    close(to_);
  }

 private:
  void run() {
    bench::BareLoop loop(from_);
    while (!stop_) {
      loop.wait();
      loop.drain([&](const can_frame& frame, std::int64_t) { bench::send_on(to_, frame); });
    }
  }

  int from_;
  int to_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class Lines final : public OnInterfaces {
 public:
  Lines(const std::string& in, const std::string& out)
      : OnInterfaces(in, out),
        lines_({can_bridge::open_socketcan(in, {}), can_bridge::open_socketcan(out, {})}, true) {
    start_nodes();
  }

 private:
  bench::ForwardingLines lines_;
};

void print(const char* what, const std::vector<Contestant>& all) {
  bench::print_heading(std::string("PDO forwarded from interface to interface, in the guest: ") +
                       what);
  for (const Contestant& one : all) {
    char note[64];
    std::snprintf(note, sizeof note, ", %.2f x can-gw", bench::median_ratio(one, all.front()));
    bench::print_figure(one, "ns", note);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> names(argv + 1, argv + argc);
  const bool few = !names.empty() && names.front() == "--short";
  if (few) {
    names.erase(names.begin());
  }
  require(names.size() == 6, "six interfaces are needed");
  const OnInterfaces kernel(names[0], names[1]);
  const Loop loop(names[2], names[3]);
  const Lines lines(names[4], names[5]);

  const std::array<const bench::Course*, 3> courses = {&kernel, &loop, &lines};
  const std::array<const char*, 3> titles = {"can-gw, in the kernel", "one thread, two sockets",
                                             "Linegate, within an executor"};
  std::array<bench::ForwardingFigures, 3> figures;
  std::vector<Contestant> contestants;
  for (std::size_t i = 0; i < courses.size(); ++i) {
    contestants.push_back(
        {titles[i],
         [&, i] { return bench::measure_forwarding(*courses[i], kFrames, figures[i]); },
         {}});
  }
  bench::interleave(contestants, few ? 2 : bench::kRepetitions);
  print("latency p50", contestants);
  std::vector<Contestant> late;
  for (std::size_t i = 0; i < courses.size(); ++i) {
    late.push_back(bench::beside(contestants[i], figures[i].p99));
  }
  print("latency p99", late);
}
