// SPDX-License-Identifier: Apache-2.0
// SDO routing, row by row of definition A in stack/routing/README.md.
#include <array>
#include <cstdio>
#include <initializer_list>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/stack/routing/routed_lines.h"

namespace linegate::routing::test {
namespace {

// --- the network indication ---------------------------------------------------------------------

TEST_F(SdoRouting, TheIndicationIsEchoedAndTheTransferForwarded) {
  start();
  open();
  EXPECT_EQ(counters(1).open, 1U);
  EXPECT_EQ(counters(2).channels, 1U);
  client({0x40, 0, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"605 4000100000000000"});
  server({0x43, 0, 0x10, 0, 0x91, 1, 2, 3});
  EXPECT_EQ(sent(1), Frames{"5FF 4300100091010203"});
  EXPECT_EQ(counters(1).finished, 1U);
  expect_nothing_left();
}

TEST_F(SdoRouting, EachFinishedTransferNeedsANewIndication) {
  start();
  open();
  client({0x40, 0, 0x10, 0, 0, 0, 0, 0});
  server({0x43, 0, 0x10, 0, 0x91, 1, 2, 3});
  (void)sent(1);
  (void)sent(2);
  client({0x40, 0, 0x10, 0, 0, 0, 0, 0});  // addressed to the gateway's own dictionary again
  EXPECT_EQ(sent(1), Frames{"5FF 4300100095010000"});
  EXPECT_EQ(sent(2), Frames{});
}

struct Refused {
  const char* what;
  std::array<std::uint8_t, 8> indication;
  AbortCode why;
};

class RefusedIndication : public RoutedLines, public testing::WithParamInterface<Refused> {};

TEST_P(RefusedIndication, IsAnAbortOfNoObjectAndAnEvent) {
  start();
  can::Frame frame = can::make_frame(0x67F, {0, 0, 0, 0, 0, 0, 0, 0});
  for (std::size_t i = 0; i < 8; ++i) {
    frame.data.at(i) = std::byte{GetParam().indication.at(i)};
  }
  frame.time = now_;
  line(1).receive(std::span(&frame, 1), now_);
  carry();
  char text[32];
  const auto code = static_cast<unsigned>(GetParam().why);
  std::snprintf(text, sizeof text, "5FF 80000000%02X%02X%02X%02X", code & 0xFFU, code >> 8U & 0xFFU,
                code >> 16U & 0xFFU, code >> 24U);
  EXPECT_EQ(sent(1), Frames{text});
  EXPECT_EQ(sent(2), Frames{});
  EXPECT_EQ(counters(1).refused, 1U);
  EXPECT_EQ(counters(1).opened, 0U);
  EXPECT_TRUE(refused_with(1, GetParam().why));
}

constexpr Refused kRefused[] = {
    {"network without a route", {0xE0, 9, 0, 5, 1}, AbortCode::invalid_value},
    {"node-ID 128", {0xE0, 2, 0, 128, 1}, AbortCode::invalid_value},
    {"nine hops", {0xE0, 2, 0, 5, 9}, AbortCode::invalid_value},
    {"back over the line it came from", {0xE0, 1, 0, 5, 1}, AbortCode::invalid_value},
    {"the same, local network", {0xE0, 0, 0, 5, 1}, AbortCode::invalid_value},
};
INSTANTIATE_TEST_SUITE_P(Rows, RefusedIndication, testing::ValuesIn(kRefused));

TEST_F(SdoRouting, FlagsOfTheIndicationAreAnUnknownCommandSpecifier) {
  start();
  client({0xE1, 2, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000001000405"});
}

TEST_F(SdoRouting, ClientSdo1IsBusyWhileItCarriesAConnection) {
  of_line(1).additional_servers = 1;
  start();
  hear(1, 0x67F, {0x23, 0x01, 0x12, 1, 0x00, 0x02, 0, 0});  // 1201h: 200h, 240h
  hear(1, 0x67F, {0x23, 0x01, 0x12, 2, 0x40, 0x02, 0, 0});
  (void)sent(1);
  open();
  hear(1, 0x200, {0xE0, 2, 0, 6, 1, 0, 0, 0});
  pass(milliseconds(1));
  EXPECT_TRUE(refused_with(1, AbortCode::sdo_connection));
  client({0x80, 0, 0, 0, 0, 0, 0, 8});
  hear(1, 0x200, {0xE0, 2, 0, 6, 1, 0, 0, 0});
  EXPECT_EQ(counters(1).open, 1U);
}

TEST_F(SdoRouting, OfANodeThatIsNoGatewayIsRefusedWithCommandSpecifier) {
  of_line(1) = {};  // an SDO server without routing
  start();
  client({0xE0, 2, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000001000405"});
}

TEST_F(SdoRouting, OfALineThatCannotSendIsRefusedWithDeviceState) {
  start();
  line(2).bus_event({.kind = can::BusEvent::Kind::state, .state = can::BusState::bus_off});
  client({0xE0, 2, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000022000008"});
  line(2).bus_event({.kind = can::BusEvent::Kind::state, .state = can::BusState::error_active});
  line(2).execute({.request = line::NmtRequest{.node = 126, .command = nmt::Command::stop}}, now_);
  client({0xE0, 2, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000022000008"});
}

TEST_F(SdoRouting, TheGatewayItselfIsReachedAsAnyNodeIs) {
  start();
  client({0xE0, 0, 0, 0, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF E000000001000000"});
  client({0xE0, 1, 0, 127, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF E001007F01000000"});
  EXPECT_EQ(counters(1).opened, 0U);  // the gateway serves its own dictionary
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{0, 126}) {
    client({0xE0, 2, 0, node, 1, 0, 0, 0});
    client({0x40, 0x00, 0x12, 2, 0, 0, 0, 0});  // COB-ID of the responses on line 2
    const Frames frames = sent(1);
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(frames[1], "5FF 43001202FE050000");
  }
  EXPECT_EQ(sent(2), Frames{});
  expect_nothing_left();
}

// --- the next gateway ---------------------------------------------------------------------------

TEST_F(SdoRouting, TheNextGatewayIsToldWithOneHopMore) {
  with_next_gateway();
  start();
  client({0xE0, 3, 0, 7, 1, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"609 E003000702000000"});
  EXPECT_EQ(sent(1), Frames{});
  hear(2, 0x589, {0xE0, 3, 0, 7, 2, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF E003000701000000"});
  client({0x40, 0, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"609 4000100000000000"});
  hear(2, 0x589, {0x43, 0, 0x10, 0, 1, 2, 3, 4});
  EXPECT_EQ(sent(1), Frames{"5FF 4300100001020304"});
  expect_nothing_left();
}

TEST_F(SdoRouting, TheNextGatewaysRefusalComesBack) {
  with_next_gateway();
  start();
  client({0xE0, 3, 0, 7, 1, 0, 0, 0});
  hear(2, 0x589, {0x80, 0, 0, 0, 0x23, 0, 0x0A, 0x06});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000023000A06"});
  EXPECT_TRUE(refused_with(1, AbortCode::sdo_connection));
  expect_nothing_left();
}

TEST_F(SdoRouting, ANextGatewayThatDoesNotAnswerIsATimeout) {
  with_next_gateway();
  start();
  client({0xE0, 3, 0, 7, 1, 0, 0, 0});
  (void)sent(2);
  // 7/8 of two SDO time-outs: this gateway is one hop nearer to the target
  pass(milliseconds(860));
  EXPECT_EQ(sent(1), Frames{});
  pass(milliseconds(30));
  EXPECT_EQ(sent(1), Frames{"5FF 8000000000000405"});
  EXPECT_EQ(sent(2), Frames{"609 8000000000000405"});  // releases the gateway if it answers late
  expect_nothing_left();
}

TEST_F(SdoRouting, AFailedRouteFallsBackToTheNext) {  // networks may be a tree or a mesh
  with_next_gateway();
  of_line(1).routes.push_back({.first = 3, .last = 3, .interface = 2, .gateway = 8, .cost = 20});
  start();
  client({0xE0, 3, 0, 7, 1, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"609 E003000702000000"});
  hear(2, 0x589, {0x80, 0, 0, 0, 0x22, 0, 0, 0x08});
  EXPECT_EQ(sent(2), Frames{"608 E003000702000000"});
  hear(2, 0x588, {0xE0, 3, 0, 7, 2, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF E003000701000000"});
}

TEST_F(SdoRouting, WhenAllRoutesFailTheBestOnesReasonIsTold) {
  with_next_gateway();
  of_line(1).routes.push_back({.first = 3, .last = 3, .interface = 2, .gateway = 8, .cost = 20});
  start();
  client({0xE0, 3, 0, 7, 1, 0, 0, 0});
  hear(2, 0x589, {0x80, 0, 0, 0, 0x22, 0, 0, 0x08});
  hear(2, 0x588, {0x80, 0, 0, 0, 0x30, 0, 0x09, 0x06});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000022000008"});
  expect_nothing_left();
}

TEST_F(SdoRouting, ALineThatIsNotThereIsADeadRoute) {
  of_line(1).interfaces.push_back({.number = 3, .network = 30, .node = 1});
  of_line(1).routes.push_back({.first = 30, .last = 30, .interface = 3});
  start();
  client({0xE0, 30, 0, 7, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000022000008"});
}

// --- armed --------------------------------------------------------------------------------------

// The previous gateway waits 875 ms for this one, which must try the next route within that time.
TEST_F(SdoRouting, TheTimeUntilAClientSdoIsFreeIsPartOfTheGatewaysTime) {
  with_next_gateway();
  of_line(1).routes.push_back({.first = 3, .last = 4, .interface = 2, .gateway = 8, .cost = 20});
  start();
  line(2).execute({.tag = 1, .request = line::SdoRead{.node = 9, .address = {0x1008, 0}}}, now_);
  ASSERT_EQ(sent(2), Frames{"609 4008100000000000"});
  client({0xE0, 3, 0, 5, 2, 0, 0, 0});  // an indication from a gateway
  EXPECT_EQ(sent(2), Frames{});
  pass(milliseconds(240));
  hear(2, 0x589, {0x80, 0x08, 0x10, 0, 0, 0, 2, 6});
  pass(milliseconds(1));
  ASSERT_EQ(sent(2), Frames{"609 E003000503000000"});
  pass(milliseconds(559));  // 800 ms in all
  EXPECT_EQ(sent(2), (Frames{"609 8000000000000405", "608 E003000503000000"}));
  hear(2, 0x588, {0xE0, 3, 0, 5, 3, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF E003000502000000"});
}

TEST_F(SdoRouting, WhatTheBusHasNotTakenKeepsTheClientSdo) {
  start();
  open();
  client({0x40, 0, 0x10, 0, 0, 0, 0, 0});
  ASSERT_EQ(sent(2), Frames{"605 4000100000000000"});
  for (int i = 0; i < 300; ++i) {  // more responses than the queue can hold
    hear(2, 0x67E, {0x40, 0, 0x10, 0, 0, 0, 0, 0});
  }
  client({0x80, 0, 0x10, 0, 0, 0, 0, 8});
  EXPECT_EQ(counters(1).open, 0U);
  EXPECT_EQ(counters(2).channels, 1U);
  pass(milliseconds(5));
  EXPECT_EQ(counters(2).channels, 1U);
  EXPECT_NE(sent(2).back(), "605 8000100000000008");
  pass(milliseconds(2));
  EXPECT_EQ(sent(2).back(), "605 8000100000000008");
  expect_nothing_left();
  EXPECT_EQ(counters(2).lost, 0U);
}

TEST_F(SdoRouting, WhatTheBusDoesNotTakeInTimeIsCounted) {
  start();
  open();
  client({0x40, 0, 0x10, 0, 0, 0, 0, 0});
  ASSERT_EQ(sent(2), Frames{"605 4000100000000000"});
  for (int i = 0; i < 300; ++i) {
    hear(2, 0x67E, {0x40, 0, 0x10, 0, 0, 0, 0, 0});
  }
  client({0x80, 0, 0x10, 0, 0, 0, 0, 8});
  pass(milliseconds(1100));
  EXPECT_EQ(counters(2).lost, 1U);
  expect_nothing_left();
}

TEST_F(SdoRouting, TheHopLimitIsConfigured) {
  of_line(1).hop_limit = 2;
  with_next_gateway();
  start();
  client({0xE0, 3, 0, 5, 3, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000030000906"});
  client({0xE0, 3, 0, 5, 2, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"609 E003000503000000"});
}

TEST_F(SdoRouting, ArmedForFiveSecondsThenReleasedWithoutAFrame) {
  start();
  open();
  pass(milliseconds(4990));
  EXPECT_EQ(counters(1).open, 1U);
  pass(milliseconds(20));
  EXPECT_EQ(sent(1), Frames{});
  EXPECT_EQ(sent(2), Frames{});
  EXPECT_EQ(counters(1).timed_out, 1U);
  expect_nothing_left();
}

TEST_F(SdoRouting, ANewIndicationReleasesTheOld) {
  start();
  open();
  client({0xE0, 2, 0, 6, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF E002000601000000"});
  client({0x40, 0, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"606 4000100000000000"});
  EXPECT_EQ(counters(1).aborted, 1U);
}

TEST_F(SdoRouting, ArmedOnlyAnInitiateIsForwarded) {
  start();
  open();
  client({0x60, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000001000405"});
  EXPECT_EQ(sent(2), Frames{});
  client({0x80, 0, 0, 0, 0, 0, 0, 8});
  expect_nothing_left();
}

// --- the transfer -------------------------------------------------------------------------------

TEST_F(SdoRouting, ADownloadEndsWithTheAnswerToItsLastSegment) {
  start();
  open();
  client({0x21, 0, 0x20, 0, 9, 0, 0, 0});
  server({0x60, 0, 0x20, 0, 0, 0, 0, 0});
  client({0x00, 1, 2, 3, 4, 5, 6, 7});
  server({0x20, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(counters(1).open, 1U);
  client({0x1B, 8, 9, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(2),
            (Frames{"605 2100200009000000", "605 0001020304050607", "605 1B08090000000000"}));
  server({0x30, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1),
            (Frames{"5FF 6000200000000000", "5FF 2000000000000000", "5FF 3000000000000000"}));
  EXPECT_EQ(counters(1).finished, 1U);
  expect_nothing_left();
}

TEST_F(SdoRouting, AnUploadEndsWithItsLastSegment) {
  start();
  open();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  server({0x41, 0, 0x20, 0, 9, 0, 0, 0});
  client({0x60, 0, 0, 0, 0, 0, 0, 0});
  server({0x00, 1, 2, 3, 4, 5, 6, 7});
  client({0x70, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(counters(1).open, 1U);
  server({0x1B, 8, 9, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1).back(), "5FF 1B08090000000000");
  EXPECT_EQ(counters(1).finished, 1U);
  expect_nothing_left();
}

TEST_F(SdoRouting, AnExpeditedDownloadEndsWithItsAnswer) {
  start();
  open();
  client({0x2F, 0, 0x20, 0, 9, 0, 0, 0});
  server({0x60, 0, 0x20, 0, 0, 0, 0, 0});
  EXPECT_EQ(counters(1).finished, 1U);
  expect_nothing_left();
}

// Segment 96 with the flag of the last segment begins with E0h, segment 64 looks like an upload
// initiate.
TEST_F(SdoRouting, SegmentsOfABlockAreForwardedWhateverTheyLookLike) {
  start();
  open();
  client({0xC6, 0, 0x20, 0, 0xA0, 2, 0, 0});
  server({0xA4, 0, 0x20, 0, 127, 0, 0, 0});
  for (std::uint8_t segment = 1; segment <= 95; ++segment) {
    client({segment, 1, 2, 3, 4, 5, 6, 7});
    (void)sent(2);
  }
  client({0xE0, 1, 2, 3, 4, 5, 6, 7});
  EXPECT_EQ(sent(2), Frames{"605 E001020304050607"});
  server({0xA2, 96, 127, 0, 0, 0, 0, 0});
  client({0xC1, 0x12, 0x34, 0, 0, 0, 0, 0});
  EXPECT_EQ(counters(1).open, 1U);
  server({0xA1, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(counters(1).finished, 1U);
  expect_nothing_left();
}

TEST_F(SdoRouting, ABlockUploadEndsWithTheClientsEnd) {
  start();
  open();
  client({0xA4, 0, 0x20, 0, 127, 0, 0, 0});
  server({0xC6, 0, 0x20, 0, 7, 0, 0, 0});
  client({0xA3, 0, 0, 0, 0, 0, 0, 0});
  server({0x81, 1, 2, 3, 4, 5, 6, 7});
  client({0xA2, 1, 127, 0, 0, 0, 0, 0});
  server({0xC1, 0x12, 0x34, 0, 0, 0, 0, 0});
  EXPECT_EQ(counters(1).open, 1U);
  client({0xA1, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(2).back(), "605 A100000000000000");
  EXPECT_EQ(counters(1).finished, 1U);
  expect_nothing_left();
}

TEST_F(SdoRouting, AQueueOf127FramesWaitsForASlowBus) {
  start();
  open();
  client({0xC6, 0, 0x20, 0, 0x79, 3, 0, 0});
  server({0xA4, 0, 0x20, 0, 127, 0, 0, 0});
  (void)sent(2);
  for (std::uint8_t segment = 1; segment <= 127; ++segment) {
    client({segment, segment, 2, 3, 4, 5, 6, 7});
  }
  Frames frames;
  for (int i = 0; i < 10; ++i) {
    const Frames more = sent(2);
    frames.insert(frames.end(), more.begin(), more.end());
    pass(milliseconds(2));
  }
  ASSERT_EQ(frames.size(), 127U);
  EXPECT_EQ(frames[0], "605 0101020304050607");
  EXPECT_EQ(frames[126], "605 7F7F020304050607");
  EXPECT_EQ(counters(1).open, 1U);
}

TEST_F(SdoRouting, AnAbortOfEitherSideIsPassedOnAndEndsIt) {
  start();
  open();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  server({0x80, 0, 0x20, 0, 0, 0, 2, 6});
  EXPECT_EQ(sent(1), Frames{"5FF 8000200000000206"});
  EXPECT_EQ(counters(1).aborted, 1U);
  expect_nothing_left();
  open_again();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  (void)sent(2);
  client({0x80, 0, 0x20, 0, 0, 0, 0, 8});
  EXPECT_EQ(sent(2), Frames{"605 8000200000000008"});
  EXPECT_EQ(counters(1).aborted, 2U);
  expect_nothing_left();
}

TEST_F(SdoRouting, SilenceEndsItWithAnAbortToBothSides) {
  start();
  open();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  (void)sent(2);
  pass(milliseconds(990));
  EXPECT_EQ(counters(1).open, 1U);
  pass(milliseconds(20));
  EXPECT_EQ(sent(1), Frames{"5FF 8000200000000405"});
  EXPECT_EQ(sent(2), Frames{"605 8000200000000405"});
  EXPECT_EQ(counters(1).timed_out, 1U);
  expect_nothing_left();
}

// Not that of the last frame: the line of the target has received nothing since.
TEST_F(SdoRouting, TheAbortOfASilentTransferHasTheTimeOfItsEnd) {
  start();
  open();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  (void)sent(2);
  now_ += milliseconds(300);
  client({0x80, 0, 0x20, 0, 0, 0, 0, 8});
  const std::vector<Event> aborts = events(2, EventKind::sdo_abort, EventKind::sdo_abort);
  ASSERT_EQ(aborts.size(), 1U);
  EXPECT_EQ(aborts[0].time, now_);
}

TEST_F(SdoRouting, TheTargetsSideTimesOutByItselfWhenTheOtherIsGone) {
  start();
  open();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  (void)sent(2);
  for (int i = 0; i < 11; ++i) {
    now_ += milliseconds(100);
    line(2).advance(now_);  // line 1 is not advanced any more
  }
  EXPECT_EQ(sent(2), Frames{"605 8000200000000405"});
  EXPECT_EQ(counters(2).channels, 0U);
}

TEST_F(SdoRouting, TheClientMayBeginAnewWithinATransfer) {
  start();
  open();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  server({0x41, 0, 0x20, 0, 9, 0, 0, 0});
  (void)sent(1);
  (void)sent(2);
  client({0xE0, 2, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"605 8000200000000008"});
  pass(milliseconds(1));
  EXPECT_EQ(sent(1), Frames{"5FF E002000501000000"});
  EXPECT_EQ(counters(1).open, 1U);
}

TEST_F(SdoRouting, ALateAnswerOfTheTransferBeforeIsNotForwarded) {
  start();
  open();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  client({0x80, 0, 0x20, 0, 0, 0, 0, 8});
  open_again();
  client({0x40, 1, 0x20, 0, 0, 0, 0, 0});
  server({0x43, 0, 0x20, 0, 1, 2, 3, 4});  // the response to the first request
  EXPECT_EQ(sent(1), Frames{});
  server({0x43, 1, 0x20, 0, 5, 6, 7, 8});
  EXPECT_EQ(sent(1), Frames{"5FF 4301200005060708"});
}

TEST_F(SdoRouting, AResetOfTheGatewaysNodeLeavesNothingBehind) {
  start();
  open();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  line(1).execute(
      {.request = line::NmtRequest{.node = 127, .command = nmt::Command::reset_communication}},
      now_);
  carry();
  pass(milliseconds(1));
  expect_nothing_left();
  (void)sent(1);
  open_again();
}

TEST_F(SdoRouting, AStopEndsAllConnectionsOnBothSides) {
  start();
  open();
  client({0x40, 0, 0x20, 0, 0, 0, 0, 0});
  (void)sent(2);
  line(2).stop(now_);
  carry();
  EXPECT_EQ(sent(1), Frames{"5FF 8000200022000008"});
  EXPECT_EQ(sent(2).front(), "605 8000200022000008");
  expect_nothing_left();
}

// The value may have been written: device_state would say that it was not.
TEST_F(SdoRouting, AStopDuringAWriteIsATimeout) {
  for (const unsigned stopped : {2U, 1U}) {
    start();
    open();
    client({0x2F, 0, 0x20, 0, 1, 0, 0, 0});
    (void)sent(2);
    line(stopped).stop(now_);
    carry();
    EXPECT_EQ(sent(1), Frames{"5FF 8000200000000405"}) << "line " << stopped;
    expect_nothing_left();
  }
}

TEST_F(SdoRouting, AStopBeforeTheLastSegmentOfAWriteIsDeviceState) {
  for (const unsigned stopped : {2U, 1U}) {
    start();
    open();
    client({0x21, 0, 0x20, 0, 9, 0, 0, 0});
    server({0x60, 0, 0x20, 0, 0, 0, 0, 0});
    client({0x00, 1, 2, 3, 4, 5, 6, 7});
    (void)sent(1);
    (void)sent(2);
    line(stopped).stop(now_);
    carry();
    EXPECT_EQ(sent(1), Frames{"5FF 8000200022000008"}) << "line " << stopped;
    EXPECT_EQ(sent(2).front(), "605 8000200022000008") << "line " << stopped;
    expect_nothing_left();
  }
}

TEST_F(SdoRouting, AStopAfterTheLastSegmentOfAWriteIsATimeout) {
  start();
  open();
  client({0x21, 0, 0x20, 0, 5, 0, 0, 0});
  server({0x60, 0, 0x20, 0, 0, 0, 0, 0});
  client({0x05, 1, 2, 3, 4, 5, 0, 0});
  (void)sent(1);
  line(2).stop(now_);
  carry();
  EXPECT_EQ(sent(1), Frames{"5FF 8000200000000405"});
  expect_nothing_left();
}

// The server has the value when it receives the end: A1h is its answer.
TEST_F(SdoRouting, AStopDuringABlockWriteIsATimeoutFromItsEndOn) {
  for (const bool ended : {false, true}) {
    start();
    open();
    client({0xC2, 0, 0x20, 0, 7, 0, 0, 0});
    server({0xA0, 0, 0x20, 0, 127, 0, 0, 0});
    client({0x81, 1, 2, 3, 4, 5, 6, 7});
    server({0xA2, 1, 127, 0, 0, 0, 0, 0});
    if (ended) {
      client({0xC1, 0, 0, 0, 0, 0, 0, 0});
    }
    (void)sent(1);
    (void)sent(2);
    line(2).stop(now_);
    carry();
    EXPECT_EQ(sent(1), Frames{ended ? "5FF 8000200000000405" : "5FF 8000200022000008"});
    expect_nothing_left();
  }
}

// Its bus takes no frames: the server has not received the value.
TEST_F(SdoRouting, AStopBeforeTheBusTookAWriteIsDeviceState) {
  start();
  open();
  const auto fill = [this] {
    client({0x21, 0, 0x20, 0, 100, 0, 0, 0});
    server({0x60, 0, 0x20, 0, 0, 0, 0, 0});
    for (int i = 0; i < 80; ++i) {
      client({0x00, 1, 2, 3, 4, 5, 6, 7});
    }
  };
  fill();
  client({0x01, 1, 2, 3, 4, 5, 6, 7});
  line(2).stop(now_);
  carry();
  EXPECT_EQ(sent(1).back(), "5FF 8000200022000008");
  (void)sent(2);
  pass(milliseconds(1));
  expect_nothing_left();
}

}  // namespace
}  // namespace linegate::routing::test
