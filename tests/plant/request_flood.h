// SPDX-License-Identifier: Apache-2.0
// A line at 125 kbit/s whose requests pass a RequestBudget, as in the gateway; floods of a client,
// and another client that reads meanwhile.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "bridges/sim/program_memory.h"
#include "stack/can/cob_id.h"
#include "stack/line/frame_bits.h"
#include "stack/line/request_budget.h"

#include "tests/plant/manager_fixture.h"

namespace linegate::plant {

inline constexpr std::uint32_t kBitRate = 125'000;
inline constexpr Duration kTick = 200us;  // 5,000 a second
inline constexpr Duration kSync = 20ms;
inline constexpr Duration kHeartbeat = 100ms;
inline constexpr std::array<std::uint8_t, 3> kNodes{5, 6, 7};
inline constexpr std::uint32_t kHostile = 1;
inline constexpr std::uint32_t kOther = 2;

inline constexpr std::int64_t kClientRate = kBitRate * 15 / 100;
// Of the account, the same for a transfer for which the other client waits, one request, and the
// responses under way.
inline constexpr std::int64_t kMostAhead = 2 * (kClientRate / 40) + 5 * 122;
// At a node whose server is in use the other client waits for the end of a transfer: a name of
// several segments is the longest that a scan reads.
inline constexpr int kWithATransfer = 5;

inline line::ProgramDownload long_program() {
  return {.node = 7, .number = 1, .program = sim::make_program(2, std::vector<std::byte>(50'000))};
}

// A base, because the budget outlives the line of the fixture.
struct WithBudget {
  explicit WithBudget(line::BudgetOptions options) : budget_(options) {}
  line::RequestBudget budget_;
};

class RequestFlood : protected WithBudget, public ManagerFixture {
 protected:
  explicit RequestFlood(line::BudgetOptions options = {.bit_rates = {.nominal = kBitRate}})
      : WithBudget(options) {}

  void SetUp() override {
    bus().bit_rate = kBitRate;
    config().bit_rate = kBitRate;
    config().sync_period = kSync;
    for (const std::uint8_t id : kNodes) {
      line::NodeConfig node = node_of(id, "drive");
      node.objects = {{{0x6081, 0}, number(1'000)}, {{0x6083, 0}, number(2'000)}};
      add(std::move(node), "drive");
    }
    configure();
    start();
    ASSERT_EQ(world().failure(), "");
    seat().line->set_pace(budget_);
    const image::Layout& outputs = seat().line->layout(image::Direction::outputs);
    budget_.set_outputs(outputs, std::vector<bool>(outputs.entries.size(), true));
    budget_.advance(world().now());
    begin_here();
  }
  void TearDown() override { EXPECT_EQ(world().failure(), ""); }

  // Called before the line starts, when it has its nodes.
  virtual void configure() {}

  // The checks are about the time from now on.
  void begin_here() {
    begin_ = world().now();
    first_frame_ = seat().frames.size();
    first_event_ = seat().events.size();
  }
  // Requests it for the hostile client once the last one was answered.
  void repeat(const line::Request& each) {
    if (repeated_ == 0 || seat().replies.contains(repeated_)) {
      repeated_ = request(kHostile, each);
    }
  }
  std::uint64_t request(std::uint32_t client, line::Request request) {
    line::Command command{.tag = ++tags_, .request = std::move(request)};
    command.client = client;
    if (budget_.put(command, world().now()) != line::RequestBudget::Put::queued) {
      ++busy_;
      return 0;
    }
    if (client == kHostile) {
      queued_.push_back(tags_);
    }
    return tags_;
  }
  // Replies without an error to the hostile client.
  std::size_t carried_out() {
    return static_cast<std::size_t>(std::ranges::count_if(queued_, [&](std::uint64_t tag) {
      const auto reply = seat().replies.find(tag);
      return reply != seat().replies.end() && reply->second.ok();
    }));
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
    while (const auto report = budget_.pop_report(now)) {
      reports_.push_back(*report);
    }
    world().settle();
  }
  // Reads an object of node 6 for the other client each `period` while `flood` is called each tick
  // for that time; returns the longest time from the request to its answer.
  template <class Flood>
  Duration longest_answer(Duration time, Flood flood, Duration period = 50ms) {
    Duration longest{};
    std::uint64_t tag = 0;
    Instant asked{};
    Instant due = world().now();
    for (const Instant end = world().now() + time;
         world().now() < end && world().failure().empty();) {
      flood();
      if (tag == 0 && world().now() >= due) {
        tag = request(kOther, line::SdoRead{.node = 6, .address = {0x1000, 0}});
        EXPECT_NE(tag, 0U) << "the other client is refused";
        asked = world().now();
        due = asked + period + std::chrono::microseconds(700 * (++asked_ % 64));
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
  Duration longest_gap(std::uint32_t id) { return longest_gap(seat(), first_frame_, id); }
  Duration longest_gap(const LineSeat& on, std::size_t first, std::uint32_t id) const {
    Instant last = begin_;
    Duration longest{};
    for (std::size_t i = first; i < on.frames.size(); ++i) {
      const can::Frame& frame = on.frames[i];
      if (frame.id == id && !frame.extended()) {
        longest = std::max(longest, frame.time - last);
        last = frame.time;
      }
    }
    return std::max(longest, on.frames.back().time - last);
  }
  // The most bits that the frames of some identifiers ever were ahead of that rate in bit/s: the
  // burst that an account of that rate would have needed. Node-IDs 0: NMT and LSS frames only.
  std::int64_t burst_at(std::int64_t rate, const std::set<std::uint32_t>& nodes) {
    std::int64_t burst = 0;
    std::int64_t level = 0;
    Instant last = begin_;
    frames_of_flood_ = 0;
    for (std::size_t i = first_frame_; i < seat().frames.size(); ++i) {
      const can::Frame& frame = seat().frames[i];
      const std::uint32_t node = frame.id & 0x7FU;
      const std::uint32_t base = frame.id & 0x780U;
      const bool boots = base == 0x700 && frame.length == 1 && frame.data[0] == std::byte{0};
      const bool is_sdo = base == 0x580 || base == 0x600;
      const bool is_lss = frame.id == 0x7E4 || frame.id == 0x7E5;
      if (frame.id != 0 && !is_lss && !((is_sdo || boots) && nodes.contains(node))) {
        continue;
      }
      level = std::max<std::int64_t>(level - rate * (frame.time - last).count() / 1'000'000'000, 0);
      level += line::bits_on_bus({frame.id, frame.length, frame.flags});
      burst = std::max(burst, level);
      last = frame.time;
      ++frames_of_flood_;
    }
    return burst;
  }
  // Bits of all frames on the bus from the first one of the checks on.
  std::int64_t bits_on_the_bus() {
    std::int64_t bits = 0;
    for (std::size_t i = first_frame_; i < seat().frames.size(); ++i) {
      const can::Frame& frame = seat().frames[i];
      bits += line::bits_on_bus({frame.id, frame.length, frame.flags});
    }
    return bits;
  }
  // victim: a node that the flood resets.
  void expect_services_in_time(std::uint8_t victim = 0) {
    EXPECT_LE(longest_gap(0x080), kSync + 5ms);
    for (const std::uint32_t node : kNodes) {
      if (node != victim) {
        EXPECT_LE(longest_gap(can::kErrorControlBase + node), kHeartbeat + 10ms) << node;
      }
    }
    for (std::size_t i = first_event_; i < seat().events.size(); ++i) {
      EXPECT_NE(seat().events[i].kind(), EventKind::heartbeat_lost) << int{seat().events[i].node};
      EXPECT_NE(seat().events[i].kind(), EventKind::output_watchdog);
    }
  }

  std::set<std::uint64_t> running_;    // tags
  std::vector<std::uint64_t> queued_;  // tags of the hostile client
  std::vector<event::ClientLimited> reports_;
  Instant begin_{};
  std::size_t first_frame_ = 0;
  std::size_t first_event_ = 0;
  std::uint64_t frames_of_flood_ = 0;  // of the last burst_at()
  std::uint64_t tags_ = 1'000'000;
  std::uint64_t busy_ = 0;
  std::uint64_t repeated_ = 0;
  std::int64_t asked_ = 0;
  std::uint8_t value_ = 0;
};

inline can::Frame urgent_frame() {
  can::Frame frame;
  frame.id = 0x101;  // precedes all but NMT and SYNC
  frame.length = 8;
  return frame;
}

}  // namespace linegate::plant
