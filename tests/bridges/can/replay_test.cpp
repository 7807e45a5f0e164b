// SPDX-License-Identifier: Apache-2.0
// A log as an interface, in virtual time.
#include "bridges/can/replay.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace linegate::can_bridge {
namespace {

using namespace std::chrono_literals;
using can::BusEvent;
using can::BusState;
using testing::ElementsAre;
using testing::HasSubstr;
using Kind = BusEvent::Kind;

constexpr const char* kLog =
    "(100.000000) can0 181#01\n"
    "(100.010000) can0 20000004#0010000000000080\n"
    "(100.010000) can1 182#02\n"
    "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)\n"
    "(100.020000) can0 183#03\n"
    "no line at all\n"
    "(100.015000) can0 184#04\n";

class ReplayTest : public testing::Test {
 protected:
  ~ReplayTest() override { std::filesystem::remove(path_); }

  void write(const std::string& text) { std::ofstream(path_) << text; }
  std::unique_ptr<Channel> open(const std::string& options = {}) {
    const ParsedUri parsed = parse_uri("replay:" + path_ + options);
    EXPECT_TRUE(parsed.ok()) << parsed.error;
    return open_replay(parsed.uri.name, replay_options(parsed.uri).options);
  }
  // Identifiers of the frames that are read at that time.
  std::vector<std::uint32_t> read(Channel& channel, Duration later) {
    std::array<can::Frame, 64> out;
    events.clear();
    const std::size_t count = channel.read(out, events, start + later);
    std::vector<std::uint32_t> ids;
    times.clear();
    for (std::size_t i = 0; i < count; ++i) {
      ids.push_back(out[i].id);
      times.push_back(out[i].time - start);
    }
    return ids;
  }
  std::vector<Kind> kinds() const {
    std::vector<Kind> out;
    for (const BusEvent& event : events.view()) {
      out.push_back(event.kind);
    }
    return out;
  }

  const Instant start{1000s};
  BusEvents events;
  std::vector<Duration> times;

 private:
  const std::string path_ = (std::filesystem::temp_directory_path() /
                             ("linegate-replay-" + std::to_string(::getpid()) + ".log"))
                                .string();
};

TEST_F(ReplayTest, FramesComeWithTheTimingOfTheLog) {
  write(kLog);
  const auto channel = open();
  EXPECT_LE(channel->next_wake(), start);
  EXPECT_THAT(read(*channel, 0ms), ElementsAre(0x181));
  EXPECT_THAT(kinds(), ElementsAre(Kind::interface_ready, Kind::state));
  EXPECT_EQ(channel->next_wake(), start + 10ms);
  EXPECT_THAT(read(*channel, 9ms), ElementsAre());
  EXPECT_THAT(read(*channel, 12ms), ElementsAre(0x182));
  EXPECT_THAT(times, ElementsAre(10ms)) << "a frame has its own time, however late it is read";
  EXPECT_THAT(kinds(), ElementsAre(Kind::state, Kind::frames_lost));
  EXPECT_EQ(events.view()[0].state, BusState::error_passive);
  EXPECT_EQ(events.view()[0].receive_errors, 0x80);
  EXPECT_EQ(events.view()[1].count, 3U);
  EXPECT_EQ(events.frames_before(0), 0U);
  EXPECT_EQ(events.frames_before(1), 1U);
  EXPECT_THAT(read(*channel, 20ms), ElementsAre(0x183, 0x184));
  EXPECT_THAT(times, ElementsAre(20ms, 20ms)) << "never back in time";
  EXPECT_EQ(channel->counters().received, 4U);
  EXPECT_EQ(channel->counters().malformed, 1U);
  EXPECT_EQ(channel->counters().lost, 3U);
}

TEST_F(ReplayTest, TheEndIsToldOnce) {
  write("(1.0) can0 181#01\n");
  const auto channel = open();
  EXPECT_THAT(read(*channel, 0ms), ElementsAre(0x181));
  ASSERT_THAT(kinds(),
              ElementsAre(Kind::interface_ready, Kind::state, Kind::interface_failed, Kind::state));
  EXPECT_EQ(events.view()[2].code, static_cast<std::uint32_t>(ENODATA));
  EXPECT_EQ(events.frames_before(2), 1U);
  EXPECT_EQ(events.view()[3].state, BusState::stopped);
  EXPECT_EQ(channel->next_wake(), kNever);
  EXPECT_EQ(channel->room(start), 0U);
  EXPECT_THAT(read(*channel, 1h), ElementsAre());
  EXPECT_TRUE(events.empty());
  EXPECT_EQ(describe_failure("replay:a.log", ENODATA), "replay:a.log is at its end");
}

TEST_F(ReplayTest, AsFastAsPossible) {
  std::string log;
  for (int i = 0; i < 150; ++i) {
    log += "(" + std::to_string(1000 * i) + ".0) can0 181#01\n";
  }
  write(log);
  const auto channel = open("?speed=max");
  EXPECT_EQ(read(*channel, 1ms).size(), 64U);
  EXPECT_EQ(times.back(), 1ms);
  EXPECT_LE(channel->next_wake(), start + 1ms);
  EXPECT_EQ(read(*channel, 1ms).size(), 64U);
  EXPECT_EQ(read(*channel, 2ms).size(), 22U);
  EXPECT_EQ(kinds().front(), Kind::interface_failed);
}

TEST_F(ReplayTest, SpeedAndInterfaceAreOptions) {
  write(kLog);
  const auto channel = open("?speed=2&interface=can0");
  EXPECT_THAT(read(*channel, 0ms), ElementsAre(0x181));
  EXPECT_EQ(channel->next_wake(), start + 5ms);
  EXPECT_THAT(read(*channel, 10ms), ElementsAre(0x183, 0x184));
  EXPECT_EQ(times.front(), 10ms);
}

TEST_F(ReplayTest, WhatIsSentGoesNowhere) {
  write("(1.0) can0 181#01\n(9.0) can0 181#01\n");
  const auto channel = open();
  EXPECT_EQ(channel->room(start), 0U);
  read(*channel, 0ms);
  const std::array<can::Frame, 2> frames{can::make_frame(0x601), can::make_frame(0x602)};
  EXPECT_GE(channel->room(start), 2U);
  EXPECT_EQ(channel->write(frames, start), 2U);
  EXPECT_EQ(channel->counters().sent, 2U);
  EXPECT_THAT(read(*channel, 1s), ElementsAre());
}

TEST_F(ReplayTest, AFileThatIsMissingIsToldOnceAndTriedAgain) {
  const auto channel = open();
  EXPECT_THAT(read(*channel, 0ms), ElementsAre());
  ASSERT_THAT(kinds(), ElementsAre(Kind::interface_failed, Kind::state));
  EXPECT_EQ(events.view()[0].code, static_cast<std::uint32_t>(ENOENT));
  read(*channel, 10s);
  EXPECT_TRUE(events.empty());
  write("(1.0) can0 181#01\n");
  EXPECT_THAT(read(*channel, 20s), ElementsAre(0x181));
  EXPECT_EQ(kinds().front(), Kind::interface_ready);
}

TEST(ReplayUri, OptionsAreChecked) {
  EXPECT_TRUE(parse_uri("replay:../a b.log?speed=0.5").ok());
  EXPECT_THAT(parse_uri("replay:").error, HasSubstr("needs a file"));
  EXPECT_THAT(parse_uri("replay:a?speed=fast").error, HasSubstr("not \"fast\""));
  EXPECT_THAT(parse_uri("replay:a?speed=0").error, HasSubstr("from 0.1 to 1000"));
  EXPECT_THAT(parse_uri("replay:a?speed=nan").error, HasSubstr("from 0.1 to 1000"));
  EXPECT_THAT(parse_uri("replay:a?sped=1").error, HasSubstr("not \"sped=1\""));
  EXPECT_THAT(parse_uri("replay:a?speed").error, HasSubstr("not written key=value"));
  EXPECT_THAT(parse_uri("replay:a?speed=1&speed=2").error, HasSubstr("there twice"));
  EXPECT_THAT(parse_uri("socketcan:can0?speed=max").error, HasSubstr("not \"speed=max\""));
}

}  // namespace
}  // namespace linegate::can_bridge
