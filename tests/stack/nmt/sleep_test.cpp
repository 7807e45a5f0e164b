// SPDX-License-Identifier: Apache-2.0
// The phases of sleep, by table: what each message, command and time causes in each phase.
#include "stack/nmt/sleep.h"

#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::nmt {
namespace {

using namespace std::chrono_literals;

constexpr SleepProtocol kProtocol{.request = 0x690,
                                  .objection = 0x691,
                                  .check_time = 300ms,
                                  .prepare_time = 1s,
                                  .silent_time = 2s};
constexpr std::uint8_t kOwnNode = 9;

Instant sleep_at(Duration time) {
  return Instant{} + 100s + time;
}

can::Frame sleep_frame(std::uint32_t id, std::initializer_list<std::uint8_t> data, Duration time) {
  can::Frame out = can::make_frame(id, data);
  out.time = sleep_at(time);
  return out;
}

// "phase (cause)" of each change since the last call.
std::string changes_of(Sleep& sleep) {
  std::string out;
  for (const SleepChange& change : sleep.pop_changes()) {
    out += (out.empty() ? "" : ", ") + std::string(name(change.phase)) + " (" +
           std::string(name(change.cause)) +
           (change.node == 0 ? "" : " " + std::to_string(change.node)) + ")";
  }
  return out;
}

std::string frames_of(Sleep& sleep) {
  std::string out;
  for (const can::Frame& frame : sleep.pop_frames()) {
    out += (out.empty() ? "" : " ") + std::to_string(frame.id) + ":";
    for (const std::byte octet : frame.bytes()) {
      out += std::to_string(std::to_integer<int>(octet)) + ".";
    }
  }
  return out;
}

// A node in the phase, which it entered at 0.
Sleep in_phase(SleepPhase phase, bool master) {
  Sleep sleep(kProtocol, kOwnNode);
  sleep.set_master(master, sleep_at(-5s));
  const auto ask = [&](bool checks, Duration time) {
    EXPECT_TRUE(checks ? sleep.check(true, sleep_at(time)) : sleep.prepare(sleep_at(time)));
    sleep.acknowledged(sleep_at(time));
  };
  const auto request = [&](std::uint8_t code, Duration time) {
    EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.request, {code}, time)));
  };
  switch (phase) {
    case SleepPhase::awake:
      break;
    case SleepPhase::check:
      master ? ask(true, 0s) : request(1, 0s);
      break;
    case SleepPhase::prepare:
      master ? ask(false, 0s) : request(2, 0s);
      break;
    case SleepPhase::silent:
      master ? ask(false, -1s) : request(2, -1s);
      sleep.advance(sleep_at(0s));
      break;
    case SleepPhase::asleep:
      master ? ask(false, -3s) : request(2, -3s);
      sleep.advance(sleep_at(0s));
      break;
  }
  EXPECT_EQ(sleep.phase(), phase);
  sleep.pop_changes();
  sleep.pop_frames();
  return sleep;
}

struct Row {
  SleepPhase phase;
  bool master;
  std::string input;    // what happens 100 ms after the phase began
  std::string changes;  // then
  std::string frames;   // "identifier:byte.byte." that are sent
};

void apply(Sleep& sleep, const std::string& input, bool master) {
  const auto request = [&](std::uint8_t code) {
    EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.request, {code}, 100ms)));
  };
  if (input == "check") {
    request(1);
  } else if (input == "prepare") {
    request(2);
  } else if (input == "wake") {
    request(3);
  } else if (input == "other") {
    request(77);
  } else if (input == "objection") {
    EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.objection, {4, 5}, 100ms)));
  } else if (input == "frame") {
    sleep.hear(sleep_at(100ms));
  } else if (input == "role") {
    sleep.set_master(!master, sleep_at(100ms));
  } else if (input == "command check") {
    (void)sleep.check(false, sleep_at(100ms));
  } else if (input == "command prepare") {
    (void)sleep.prepare(sleep_at(100ms));
  } else if (input == "command wake") {
    (void)sleep.wake(sleep_at(100ms));
  } else {
    sleep.advance(sleep_at(5s));
  }
}

TEST(SleepTable, EachInputInEachPhase) {
  using enum SleepPhase;
  const Row rows[] = {
      {awake, true, "check", "", ""},
      {awake, true, "prepare", "", ""},
      {awake, true, "wake", "", ""},
      {awake, true, "objection", "", ""},
      {awake, true, "frame", "", ""},
      {awake, true, "time", "", ""},
      {awake, true, "command check", "check (command)", "1680:1."},
      {awake, true, "command prepare", "prepare (command)", "1680:2."},
      {awake, true, "command wake", "", ""},
      {awake, false, "check", "check (master)", ""},
      {awake, false, "prepare", "prepare (master)", ""},
      {awake, false, "wake", "", ""},
      {awake, false, "other", "", ""},
      {check, true, "objection", "", ""},
      {check, true, "prepare", "", ""},
      {check, true, "command prepare", "", ""},
      {check, true, "command wake", "awake (command)", ""},
      {check, true, "time", "prepare (time)", "1680:2."},
      {check, true, "role", "awake (role)", ""},
      {check, false, "check", "", ""},
      {check, false, "command wake", "", ""},
      {check, false, "role", "awake (role)", ""},
      {check, false, "prepare", "prepare (master)", ""},
      {check, false, "objection", "", ""},
      {check, false, "time", "awake (time)", ""},
      {prepare, true, "objection", "awake (objection 5)", "1680:3."},
      {prepare, true, "wake", "awake (wake message)", ""},
      {prepare, true, "frame", "", ""},
      {prepare, true, "command check", "", ""},
      {prepare, true, "command wake", "awake (command)", "1680:3."},
      {prepare, true, "time", "silent (time), asleep (time)", ""},
      {prepare, false, "objection", "", ""},
      {prepare, false, "check", "", ""},
      {prepare, false, "prepare", "", ""},
      {prepare, false, "wake", "awake (wake message)", ""},
      {prepare, false, "time", "silent (time), asleep (time)", ""},
      {silent, true, "frame", "", ""},
      {silent, true, "objection", "", ""},
      {silent, true, "wake", "awake (wake message)", ""},
      {silent, true, "command wake", "awake (command)", "1680:3."},
      {silent, false, "check", "", ""},
      {silent, false, "frame", "", ""},
      {silent, false, "wake", "awake (wake message)", ""},
      {silent, false, "time", "asleep (time)", ""},
      {asleep, true, "frame", "awake (frame)", "1680:3."},
      {asleep, true, "objection", "awake (frame)", "1680:3."},
      {asleep, true, "command wake", "awake (command)", "1680:3."},
      {asleep, true, "command prepare", "", ""},
      {asleep, false, "frame", "awake (frame)", "1680:3."},
      {asleep, false, "time", "", ""},
  };
  for (const Row& row : rows) {
    Sleep sleep = in_phase(row.phase, row.master);
    apply(sleep, row.input, row.master);
    const std::string what = std::string(row.master ? "master " : "slave ") +
                             std::string(name(row.phase)) + ", " + row.input;
    EXPECT_EQ(changes_of(sleep), row.changes) << what;
    EXPECT_EQ(frames_of(sleep), row.frames) << what;
  }
}

TEST(Sleep, TimesAreThoseOfThePhases) {
  Sleep sleep(kProtocol, kOwnNode);
  EXPECT_EQ(sleep.next_wake(), kNever);
  ASSERT_TRUE(sleep.check(true, sleep_at(0s)));
  EXPECT_EQ(sleep.next_wake(), sleep_at(300ms));
  sleep.acknowledged(sleep_at(0s));
  EXPECT_EQ(sleep.next_wake(), sleep_at(300ms));
  sleep.advance(sleep_at(300ms) - 1ns);
  EXPECT_EQ(sleep.phase(), SleepPhase::check);
  sleep.advance(sleep_at(300ms));
  EXPECT_EQ(sleep.phase(), SleepPhase::prepare);
  sleep.acknowledged(sleep_at(300ms));
  EXPECT_TRUE(sleep.may_transmit());
  EXPECT_EQ(sleep.next_wake(), sleep_at(1300ms));
  sleep.advance(sleep_at(1300ms));
  EXPECT_EQ(sleep.phase(), SleepPhase::silent);
  EXPECT_FALSE(sleep.may_transmit());
  EXPECT_EQ(sleep.next_wake(), sleep_at(3300ms));
  sleep.advance(sleep_at(3300ms));
  EXPECT_EQ(sleep.phase(), SleepPhase::asleep);
  EXPECT_FALSE(sleep.may_transmit());
  EXPECT_EQ(sleep.next_wake(), kNever);
}

TEST(Sleep, ACheckCollectsEachObjection) {
  Sleep sleep(kProtocol, kOwnNode);
  ASSERT_TRUE(sleep.check(true, sleep_at(0s)));
  sleep.acknowledged(sleep_at(0s));
  for (const std::uint8_t node : {std::uint8_t{5}, std::uint8_t{127}}) {
    EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.objection, {4, node}, 100ms)));
  }
  sleep.advance(sleep_at(300ms));
  EXPECT_EQ(changes_of(sleep), "check (command), awake (objection 5)");
  EXPECT_EQ(sleep.objections().count(), 2U);
  EXPECT_EQ(frames_of(sleep), "1680:1.");
  ASSERT_TRUE(sleep.check(false, sleep_at(1s)));
  EXPECT_TRUE(sleep.objections().none()) << "those of the new check";
  sleep.acknowledged(sleep_at(1s));
  sleep.advance(sleep_at(2s));
  EXPECT_EQ(changes_of(sleep), "check (command), awake (time)") << "without prepare";
}

TEST(Sleep, TheOwnNodeOfAMasterObjects) {
  Sleep sleep(kProtocol, kOwnNode);
  sleep.set_objection(true);
  ASSERT_TRUE(sleep.check(true, sleep_at(0s)));
  sleep.acknowledged(sleep_at(0s));
  sleep.advance(sleep_at(1s));
  EXPECT_EQ(changes_of(sleep), "check (command), awake (objection 9)");
}

TEST(Sleep, ASlaveObjectsToCheckAndPrepare) {
  Sleep sleep(kProtocol, kOwnNode);
  sleep.set_master(false, sleep_at(0s));
  sleep.set_objection(true);
  EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.request, {1}, 0s)));
  EXPECT_EQ(frames_of(sleep), "1681:4.9.");
  EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.request, {2}, 100ms)));
  EXPECT_EQ(frames_of(sleep), "1681:4.9.");
  EXPECT_EQ(sleep.phase(), SleepPhase::prepare) << "the master decides";
  sleep.set_objection(false);
  EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.request, {3}, 200ms)));
  EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.request, {1}, 300ms)));
  EXPECT_EQ(frames_of(sleep), "");
}

// A message that no node has received does not count.
TEST(Sleep, WithoutAnAcknowledgementTheMasterStaysAwake) {
  Sleep sleep(kProtocol, kOwnNode);
  ASSERT_TRUE(sleep.check(true, sleep_at(0s)));
  EXPECT_TRUE(sleep.awaits_acknowledge());
  sleep.advance(sleep_at(10s));
  EXPECT_EQ(changes_of(sleep), "check (command), awake (no acknowledge)");
  EXPECT_EQ(frames_of(sleep), "1680:1.") << "no prepare";
  ASSERT_TRUE(sleep.prepare(sleep_at(10s)));
  sleep.advance(sleep_at(20s));
  EXPECT_EQ(changes_of(sleep), "prepare (command), awake (no acknowledge)");
  EXPECT_EQ(frames_of(sleep), "1680:2. 1680:3.") << "a node may have received it";
}

TEST(Sleep, TheTimeOfAMastersPhaseBeginsWithTheAcknowledgement) {
  Sleep sleep(kProtocol, kOwnNode);
  ASSERT_TRUE(sleep.check(true, sleep_at(0s)));
  sleep.acknowledged(sleep_at(299ms));
  EXPECT_FALSE(sleep.awaits_acknowledge());
  EXPECT_EQ(sleep.next_wake(), sleep_at(599ms));
  sleep.advance(sleep_at(599ms));
  EXPECT_EQ(sleep.phase(), SleepPhase::prepare);
  sleep.acknowledged(sleep_at(1s));
  EXPECT_EQ(sleep.next_wake(), sleep_at(2s));
  sleep.acknowledged(sleep_at(1900ms));
  EXPECT_EQ(sleep.next_wake(), sleep_at(2s)) << "once for each message";
}

// Its wake message may have been lost, for example with the bus.
TEST(Sleep, AnEarlierMessageOfASlaveDoesNotKeepItAwake) {
  Sleep sleep = in_phase(SleepPhase::asleep, false);
  ASSERT_TRUE(sleep.wake(sleep_at(0s)));
  EXPECT_FALSE(sleep.awaits_acknowledge());
  EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.request, {2}, 1s)));
  sleep.advance(sleep_at(10s));
  EXPECT_EQ(sleep.phase(), SleepPhase::asleep);
}

// A thread that was late passes frames that were received after the end of a phase.
TEST(Sleep, AFrameIsEvaluatedAtItsReceiveTime) {
  Sleep sleep = in_phase(SleepPhase::silent, false);
  sleep.hear(sleep_at(2s));
  EXPECT_EQ(changes_of(sleep), "") << "at the end of the silent time";
  sleep.hear(sleep_at(2s + 1ns));
  EXPECT_EQ(changes_of(sleep), "asleep (time), awake (frame)");
}

TEST(Sleep, MalformedMessagesHaveNoEffect) {
  Sleep sleep = in_phase(SleepPhase::prepare, true);
  EXPECT_FALSE(sleep.receive(sleep_frame(kProtocol.request, {}, 1ms)));
  EXPECT_FALSE(sleep.receive(sleep_frame(kProtocol.objection, {4}, 1ms)));
  EXPECT_FALSE(sleep.receive(sleep_frame(kProtocol.objection, {4, 0}, 1ms)));
  EXPECT_FALSE(sleep.receive(sleep_frame(kProtocol.objection, {4, 128}, 1ms)));
  EXPECT_FALSE(sleep.receive(sleep_frame(kProtocol.objection, {5, 5}, 1ms)));
  can::Frame remote = sleep_frame(kProtocol.request, {3}, 1ms);
  remote.flags = can::Frame::kRemote;
  EXPECT_TRUE(sleep.receive(remote));
  EXPECT_EQ(changes_of(sleep), "");
}

TEST(Sleep, BytesAreConfigured) {
  SleepProtocol protocol = kProtocol;
  protocol.check_byte = 0xA1;
  protocol.prepare_byte = 0xA2;
  protocol.wake_byte = 0xA3;
  protocol.objection_byte = 0xA4;
  Sleep master(protocol, kOwnNode);
  ASSERT_TRUE(master.check(false, sleep_at(0s)));
  master.acknowledged(sleep_at(0s));
  EXPECT_TRUE(master.receive(sleep_frame(0x691, {0xA4, 7}, 1ms)));
  master.advance(sleep_at(1s));
  ASSERT_TRUE(master.prepare(sleep_at(1s)));
  ASSERT_TRUE(master.wake(sleep_at(1s)));
  EXPECT_EQ(frames_of(master), "1680:161. 1680:162. 1680:163.");
  EXPECT_EQ(changes_of(master),
            "check (command), awake (objection 7), prepare (command), awake (command)");
}

// The acknowledgement of a message that wakes says nothing about the check that follows.
TEST(Sleep, NobodyWaitsForTheAcknowledgementOfWake) {
  Sleep sleep = in_phase(SleepPhase::asleep, true);
  ASSERT_TRUE(sleep.wake(sleep_at(0s)));
  EXPECT_EQ(frames_of(sleep), "1680:3.");
  EXPECT_FALSE(sleep.awaits_acknowledge());
  sleep.set_master(false, sleep_at(1s));
  EXPECT_TRUE(sleep.receive(sleep_frame(kProtocol.request, {1}, 2s)));
  sleep.pop_changes();
  sleep.advance(sleep_at(5s));
  EXPECT_EQ(changes_of(sleep), "awake (time)");
}

TEST(Sleep, APrepareThatIsGivenUpWakes) {
  Sleep sleep(kProtocol, kOwnNode);
  ASSERT_TRUE(sleep.prepare(sleep_at(0s)));
  EXPECT_EQ(sleep.awaited_byte(), kProtocol.prepare_byte);
  sleep.pop_changes();
  sleep.pop_frames();
  sleep.give_up(sleep_at(100ms));
  EXPECT_EQ(changes_of(sleep), "awake (no acknowledge)");
  EXPECT_EQ(frames_of(sleep), "1680:3.");
  sleep.acknowledged(sleep_at(200ms));
  sleep.advance(sleep_at(9s));
  EXPECT_EQ(sleep.phase(), SleepPhase::awake);
  Sleep acknowledged = in_phase(SleepPhase::prepare, true);
  acknowledged.give_up(sleep_at(100ms));
  EXPECT_EQ(acknowledged.phase(), SleepPhase::prepare);
}

TEST(Sleep, WithoutABusACheckOfTheMasterEnds) {
  Sleep sleep = in_phase(SleepPhase::check, true);
  EXPECT_EQ(sleep.phase(), SleepPhase::check);
  sleep.lose_bus(sleep_at(100ms));
  EXPECT_EQ(changes_of(sleep), "awake (no acknowledge)");
  sleep.advance(sleep_at(9s));
  EXPECT_EQ(frames_of(sleep), "");
  for (const SleepPhase phase : {SleepPhase::prepare, SleepPhase::asleep}) {
    Sleep other = in_phase(phase, true);
    other.lose_bus(sleep_at(100ms));
    EXPECT_EQ(other.phase(), phase);
  }
  Sleep slave = in_phase(SleepPhase::check, false);
  slave.lose_bus(sleep_at(100ms));
  EXPECT_EQ(slave.phase(), SleepPhase::check);
}

}  // namespace
}  // namespace linegate::nmt
