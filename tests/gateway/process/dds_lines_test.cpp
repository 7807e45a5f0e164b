// SPDX-License-Identifier: Apache-2.0
// Invariant: whatever the DDS process does, the lines go on: each forwarded value arrives, each
// routed SDO is answered, no SYNC is missing, and the outputs of a client that the gateway no
// longer receives react to their watchdog.
#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/gateway/process/bus_station.h"
#include "tests/gateway/process/dds_process_fixture.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

struct Fault {
  int signal;  // see dds_faults.cpp
  const char* name;
  bool hangs = false;
  // No output of a client is received until the process is replaced.
  bool is_deaf = false;
};

const std::array kFaults{
    Fault{SIGKILL, "kill -9"},
    Fault{SIGABRT, "abort"},
    Fault{SIGSEGV, "segmentation fault"},
    Fault{SIGSTOP, "stop", true, true},
    Fault{SIGUSR1, "endless loop for a datagram", true},
    Fault{SIGRTMIN, "endless loop with locks", true},
    Fault{SIGRTMIN + 1, "endless loop in a timer", true},
    Fault{SIGRTMIN + 2, "damaged reports"},
    Fault{SIGUSR2, "use of all memory"},
};

class DdsLinesTest : public DdsFaultsTest {
 protected:
  struct Row {
    int count = 0;
    Duration found{};  // the longest, with the delays of a busy machine
    Duration back{};
  };
  static constexpr Duration kWatchdog = 300ms;

  void SetUp() override {
    DdsFaultsTest::SetUp();
    ASSERT_TRUE(gateway_->reload(make_plant(text() + BusStation::lines(port_))).done);
    ASSERT_TRUE(meanwhile([&] {
      return station_.seen().operational && strict_.lines.contains("press") &&
             strict_.lines.contains("hall") && strict_.layouts.contains("hall/outputs");
    }));
    const image::Layout& layout = strict_.layouts["hall/outputs"];
    const auto valve = std::ranges::find_if(layout.entries, [](const image::Entry& entry) {
      return entry.node == BusStation::kValve && entry.index == 0x6200 && entry.sub == 1;
    });
    ASSERT_NE(valve, layout.entries.end());
    write_.layout_id = layout.id;
    write_.values = {
        {.entry = static_cast<std::uint32_t>(valve - layout.entries.begin()), .length = 1}};
    ASSERT_TRUE(meanwhile([&] { return values() > 10 && reads() > 10; }));
    for (const char* const line : {"press", "hall"}) {
      lost_[line] = strict_.lines[line].counters.heartbeats_lost;
    }
  }

  std::size_t values() const { return station_.seen().values.size(); }
  std::size_t reads() const { return station_.seen().reads.size(); }
  // As meanwhile(), while the client writes its output again and again.
  bool writing(const std::function<bool()>& condition, Duration most = kPatience) {
    return meanwhile(
        [&] {
          client_->write_outputs(at("hall"), write_);
          return condition();
        },
        most);
  }
  // The output has another value than 0, under the supervision of the watchdog. It may react before
  // a busy machine has run the client again.
  void arm() {
    const auto has_value = [&] { return std::byte{station_.valve()} == write_.values[0].data[0]; };
    bool armed = false;
    for (int i = 0; i < 4 && !armed; ++i) {
      ++write_.arming;
      write_.values[0].data[0] = std::byte{static_cast<std::uint8_t>(1 + write_.arming % 255)};
      armed = writing(has_value, 5s);
    }
    ASSERT_TRUE(armed);
    changes_before_ = station_.seen().valve.size();
  }
  static std::size_t between(const std::vector<BusStation::Course>& courses, Instant begin,
                             Instant end) {
    return static_cast<std::size_t>(
        std::ranges::count_if(courses, [&](const BusStation::Course& course) {
          return course.begin >= begin && course.end <= end;
        }));
  }

  // The lines work while the process hangs, and when another one has replaced it, which serves the
  // client.
  void expect_lines_go_on(const Fault& fault) {
    SCOPED_TRACE(fault.name);
    arm();
    const pid_t present = dds_process();
    const Instant begin = monotonic_now();
    kill(present, fault.signal);
    ASSERT_TRUE(writing([&] { return dds_process() != present; }));
    const Instant replaced = monotonic_now();
    const BusStation::Seen until_replaced = station_.seen();
    ASSERT_TRUE(read().reply.ok());
    note(fault, replaced - begin, monotonic_now() - replaced);
    if (fault.hangs) {  // found after 1.5 s
      EXPECT_GT(between(until_replaced.values, begin, replaced), 3U);
      EXPECT_GT(between(until_replaced.reads, begin, replaced), 3U);
    }
    const BusStation::Seen seen = station_.seen();
    ASSERT_TRUE(writing([&] {
      const BusStation::Seen then = station_.seen();
      return then.values.size() > seen.values.size() + 3 &&
             then.reads.size() > seen.reads.size() + 3;
    }));
    if (fault.is_deaf) {
      EXPECT_EQ(until_replaced.valve.back().value, 0) << "the watchdog, before DDS is back";
    }
    expect_no_old_value();
  }
  // After its reaction the watchdog waits for another arming number, which the client does not send
  // yet: the output becomes 0 once, or not at all.
  void expect_no_old_value() {
    writing([] { return false; }, 200ms);
    const std::vector<BusStation::Change> valve = station_.seen().valve;
    EXPECT_LE(valve.size(), changes_before_ + 1) << "an old value came back";
    EXPECT_TRUE(valve.size() == changes_before_ || valve.back().value == 0);
  }

  void note(const Fault& fault, Duration found, Duration back) {
    Row& row = table_[fault.name];
    ++row.count;
    row.found = std::max(row.found, found);
    row.back = std::max(row.back, back);
  }
  void print_table() const {
    for (const auto& [name, row] : table_) {
      std::cout << name << ": " << row.count << ", replaced within " << row.found / 1ms
                << " ms, a request is answered within " << row.back / 1ms << " ms more\n";
    }
  }

  void expect_nothing_lost() {
    pass(1500ms);  // the states of the lines are published once a second
    station_.stop();
    const BusStation::Seen seen = station_.seen();
    EXPECT_EQ(seen.unexpected_values, 0);
    EXPECT_EQ(seen.unexpected_answers, 0);
    ASSERT_GT(seen.syncs.size(), 2U);
    for (std::size_t i = 1; i < seen.syncs.size(); ++i) {
      EXPECT_LT(seen.syncs[i] - seen.syncs[i - 1], BusStation::kSync * 7 / 4) << "SYNC " << i;
    }
    for (const auto& [line, lost] : lost_) {
      EXPECT_EQ(strict_.lines[line].counters.heartbeats_lost, lost) << line;
      EXPECT_EQ(strict_.missing_events(line), 0U) << line;
    }
    EXPECT_EQ(strict_.missing_events(""), 0U);
    EXPECT_EQ(strict_.incarnations, std::set<std::uint64_t>{kIncarnation});
    std::cout << seen.values.size() << " values forwarded, " << seen.reads.size() << " SDO routed, "
              << seen.syncs.size() << " SYNCs\n";
    print_table();
  }

  const std::uint16_t port_ = static_cast<std::uint16_t>(43'500 + test::own_domain());
  BusStation station_{port_};
  line::OutputWrite write_{
      .group = 3, .arming = 0, .watchdog = kWatchdog, .reactions = line::kZeroOutputs};
  std::map<std::string, std::uint64_t> lost_;  // heartbeats, at the beginning
  std::map<std::string, Row> table_;           // by name of the fault
  std::size_t changes_before_ = 0;             // of the output, until it was armed
};

TEST_F(DdsLinesTest, GoOnThroughEachFaultOfTheProcess) {
  for (const Fault& fault : kFaults) {
    ASSERT_NO_FATAL_FAILURE(expect_lines_go_on(fault));
  }
  expect_nothing_lost();
}

// LINEGATE_KILLS: number of faults; LINEGATE_SEED: of their kinds and times.
TEST_F(DdsLinesTest, GoOnThroughFaultsAtRandomTimes) {
  const char* const number = std::getenv("LINEGATE_KILLS");
  const char* const chosen = std::getenv("LINEGATE_SEED");
  const int kills = number == nullptr ? 10 : std::atoi(number);
  const std::uint64_t seed = chosen == nullptr ? std::random_device()() : std::stoull(chosen);
  std::cout << kills << " faults, LINEGATE_SEED=" << seed << '\n';
  std::mt19937_64 random(seed);
  for (int i = 0; i < kills; ++i) {
    SCOPED_TRACE("fault " + std::to_string(i));
    pass(std::chrono::milliseconds(random() % 400));
    ASSERT_NO_FATAL_FAILURE(expect_lines_go_on(kFaults[random() % kFaults.size()]));
  }
  expect_nothing_lost();
}

}  // namespace
}  // namespace linegate::gateway
