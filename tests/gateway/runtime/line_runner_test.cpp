// SPDX-License-Identifier: Apache-2.0
// One line on a simulated channel, in virtual time.
#include <cerrno>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <poll.h>

#include "stack/can/cob_id.h"

#include "tests/gateway/runtime/line_runner_fixture.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

TEST_F(LineRunnerTest, WhatOthersLeaveIsLookedAtWhenItIsCalled) {
  make_ready();
  send_command(7, request::BusRestart{});
  runner_->service(now_);
  line::Reply reply;
  EXPECT_FALSE(port_.replies.pop(reply));
  runner_->called();
  runner_->service(now_);
  EXPECT_TRUE(port_.replies.pop(reply));
  send_command(8, request::BusRestart{});
  runner_->service(now_);
  EXPECT_FALSE(port_.replies.pop(reply)) << "each call counts once";
}

TEST_F(LineRunnerTest, StartsWhenTheInterfaceIsReady) {
  serve();
  serve(1s);
  EXPECT_TRUE(channel_->sent.empty());
  EXPECT_FALSE(happened(EventKind::line_started));
  make_ready();
  EXPECT_TRUE(happened(EventKind::line_started));
  ASSERT_FALSE(channel_->sent.empty());
  EXPECT_EQ(channel_->sent.front().id, can::kNmtId) << "most urgent first: the reset of all nodes";
}

TEST_F(LineRunnerTest, TellsAFailedInterfaceAndGoesOnTrying) {
  can::BusEvent event;
  event.kind = can::BusEvent::Kind::interface_failed;
  event.code = 19;
  channel_->coming_events.push_back(event);
  serve();
  EXPECT_TRUE(happened(EventKind::interface_failed));
  make_ready();
  EXPECT_TRUE(happened(EventKind::interface_ready));
}

TEST_F(LineRunnerTest, RefusesCommandsBeforeTheInterfaceIsReady) {
  serve();
  send_command(7, kRead);
  serve();
  line::Reply reply;
  ASSERT_TRUE(port_.replies.pop(reply));
  EXPECT_EQ(reply.tag, 7U);
  EXPECT_EQ(reply.error, line::to_error(line::Refusal::line_down));
  send_command(8, request::BusRestart{});
  serve();
  ASSERT_TRUE(port_.replies.pop(reply));
  EXPECT_EQ(reply.tag, 8U);
  EXPECT_EQ(reply.error, line::to_error(line::Refusal::line_down));
  EXPECT_EQ(channel_->restarts, 0);
}

TEST_F(LineRunnerTest, RestartsTheBusOnCommandAndSaysWhatCameOfIt) {
  make_ready();
  const std::pair<int, Error> answers[] = {
      {0, Error{}},
      {EBUSY, line::to_error(line::Refusal::wrong_state)},
      {EPERM, Error{Domain::can, EPERM}},
  };
  for (const auto& [given, error] : answers) {
    channel_->restart_gives = given;
    send_command(7, request::BusRestart{});
    serve();
    line::Reply reply;
    ASSERT_TRUE(port_.replies.pop(reply));
    EXPECT_EQ(reply.tag, 7U);
    EXPECT_EQ(reply.error, error) << given;
  }
  EXPECT_EQ(channel_->restarts, 3);
}

TEST_F(LineRunnerTest, ChangesTheFaultsOfABusThatHasNoneOfItsOwn) {
  make_ready();
  const auto ask = [&](int channel_gives) {
    channel_->fault_gives = channel_gives;
    send_command(7, request::BusFault{"off"});
    serve();
    line::Reply reply;
    EXPECT_TRUE(port_.replies.pop(reply));
    const auto* const text = reinterpret_cast<const char*>(reply.bytes().data());
    return std::pair(reply.error, std::string(text, reply.bytes().size()));
  };
  EXPECT_EQ(ask(0), std::pair(Error{}, std::string("said of off")));
  EXPECT_EQ(ask(EINVAL),
            std::pair(line::to_error(line::Refusal::bad_request), std::string("said of off")));
  EXPECT_EQ(ask(EOPNOTSUPP),
            std::pair(line::to_error(line::Refusal::wrong_interface), std::string()));
  EXPECT_EQ(ask(EIO).first, (Error{Domain::can, EIO}));
}

TEST_F(LineRunnerTest, ReckonsTheLoadWithTheBitRateOfTheController) {
  const auto load_with = [&](std::uint32_t bit_rate) {
    channel_->set_to.bit_rate = bit_rate;
    make_ready();
    serve(2s);
    for (int i = 0; i < 500; ++i) {  // 111 bits each plus a tenth for stuff bits: 61,050 bits
      come(0x385, {1, 2, 3, 4, 5, 6, 7, 8});
      serve(2ms);
    }
    serve(200ms);
    const LineStatus* const status = port_.status.fetch();
    EXPECT_NE(status, nullptr);
    return status == nullptr ? 0U : status->state.load_permille;
  };
  EXPECT_EQ(load_with(0), 0U) << "the bit rate is unknown";
  EXPECT_NEAR(load_with(500'000), 122, 4);
  EXPECT_NEAR(load_with(125'000), 488, 16) << "the interface returned with another bit rate";
}

TEST_F(LineRunnerTest, SendsTheFrameThatDidNotFitFirst) {
  channel_->promises = 5;  // reports room for 5 frames, but accepts one
  channel_->accepts = 1;
  make_ready();
  ASSERT_EQ(channel_->sent.size(), 1U);
  const std::uint32_t first = channel_->sent[0].id;
  channel_->accepts = 0;
  serve(1ms);
  serve(1ms);
  EXPECT_EQ(channel_->sent.size(), 1U);
  channel_->promises.reset();
  channel_->accepts = 1000;
  serve(1ms);
  ASSERT_GE(channel_->sent.size(), 2U) << "nothing is lost";
  EXPECT_EQ(first, can::kNmtId);
}

TEST_F(LineRunnerTest, AsksTheLineForFramesOnlyWhenThereIsRoom) {
  channel_->accepts = 0;
  make_ready();
  serve(1ms);
  EXPECT_TRUE(channel_->sent.empty());
  EXPECT_TRUE(runner_->line().wants_to_send(now_)) << "the frame stays with the line";
}

TEST_F(LineRunnerTest, ReadsUntilTheChannelIsEmpty) {
  make_ready();
  for (int i = 0; i < 200; ++i) {
    come(0x185, {1, 2, 3, 4});
  }
  channel_->reads = 0;
  serve(1ms);
  EXPECT_EQ(channel_->reads, 4) << "64 + 64 + 64 + 8";
  EXPECT_TRUE(channel_->coming.empty());
}

TEST_F(LineRunnerTest, TellsHowMuchWaitedWhere) {
  make_ready();
  serve(200ms);
  (void)port_.status.fetch();
  for (const int frames : {200, 3}) {  // the next status is due 100 ms after the last
    for (int i = 0; i < frames; ++i) {
      come(0x185, {1, 2, 3, 4});
    }
    serve(120ms);
  }
  const LineStatus* status = port_.status.fetch();
  ASSERT_NE(status, nullptr);
  EXPECT_EQ(status->queues.receive_peak, 200U)
      << "the peak of a status that was not read is included";
  EXPECT_GT(status->queues.events, 0U) << "no consumer takes the events";
  serve(120ms);
  EXPECT_EQ(port_.status.fetch()->queues.receive_peak, 0U);
}

TEST_F(LineRunnerTest, ReportsNoTimeOutThatLateFramesDisprove) {
  boot();
  (void)events();
  // The thread slept for 10 s. The heartbeats of that time are waiting in the socket.
  for (int i = 0; i < 100; ++i) {
    can::Frame frame = can::make_frame(0x705, {0x05});
    now_ += 100ms;
    frame.time = now_;
    channel_->coming.push_back(frame);
  }
  serve();
  EXPECT_FALSE(happened(EventKind::heartbeat_lost));
}

TEST_F(LineRunnerTest, DoesNotReadAChannelWithoutFramesForImages) {
  boot();
  auto& slot = port_.image(image::Direction::inputs);
  serve(20ms);
  come(0x185, {1, 2, 3, 4});
  serve(20ms);
  come(0x185, {5, 2, 3, 4});
  serve(1ms);
  (void)slot.fetch();
  const int reads = channel_->reads;
  now_ += 9ms;
  runner_->nothing_to_read();
  runner_->service(now_);
  EXPECT_NE(slot.fetch(), nullptr);
  EXPECT_EQ(channel_->reads, reads);
  runner_->service(now_);
  EXPECT_EQ(channel_->reads, reads + 1) << "it counts once";
}

// The timer is set once for each image, not again when the first frame has come.
TEST_F(LineRunnerTest, ExpectsTheNextImageOfASeriesOnce) {
  boot();
  auto& slot = port_.image(image::Direction::inputs);
  serve(20ms);
  come(0x185, {1, 2, 3, 4});
  serve(20ms);
  ASSERT_NE(slot.fetch(), nullptr);
  come(0x185, {2, 2, 3, 4});
  serve(1ms);
  runner_->nothing_to_read();
  now_ += 9ms;
  runner_->service(now_);
  ASSERT_NE(slot.fetch(), nullptr) << "the second image of a series";
  EXPECT_LE(runner_->next_wake(), now_ + 10ms);
  now_ += 10ms;
  runner_->nothing_to_read();
  runner_->service(now_);
  EXPECT_EQ(slot.fetch(), nullptr) << "nothing has changed";
  EXPECT_GT(runner_->next_wake(), now_ + 10ms) << "the series has ended";
}

// The outputs changed twice within the shortest interval, long ago.
TEST_F(LineRunnerTest, ExpectsTheNextImageOfASeriesOfInputsAfterOneOfOutputs) {
  boot();
  const image::Layout& layout = runner_->line().layout(image::Direction::outputs);
  for (unsigned char value = 1; value <= 3; ++value) {
    line::OutputWrite out{.layout_id = layout.id, .arming = 1};
    out.values.push_back({.entry = 0, .length = 1, .data = {std::byte{value}}});
    ASSERT_TRUE(port_.outputs.push(out));
    serve(1us);
    serve(10ms);
    ASSERT_NE(port_.image(image::Direction::outputs).fetch(), nullptr);
  }
  serve(1s);
  auto& slot = port_.image(image::Direction::inputs);
  for (unsigned char value = 1; value <= 2; ++value) {
    come(0x185, {value, 2, 3, 4});
    serve(10ms);
    ASSERT_NE(slot.fetch(), nullptr);
  }
  EXPECT_LE(runner_->next_wake(), now_ + 10ms);
}

TEST_F(LineRunnerTest, ReadsBeforeACommandEvenAChannelThatHadNothingToRead) {
  boot();
  (void)events();
  come(0x085, {0x00, 0x10, 0x01, 0, 0, 0, 0, 0});
  send_command(7, line::SdoRead{.node = 200});  // refused, with an event
  runner_->nothing_to_read();
  serve(1us);
  std::vector<EventKind> kinds;
  for (const Event& event : events()) {
    kinds.push_back(event.kind());
  }
  EXPECT_EQ(kinds, (std::vector{EventKind::emcy, EventKind::command_refused}));
}

TEST_F(LineRunnerTest, TimeDoesNotGoBackWhenFramesAndCommandsComeTogether) {
  boot();
  (void)events();
  come(0x085, {0x00, 0x10, 0x01, 0, 0, 0, 0, 0});
  line::Command command{.request = line::SdoRead{.node = 200}};  // refused, with an event
  port_.commands.push(command);
  serve(5ms);
  Instant last{};
  std::vector<EventKind> kinds;
  for (const Event& event : events()) {
    EXPECT_GE(event.time, last);
    last = event.time;
    kinds.push_back(event.kind());
  }
  EXPECT_EQ(kinds, (std::vector{EventKind::emcy, EventKind::command_refused}));
}

TEST_F(LineRunnerTest, TimeDoesNotGoBackAfterAFrameThatCameWhileItRead) {
  boot();
  (void)events();
  channel_->reading_takes = 45ms;  // the thread was delayed after it had read the clock
  now_ += 45ms;
  come(0x085, {0x00, 0x10, 0x01, 0, 0, 0, 0, 0});
  line::Command command{.request = line::SdoRead{.node = 200}};  // refused, with an event
  port_.commands.push(command);
  serve(-40ms);
  Instant last{};
  std::vector<EventKind> kinds;
  for (const Event& event : events()) {
    EXPECT_GE(event.time, last);
    last = event.time;
    kinds.push_back(event.kind());
  }
  EXPECT_EQ(kinds, (std::vector{EventKind::emcy, EventKind::command_refused}));
}

TEST_F(LineRunnerTest, HandsOverImagesOnChangeWithTheirSeparation) {
  boot();
  auto& slot = port_.image(image::Direction::inputs);
  (void)slot.fetch();
  serve(20ms);
  come(0x185, {1, 2, 3, 4});
  serve(20ms);
  const image::Snapshot* first = slot.fetch();
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(std::to_integer<int>(first->bytes[0]), 1);
  ASSERT_EQ(first->marks.size(), 1U);
  EXPECT_EQ(first->marks[0].count, 1U);

  come(0x185, {5, 2, 3, 4});
  serve(1ms);
  EXPECT_EQ(slot.fetch(), nullptr) << "too early";
  EXPECT_LE(runner_->next_wake(), now_ + 9ms);
  serve(9ms);
  const image::Snapshot* second = slot.fetch();
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(std::to_integer<int>(second->bytes[0]), 5);
}

TEST_F(LineRunnerTest, NamesItsConsumerOnceWhenItIsAskedTo) {
  make_ready();
  pollfd p{consumer_.descriptor(), POLLIN, 0};
  EXPECT_EQ(poll(&p, 1, 0), 0) << "other lines of the round are served first";
  EXPECT_EQ(runner_->announce(), &consumer_);
  EXPECT_EQ(poll(&p, 1, 0), 0) << "the executor signals it, once for all lines";
  EXPECT_EQ(runner_->announce(), nullptr) << "nothing new";
}

TEST_F(LineRunnerTest, FramesFromBeforeAFailureDoNotOutliveIt) {
  boot();
  come(0x185, {1, 2, 3, 4});
  serve(20ms);
  auto& slot = port_.image(image::Direction::inputs);
  const image::Snapshot* before = slot.fetch();
  ASSERT_NE(before, nullptr);
  ASSERT_NE(before->valid.at(0), 0U);
  come(0x185, {5, 6, 7, 8});
  can::BusEvent failure;
  failure.kind = can::BusEvent::Kind::interface_failed;
  failure.time = now_;
  channel_->coming_later.push_back(failure);
  serve(20ms);
  const image::Snapshot* after = slot.fetch();
  ASSERT_NE(after, nullptr);
  EXPECT_EQ(std::to_integer<int>(after->bytes[0]), 5) << "received before the last image";
  EXPECT_EQ(after->valid.at(0), 0U);
}

TEST_F(LineRunnerTest, HandsOverUnchangedReceptionsForPdoUpdates) {
  boot();
  auto& slot = port_.image(image::Direction::inputs);
  come(0x185, {1, 2, 3, 4});
  serve(20ms);
  (void)slot.fetch();
  come(0x185, {1, 2, 3, 4});
  serve(20ms);
  EXPECT_EQ(slot.fetch(), nullptr);
  serve(80ms);
  const image::Snapshot* snapshot = slot.fetch();
  ASSERT_NE(snapshot, nullptr);
  EXPECT_EQ(snapshot->marks.size(), 1U);
}

TEST_F(LineRunnerTest, MergesWhatNobodyHasRead) {
  boot();
  auto& slot = port_.image(image::Direction::inputs);
  (void)slot.fetch();
  for (std::uint8_t i = 1; i <= 3; ++i) {
    come(0x185, {i, 0, 0, 0});
    serve(20ms);
  }
  const image::Snapshot* snapshot = slot.fetch();
  ASSERT_NE(snapshot, nullptr);
  EXPECT_EQ(std::to_integer<int>(snapshot->bytes[0]), 3);
  ASSERT_EQ(snapshot->marks.size(), 1U);
  EXPECT_EQ(snapshot->marks[0].count, 3U);
}

TEST_F(LineRunnerTest, HandsOverNodeStatesWhenTheyChange) {
  boot();
  std::optional<line::NodeState> last;
  for (NodeStatus status; port_.nodes.pop(status);) {
    if (status.state.node == 5) {
      last = status.state;
    }
  }
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->presence, line::Presence::present);
  serve(1s);
  NodeStatus status;
  EXPECT_FALSE(port_.nodes.pop(status)) << "no change to report";
}

TEST_F(LineRunnerTest, WhatTheInterfaceCouldNotReadIsCountedAsMalformed) {
  make_ready();
  const LineStatus* const before = port_.status.fetch();
  ASSERT_NE(before, nullptr);
  EXPECT_EQ(before->state.counters.frames_malformed, 0U);
  channel_->counted.malformed = 3;
  serve(1s);
  const LineStatus* const after = port_.status.fetch();
  ASSERT_NE(after, nullptr);
  EXPECT_EQ(after->state.counters.frames_malformed, 3U);
}

TEST_F(LineRunnerTest, MakesTheLineWaitWhenTheEventRingIsFull) {
  make_ready();
  (void)events();
  for (Event event; port_.events.room() > 0;) {
    port_.events.push(event);
  }
  Event notice{.data = event::CommandRefused{}};
  port_.notices.push(notice);
  serve(1ms);
  EXPECT_EQ(port_.events.room(), 0U);
  (void)events();
  serve(1ms);
  EXPECT_TRUE(happened(EventKind::command_refused))
      << "the line keeps the event until there is room";
}

TEST_F(LineRunnerTest, ReportsRequestsLostToAFullRing) {
  make_ready();
  (void)events();
  port_.requests_lost.add(3);
  serve(200ms);
  bool found = false;
  for (const Event& event : events()) {
    if (const auto* const full = event.get<event::QueueFull>()) {
      found = true;
      EXPECT_EQ(full->lost, 3U);
    }
  }
  EXPECT_TRUE(found);
}

TEST_F(LineRunnerTest, AnswersAnNmtCommandWhenItsFrameWasAcknowledged) {
  boot();
  channel_->acknowledges = false;
  send_command(7, line::NmtRequest{.node = 5});
  serve();
  line::Reply reply;
  ASSERT_FALSE(port_.replies.pop(reply))
      << "the channel accepted the frame, but the bus did not acknowledge it";
  channel_->counted.acknowledged = channel_->counted.taken();
  serve(1ms);
  ASSERT_TRUE(port_.replies.pop(reply));
  EXPECT_EQ(reply.tag, 7U);
  EXPECT_TRUE(reply.ok());
}

TEST_F(LineRunnerTest, AnNmtCommandThatTheChannelLostIsNotDone) {
  boot();
  channel_->acknowledges = false;
  send_command(7, line::NmtRequest{.node = 5});
  serve();
  channel_->counted.flushed = channel_->counted.taken();
  serve(1ms);
  channel_->acknowledges = true;
  send_command(8, line::NmtRequest{.node = 5});
  serve(1ms);
  line::Reply reply;
  ASSERT_TRUE(port_.replies.pop(reply));
  EXPECT_EQ(reply.tag, 8U);
  serve(1100ms);
  ASSERT_TRUE(port_.replies.pop(reply));
  EXPECT_EQ(reply.tag, 7U);
  EXPECT_EQ(reply.error, line::to_error(line::Refusal::no_acknowledge));
}

TEST_F(LineRunnerTest, AnswersEveryCommandWhenItStops) {
  make_ready();
  send_command(1, kRead);  // goes to the line, which waits for node 5
  serve(1ms);
  send_command(2, kRead);  // still in the ring
  runner_->stop(now_);
  serve(1ms);
  std::vector<std::uint64_t> tags;
  for (line::Reply reply; port_.replies.pop(reply);) {
    EXPECT_EQ(reply.error, line::to_error(line::Refusal::cancelled)) << reply.tag;
    tags.push_back(reply.tag);
  }
  std::sort(tags.begin(), tags.end());
  EXPECT_EQ(tags, (std::vector<std::uint64_t>{1, 2}));
  EXPECT_TRUE(runner_->stopped(now_));
  EXPECT_TRUE(happened(EventKind::line_stopped));
}

TEST_F(LineRunnerTest, StopsAfterAWhileEvenIfTheChannelTakesNothing) {
  channel_->accepts = 0;
  make_ready();
  runner_->stop(now_);
  serve(1ms);
  EXPECT_FALSE(runner_->stopped(now_)) << "frames are still to be sent";
  EXPECT_LE(runner_->next_wake(), now_ + 500ms);
  serve(500ms);
  EXPECT_TRUE(runner_->stopped(now_));
}

class FdLineTest : public LineRunnerTest {
 protected:
  FdLineTest()
      : LineRunnerTest(
            "schema: 1\nlines: [{name: a, interface: 'virtual:a', canopen_fd: true, "
            "nodes: [{id: 5, eds: bridges/sim/eds/fd-io.eds}]}]\n") {}
};

TEST_F(FdLineTest, AnInterfaceWithoutCanFdIsNone) {
  channel_->fd = false;
  make_ready();
  EXPECT_TRUE(happened(EventKind::interface_failed));
  EXPECT_FALSE(happened(EventKind::line_started));
  serve(1s);
  EXPECT_TRUE(channel_->sent.empty());
  channel_->fd = true;
  make_ready();
  EXPECT_TRUE(happened(EventKind::line_started));
}

// A channel reports its state, too, when it is ready.
TEST_F(FdLineTest, NothingElseThatAnInterfaceWithoutCanFdReportsIsForTheLine) {
  const auto be_ready = [&](bool fd) {
    channel_->fd = fd;
    can::BusEvent state;
    state.kind = can::BusEvent::Kind::state;
    state.state = can::BusState::error_active;
    state.time = now_;
    channel_->coming_later.push_back(state);
    make_ready();
  };
  const auto refusal = [&](std::uint64_t tag) {
    send_command(tag, kRead);
    serve(1ms);
    line::Reply reply;
    EXPECT_TRUE(port_.replies.pop(reply));
    return reply.error;
  };
  const auto bus_state = [&] {
    serve(200ms);
    const LineStatus* const status = port_.status.fetch();
    EXPECT_NE(status, nullptr);
    return status == nullptr ? can::BusState::unknown : status->state.bus;
  };
  be_ready(false);
  serve(1s);
  EXPECT_TRUE(channel_->sent.empty());
  EXPECT_EQ(bus_state(), can::BusState::absent);
  EXPECT_EQ(refusal(1), line::to_error(line::Refusal::line_down));
  be_ready(true);
  serve(1s);
  EXPECT_FALSE(channel_->sent.empty());
  EXPECT_EQ(bus_state(), can::BusState::error_active);
  be_ready(false);
  channel_->sent.clear();
  serve(1s);
  EXPECT_TRUE(channel_->sent.empty()) << "the adapter came back without CAN FD";
  EXPECT_EQ(bus_state(), can::BusState::absent);
  EXPECT_EQ(refusal(2), line::to_error(line::Refusal::line_down));
  be_ready(true);
  serve(1s);
  EXPECT_FALSE(channel_->sent.empty());
}

class PeriodicLineTest : public LineRunnerTest {
 protected:
  PeriodicLineTest()
      : LineRunnerTest(
            "schema: 1\nlines: [{name: a, interface: 'virtual:a', publish: {period: "
            "50ms}, nodes: [{id: 5, eds: bridges/sim/eds/digital-io.eds}]}]\n") {}
};

TEST_F(PeriodicLineTest, KeepsItsRhythm) {
  make_ready();
  auto& slot = port_.image(image::Direction::inputs);
  ASSERT_NE(slot.fetch(), nullptr);
  int samples = 0;
  for (int ms = 0; ms < 1000; ++ms) {
    serve(1ms);
    samples += slot.fetch() != nullptr ? 1 : 0;
  }
  EXPECT_EQ(samples, 20);
}

class SyncLineTest : public LineRunnerTest {
 protected:
  SyncLineTest()
      : LineRunnerTest(
            "schema: 1\nlines: [{name: a, interface: 'virtual:a', publish: on_sync, "
            "sync: 10ms, nodes: [{id: 5, eds: bridges/sim/eds/digital-io.eds}]}]\n") {}
};

TEST_F(SyncLineTest, PublishesWithEverySync) {
  make_ready();
  serve(100ms);
  auto& slot = port_.image(image::Direction::inputs);
  (void)slot.fetch();
  const std::uint32_t before = runner_->line().sync_count();
  int samples = 0;
  for (int ms = 0; ms < 100; ++ms) {
    serve(1ms);
    samples += slot.fetch() != nullptr ? 1 : 0;
  }
  EXPECT_EQ(static_cast<std::uint32_t>(samples), runner_->line().sync_count() - before);
  EXPECT_GE(samples, 9);
}

class ObservingLineTest : public LineRunnerTest {
 protected:
  ObservingLineTest()
      : LineRunnerTest(
            "schema: 1\nlines: [{name: a, interface: 'virtual:a', role: observer, "
            "nodes: [{id: 5, eds: bridges/sim/eds/digital-io.eds}]}]\n") {}
};

TEST_F(ObservingLineTest, HandsOverALayoutThatChangedAndTransmitsNothing) {
  make_ready();
  serve(100ms);
  EXPECT_EQ(port_.layouts.fetch(), nullptr);
  for (std::uint8_t i = 1; i <= 3; ++i) {  // a PDO that its device file does not have
    come(0x485, {i, 0});
    serve(20ms);
  }
  const auto* layouts = port_.layouts.fetch();
  ASSERT_NE(layouts, nullptr);
  const image::Layout& inputs = runner_->line().layout(image::Direction::inputs);
  EXPECT_EQ((*layouts)[0].id, inputs.id);
  EXPECT_EQ((*layouts)[0].entries.size(), inputs.entries.size());
  const image::Snapshot* image = port_.image(image::Direction::inputs).fetch();
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->layout_id, inputs.id);
  serve(20ms);
  EXPECT_EQ(port_.layouts.fetch(), nullptr) << "once";
  EXPECT_TRUE(happened(EventKind::layout_changed));
  EXPECT_TRUE(channel_->sent.empty());
}

TEST_F(ObservingLineTest, HandsOverTheNodesOfItsConfigurationThoughNoneWasHeard) {
  make_ready();
  serve(100ms);
  NodeStatus status;
  ASSERT_TRUE(port_.nodes.pop(status));
  EXPECT_EQ(status.state.node, 5);
  EXPECT_TRUE(status.state.configured);
  EXPECT_EQ(status.state.presence, line::Presence::unknown);
  EXPECT_FALSE(port_.nodes.pop(status)) << "no other node was heard";
}

}  // namespace
}  // namespace linegate::gateway
