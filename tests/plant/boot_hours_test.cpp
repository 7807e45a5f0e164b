// SPDX-License-Identifier: Apache-2.0
// Hours of virtual time in which nodes are switched off and on, disconnected and connected at any
// time, also during their boot processes: at the end every reported state is right.
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/plant/scenario.h"

namespace linegate::plant {
namespace {

constexpr unsigned long kSeed = 20260601;

struct Coming {
  unsigned id = 0;
  bool alive = true;
  bool plugged = true;
};

class Hours {
 public:
  explicit Hours(unsigned long seed) : random_(seed) {}

  // start: additional properties of the line.
  std::string plant(const std::string& start, unsigned hours) {
    out_ << "line hall bitrate 250000 " << start << '\n';
    for (unsigned id = 1; id <= 6; ++id) {
      device(id);
      devices_.push_back({.id = id});
    }
    const std::uint64_t end = std::uint64_t{hours} * 3'600'000;
    std::uint64_t time = 10'000;
    while (time < end) {
      // most within a boot process, some long after it
      time += below(3) != 0 ? 1 + below(1'500) : below(60'000);
      out_ << "at " << time << "ms ";
      action();
    }
    for (Coming& each : devices_) {
      time += 1 + below(100);
      out_ << "at " << time << "ms node " << each.id << " plugged\n";
      out_ << "at " << time + 1 << "ms node " << each.id << " returns\n";
      time += 1;
    }
    quiet(time);
    return out_.str();
  }

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }

  void device(unsigned id) {
    out_ << "device " << id;
    if (id == 1) {
      out_ << " digital-io guarding 300ms 3";
    } else {
      out_ << " encoder heartbeat " << 300 + below(700) << "ms";
    }
    out_ << (id <= 3 ? " mandatory" : "") << " boot-timeout " << 2 + below(9) << "s\n";
  }

  void action() {
    Coming& each = devices_[below(static_cast<unsigned>(devices_.size()))];
    const bool cable = below(2) == 0;
    bool& state = cable ? each.plugged : each.alive;
    const char* const words[2][2] = {{"returns", "dies"}, {"plugged", "unplugged"}};
    out_ << "node " << each.id << ' ' << words[cable][state] << '\n';
    state = !state;
  }

  void quiet(std::uint64_t time) {
    out_ << "at " << time + 30'000 << "ms\n";
    for (const Coming& each : devices_) {
      out_ << "expect node " << each.id << " operational within 1ms\n"
           << "expect boot " << each.id << " booted within 1ms\n";
      if (each.id != 1) {
        out_ << "expect input " << each.id << ".6004:0 valid within 1s\n";
      }
    }
    out_ << "expect manager running within 1ms\nexpect own operational within 1ms\n";
  }

  std::mt19937_64 random_;
  std::ostringstream out_;
  std::vector<Coming> devices_;
};

void survive(const std::string& start, unsigned hours, unsigned long seed) {
  const std::string text = Hours(seed).plant(start, hours);
  const Outcome outcome = run_scenario("seed " + std::to_string(seed), text, seed);
  EXPECT_TRUE(outcome.ok()) << outcome.failure << "\nlast events:\n" << outcome.history;
  EXPECT_GT(outcome.frames, 10'000UL * hours);
}

TEST(BootHours, NodesThatDieAndReturnAreRightAtTheEnd) {
  survive("", 4, kSeed);
}

TEST(BootHours, NodesThatDieAndReturnAreRightAtTheEndWhereAllAreReset) {
  survive("on-error reset-all", 1, kSeed + 1);
}

TEST(BootHours, NodesThatDieAndReturnAreRightAtTheEndWhereAllStartTogether) {
  survive("start-all", 1, kSeed + 2);
}

}  // namespace
}  // namespace linegate::plant
