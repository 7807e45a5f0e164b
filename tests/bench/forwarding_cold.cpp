// SPDX-License-Identifier: Apache-2.0
// Forwards PDOs within an executor or across two, one after the other, and evicts the data cache
// before each, like a program that runs between two frames. Measures nothing by itself: the script
// cache_lines runs it in valgrind, which counts the cache lines that the lines fetch again.
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <string_view>
#include <thread>

#include "bridges/can/socketcan.h"

#include "tests/bench/forwarding_course.h"
#include "tests/bench/forwarding_lines.h"

namespace {

using namespace linegate;

// Valgrind slows the lines down: images at the default rate would outweigh the frames.
constexpr config::Publish kNoImages{.rule = config::Publish::Rule::period,
                                    .time = std::chrono::hours(1)};
constexpr std::size_t kCacheLine = 64;
std::array<volatile std::byte, std::size_t{512} * 1024> others;  // larger than the simulated cache

class Forwarding final : public bench::WiredCourse {
 public:
  explicit Forwarding(bool together)
      : lines_(
            {can_bridge::open_on_descriptor(in.far()), can_bridge::open_on_descriptor(out.far())},
            together, {}, kNoImages) {
    start_nodes();
  }

 private:
  bench::ForwardingLines lines_;
};

void evict_cache() {
  for (std::size_t i = 0; i < others.size(); i += kCacheLine) {
    others[i] = std::byte{1};
  }
}

}  // namespace

int main(int argc, char** argv) {
  bench::require(argc == 3, "the arguments are within or across, and the number of frames");
  const Forwarding course(std::string_view(argv[1]) == "within");
  const unsigned long frames = std::strtoul(argv[2], nullptr, 10);
  for (unsigned i = 0; i < frames; ++i) {
    (void)course.pass(i);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    evict_cache();
  }
}
