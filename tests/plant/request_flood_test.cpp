// SPDX-License-Identifier: Apache-2.0
// Invariant: whatever clients request, the heartbeats and SYNC of the line are sent in time, and
// another client is answered within twice its unloaded time.
//
// A line at 125 kbit/s whose requests pass a RequestBudget, as in the gateway.
#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/line/request_budget.h"

#include "tests/plant/manager_fixture.h"

namespace linegate::plant {
namespace {

constexpr std::uint32_t kBitRate = 125'000;
constexpr Duration kTick = 200us;  // 5,000 a second
constexpr Duration kSync = 20ms;
constexpr Duration kHeartbeat = 100ms;
constexpr std::array<std::uint8_t, 3> kNodes{5, 6, 7};
constexpr std::uint32_t kHostile = 1;
constexpr std::uint32_t kOther = 2;

// A base, because the budget outlives the line of the fixture.
struct WithBudget {
  line::RequestBudget budget_{{.bit_rate = kBitRate}};
};

class RequestFlood : protected WithBudget, public ManagerFixture {
 protected:
  void SetUp() override {
    bus().bit_rate = kBitRate;
    config().bit_rate = kBitRate;
    config().sync_period = kSync;
    for (const std::uint8_t id : kNodes) {
      add(node_of(id, "drive"), "drive");
    }
    start();
    ASSERT_EQ(world().failure(), "");
    seat().line->set_pace(budget_);
    const image::Layout& outputs = seat().line->layout(image::Direction::outputs);
    budget_.set_outputs(outputs, std::vector<bool>(outputs.entries.size(), true));
    budget_.advance(world().now());
    begin_ = world().now();
    first_frame_ = seat().frames.size();
    first_event_ = seat().events.size();
  }
  void TearDown() override { EXPECT_EQ(world().failure(), ""); }

  std::uint64_t request(std::uint32_t client, line::Request request) {
    line::Command command{.tag = ++tags_, .request = std::move(request)};
    command.client = client;
    if (budget_.put(command, world().now()) != line::RequestBudget::Put::queued) {
      ++busy_;
      return 0;
    }
    return tags_;
  }
  void write_outputs(std::uint32_t client, std::uint8_t value) {
    using Admission = line::RequestBudget::Admission;
    const image::Layout& layout = seat().line->layout(image::Direction::outputs);
    line::OutputWrite write{.layout_id = layout.id, .arming = 1, .watchdog = 50ms};
    for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
      line::OutputValue out{.entry = i,
                            .length = static_cast<std::uint8_t>(layout.entries[i].bit_length / 8)};
      out.data[0] = std::byte{value};
      write.values.push_back(out);
    }
    write.client_number = client;
    const Admission admission = budget_.admits(write);
    ASSERT_NE(admission, Admission::no_place);
    if (admission == Admission::now) {
      ASSERT_EQ(seat().line->write_outputs(write, world().now()), line::OutputRefusal::none);
      budget_.applied(write);
    } else if (seat().line->feed_watchdog(write, world().now())) {
      budget_.hold(write, world().now());
    }
  }
  // What the owner of the line does in each of its rounds, for one tick.
  void tick() {
    pass(kTick);
    const Instant now = world().now();
    budget_.advance(now);
    for (auto answered = running_.begin(); answered != running_.end();) {
      if (seat().replies.contains(*answered)) {
        budget_.answered(*answered);
        answered = running_.erase(answered);
      } else {
        ++answered;
      }
    }
    for (line::RequestBudget::Admitted next; budget_.next(next, now);) {
      running_.insert(next.command.tag);
      seat().silence.commanded(next.command);
      seat().line->execute(std::move(next.command), now);
    }
    for (line::OutputWrite write; budget_.next_output(write);) {
      ASSERT_EQ(seat().line->write_outputs(write, now), line::OutputRefusal::none);
    }
    while (const auto report = budget_.take_report(now)) {
      reports_.push_back(*report);
    }
    world().settle();
  }
  // Reads an object of node 6 for the other client each 50 ms while `flood` is called each tick for
  // that time; returns the longest time from the request to its answer.
  template <class Flood>
  Duration longest_answer(Duration time, Flood flood) {
    Duration longest{};
    std::uint64_t tag = 0;
    Instant asked{};
    Instant due = world().now();
    for (const Instant end = world().now() + time; world().now() < end;) {
      flood();
      if (tag == 0 && world().now() >= due) {
        tag = request(kOther, line::SdoRead{.node = 6, .address = {0x1000, 0}});
        EXPECT_NE(tag, 0U) << "the other client is refused";
        asked = world().now();
        due = asked + 50ms + std::chrono::microseconds(700 * ++asked_);
      }
      tick();
      if (tag != 0 && seat().replies.contains(tag)) {
        EXPECT_TRUE(seat().replies[tag].ok());
        longest = std::max(longest, world().now() - asked);
        tag = 0;
      }
    }
    return longest;
  }
  // The longest time between two frames with that identifier since the flood began.
  Duration longest_gap(std::uint32_t id) {
    Instant last = begin_;
    Duration longest{};
    for (std::size_t i = first_frame_; i < seat().frames.size(); ++i) {
      const can::Frame& frame = seat().frames[i];
      if (frame.id == id && !frame.extended()) {
        longest = std::max(longest, frame.time - last);
        last = frame.time;
      }
    }
    return std::max(longest, seat().frames.back().time - last);
  }
  void expect_services_in_time() {
    EXPECT_LE(longest_gap(0x080), kSync + 5ms);
    for (const std::uint32_t node : kNodes) {
      EXPECT_LE(longest_gap(can::kErrorControlBase + node), kHeartbeat + 10ms) << node;
    }
    for (std::size_t i = first_event_; i < seat().events.size(); ++i) {
      EXPECT_NE(seat().events[i].kind(), EventKind::heartbeat_lost);
      EXPECT_NE(seat().events[i].kind(), EventKind::output_watchdog);
    }
  }

  std::set<std::uint64_t> running_;  // tags
  std::vector<event::ClientLimited> reports_;
  Instant begin_{};
  std::size_t first_frame_ = 0;
  std::size_t first_event_ = 0;
  std::uint64_t tags_ = 1'000'000;
  std::uint64_t busy_ = 0;
  std::int64_t asked_ = 0;
  std::uint8_t value_ = 0;
};

can::Frame urgent_frame() {
  can::Frame frame;
  frame.id = 0x101;  // precedes all but NMT and SYNC
  frame.length = 8;
  return frame;
}

// 5,000 a second of each kind, for 10 s.
TEST_F(RequestFlood, OfEachKindCostsNoHeartbeatAndNoSync) {
  const Duration unloaded = longest_answer(2s, [] {});
  const Duration loaded = longest_answer(10s, [&] {
    (void)request(kHostile, line::NmtRequest{.node = 5, .command = nmt::Command::start});
    (void)request(kHostile, line::CanSend{.frame = urgent_frame()});
    (void)request(kHostile, line::SdoRead{.node = 5, .address = {0x1000, 0}});
    (void)request(kHostile, line::SdoRead{.node = 6, .address = {0x1018, 1}});
    write_outputs(kHostile, ++value_);
  });
  EXPECT_GT(unloaded, Duration::zero());
  EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns, unloaded " << unloaded.count();
  expect_services_in_time();
  EXPECT_GT(busy_, 150'000U);
  ASSERT_FALSE(reports_.empty());
  EXPECT_LE(reports_.size(), 2U);
  for (const event::ClientLimited& report : reports_) {
    EXPECT_EQ(report.client, kHostile);
    EXPECT_GT(report.refused, 0U);
    EXPECT_GT(report.replaced, 0U);
  }
}

// A flood of one kind alone, on each service.
TEST_F(RequestFlood, OfOneKindCostsNoHeartbeatAndNoSync) {
  const Duration unloaded = longest_answer(1s, [] {});
  const std::vector<line::Request> kinds{
      line::NmtRequest{.node = 5, .command = nmt::Command::start},
      line::CanSend{.frame = urgent_frame()},
      line::SdoRead{.node = 6, .address = {0x1018, 2}},
      line::EmcySend{.code = 0x1000},
      line::PdoTrigger{.node = 5, .number = 1},
  };
  for (const line::Request& kind : kinds) {
    const Duration loaded = longest_answer(2s, [&] { (void)request(kHostile, kind); });
    EXPECT_LE(loaded, 2 * unloaded) << name(line::kind(kind)) << ' ' << loaded.count() << " ns";
  }
  const Duration loaded = longest_answer(2s, [&] { write_outputs(kHostile, ++value_); });
  EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns";
  expect_services_in_time();
}

// Segmented transfers with several devices at once would fill the bus: each sends its next frame
// as soon as it was answered.
TEST_F(RequestFlood, LongTransfersAreSlowedDown) {
  std::uint64_t frames = 0;
  const std::size_t before = seat().frames.size();
  const Instant begin = world().now();
  (void)longest_answer(5s, [&] {
    (void)request(kHostile, line::SdoRead{.node = 5, .address = {0x1008, 0}});
    (void)request(kHostile, line::SdoRead{.node = 7, .address = {0x1008, 0}});
  });
  for (std::size_t i = before; i < seat().frames.size(); ++i) {
    const std::uint32_t id = seat().frames[i].id;
    frames += id == 0x605 || id == 0x585 || id == 0x607 || id == 0x587 ? 1U : 0U;
  }
  const auto bits = static_cast<double>(frames) * 122;
  const double seconds = std::chrono::duration<double>(world().now() - begin).count();
  EXPECT_LE(bits, kBitRate * 0.15 * (seconds + 0.05) + 4 * 122);
  EXPECT_GE(bits, kBitRate * 0.15 * seconds * 0.8) << "the share can be used";
  expect_services_in_time();
}

}  // namespace
}  // namespace linegate::plant
