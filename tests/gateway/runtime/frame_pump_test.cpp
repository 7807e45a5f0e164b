// SPDX-License-Identifier: Apache-2.0
// The frames and events of one read() of a channel reach the line in the order of their occurrence.
#include "gateway/runtime/frame_pump.h"

#include <chrono>
#include <deque>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "tests/gateway/runtime/fake_channel.h"

namespace linegate::gateway {
namespace {

using can::BusEvent;

// Returns what the test specifies, one string for each read(): 'f' is a frame, any other letter is
// an event with the letter as its code; '!' is a failure of the interface. '/' acknowledges the
// next own frame and ends the read early.
class ScriptedChannel final : public can_bridge::Channel {
 public:
  explicit ScriptedChannel(std::deque<std::string> reads) : reads_(std::move(reads)) {}

  int descriptor() const override { return -1; }
  std::size_t read(std::span<can::Frame> out, can_bridge::BusEvents& events, Instant) override {
    std::size_t count = 0;
    if (reads_.empty()) {
      return count;
    }
    more_ = false;
    for (const char letter : reads_.front()) {
      if (letter == '/') {
        ++counters_.acknowledged;
        more_ = true;
      } else if (letter == 'f') {
        out[count] = can::make_frame(0x181);
        out[count++].time = frames_are_of;
        events.frames_given(1);
      } else {
        BusEvent event;
        event.code = static_cast<std::uint32_t>(letter);
        event.kind = letter == '!' ? BusEvent::Kind::interface_failed : event.kind;
        events.push(event);
      }
    }
    reads_.pop_front();
    return count;
  }
  bool more() const override { return more_; }
  std::size_t write(std::span<const can::Frame>, Instant) override { return 0; }
  std::size_t room(Instant) const override { return 0; }
  bool wants_writable() const override { return false; }
  Instant next_wake() const override { return kNever; }
  const can_bridge::ChannelCounters& counters() const override { return counters_; }

  Instant frames_are_of{};

 private:
  bool more_ = false;
  std::deque<std::string> reads_;
  can_bridge::ChannelCounters counters_;
};

// The frames and events that drain() passes on, with '|' after each span of frames, and the numbers
// of the acknowledged frames.
std::string drained(std::deque<std::string> reads) {
  FramePump pump(std::make_unique<ScriptedChannel>(std::move(reads)));
  std::string out;
  pump.drain(
      Instant{}, [&](std::span<const can::Frame> frames) { out.append(frames.size(), 'f') += '|'; },
      [&](const BusEvent& event) { out += static_cast<char>(event.code); },
      [&](Instant) {
        pump.report_ended([&](std::uint64_t number) { out += std::to_string(number); },
                          [](std::uint64_t, std::uint64_t) {});
      });
  return out;
}

TEST(FramePump, HandsOverFramesAndEventsInTheOrderOfTheBus) {
  EXPECT_EQ(drained({"ffX"}), "ff|X") << "the failure follows the frames that preceded it";
  EXPECT_EQ(drained({"Rff"}), "Rff|");
  EXPECT_EQ(drained({"ABffCDfE"}), "ABff|CDf|E");
  EXPECT_EQ(drained({"X"}), "X");
  EXPECT_EQ(drained({""}), "");
}

TEST(FramePump, ReportsAnAcknowledgementBetweenTheFramesAroundIt) {
  EXPECT_EQ(drained({"ff/", "f/", "/", "fX"}), "ff|1f|23f|X");
}

TEST(FramePump, CountsTheFramesOfEachReadApart) {
  const std::string full(FramePump::kBatch, 'f');
  EXPECT_EQ(drained({full, "ffXf"}), full + "|ff|Xf|");
}

// A reopened interface may get a descriptor of the same number. The caller must notice the failure
// first, or it would take the new descriptor for the old one.
TEST(FramePump, DoesNotReadOnWhenTheInterfaceHasFailed) {
  const std::string storm(can_bridge::BusEvents::kCapacity - 3, 'X');
  EXPECT_EQ(drained({storm + "!X", "Rf"}), storm + "!X");
  const std::string full(FramePump::kBatch, 'f');
  EXPECT_EQ(drained({full + "!", "Rf"}), full + "|!");
}

TEST(FramePump, ReadsOnWhereItWasTheEventsThatLeftNoRoom) {
  const std::string storm(can_bridge::BusEvents::kCapacity - 1, 'X');
  EXPECT_EQ(drained({storm, "f"}), storm + "f|");
}

// The instant up to which the bus is known, if each read returns frames with the time
// `frames_are_of`.
Instant known(Instant now, Instant frames_are_of, std::size_t reads, const std::string& each) {
  auto channel = std::make_unique<ScriptedChannel>(std::deque<std::string>(reads, each));
  channel->frames_are_of = frames_are_of;
  FramePump pump(std::move(channel));
  return pump.drain(
      now, [](std::span<const can::Frame>) {}, [](const BusEvent&) {});
}

TEST(FramePump, KnowsEverythingUpToNowOrTheLastFrame) {
  const Instant now(std::chrono::seconds(10));
  const Instant before = now - std::chrono::milliseconds(45);
  const Instant after = now + std::chrono::milliseconds(45);
  EXPECT_EQ(known(now, before, 1, "f"), now);
  EXPECT_EQ(known(now, after, 1, "f"), after) << "the frame arrived during read()";
  EXPECT_EQ(known(now, after, 1, "X"), now);
  EXPECT_EQ(known(now, before, 100, std::string(FramePump::kBatch, 'f')), before)
      << "more frames are pending";
}

// The result of report_ended(): "a3": frame 3 was acknowledged; "l1-2": frames 1 and 2 are lost.
std::string ended(FramePump& pump) {
  std::string out;
  pump.report_ended([&](std::uint64_t number) { out += 'a' + std::to_string(number); },
                    [&](std::uint64_t first, std::uint64_t last) {
                      out += 'l' + std::to_string(first) + '-' + std::to_string(last);
                    });
  return out;
}

void send(FramePump& pump, std::size_t count, std::uint8_t flags = 0) {
  pump.transmit(Instant{}, [&](can::Frame& frame) {
    frame = can::make_frame(0x181);
    frame.flags = flags;
    const bool more = count > 0;
    count -= more ? 1U : 0U;
    return more;
  });
}

TEST(FramePump, ReportsWhatBecameOfTheFramesByTheirNumbers) {
  auto made = std::make_unique<FakeChannel>();
  FakeChannel& channel = *made;
  channel.acknowledges = false;
  FramePump pump(std::move(made));
  send(pump, 3);
  EXPECT_EQ(ended(pump), "");
  channel.counted.acknowledged = 2;
  EXPECT_EQ(ended(pump), "a2");
  EXPECT_EQ(ended(pump), "") << "once";
  channel.counted.flushed = 3;
  EXPECT_EQ(ended(pump), "l3-3");
  send(pump, 2);
  channel.counted.acknowledged = 4;
  channel.counted.flushed = 5;
  EXPECT_EQ(ended(pump), "a4l5-5");
  send(pump, 3);
  channel.counted.skipped = 6;
  channel.counted.acknowledged = 8;
  EXPECT_EQ(ended(pump), "l5-6a8") << "5 was lost before";
}

// Returns how often transmit() asked for a frame, of which there are `frames`.
std::size_t calls_for(std::size_t frames, std::size_t accepts) {
  auto made = std::make_unique<FakeChannel>();
  made->accepts = accepts;
  FramePump pump(std::move(made));
  std::size_t calls = 0;
  pump.transmit(Instant{}, [&](can::Frame& frame) {
    frame = can::make_frame(0x181);
    return ++calls <= frames;
  });
  return calls;
}

TEST(FramePump, AsksForNoFrameAfterThereWasNone) {
  EXPECT_EQ(calls_for(0, 1000), 1U);
  EXPECT_EQ(calls_for(2, 1000), 3U);
  EXPECT_EQ(calls_for(FramePump::kBatch - 1, 1000), FramePump::kBatch);
  EXPECT_EQ(calls_for(FramePump::kBatch + 1, 1000), FramePump::kBatch + 2) << "a second batch";
  EXPECT_EQ(calls_for(100, 0), 0U) << "the channel has no room";
}

TEST(FramePump, AsksAgainAfterTheFramesThatWereHeld) {
  auto made = std::make_unique<FakeChannel>();
  FakeChannel& channel = *made;
  channel.accepts = 1;
  channel.promises = 2;
  FramePump pump(std::move(made));
  send(pump, 2);
  ASSERT_EQ(pump.held(), 1U);
  channel.accepts = 10;
  channel.promises.reset();
  send(pump, 1);
  EXPECT_EQ(pump.held(), 0U);
  EXPECT_EQ(channel.sent.size(), 3U);
}

TEST(FramePump, WhatTheChannelCannotSendIsLost) {
  auto made = std::make_unique<FakeChannel>();
  FakeChannel& channel = *made;
  channel.fd = false;
  FramePump pump(std::move(made));
  send(pump, 1);
  EXPECT_EQ(ended(pump), "a1");
  send(pump, 2, can::Frame::kFd);
  EXPECT_EQ(ended(pump), "l2-3a3");
}

}  // namespace
}  // namespace linegate::gateway
