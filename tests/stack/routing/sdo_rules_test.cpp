// SPDX-License-Identifier: Apache-2.0
// SDO routing: access to channels and lines, the routing table, and the content of a trace.
#include <initializer_list>
#include <vector>

#include <gtest/gtest.h>

#include "stack/routing/sdo_phase.h"
#include "stack/routing/trace.h"

#include "tests/stack/routing/routed_lines.h"

namespace linegate::routing::test {
namespace {

// --- services that are not routed ---------------------------------------------------------------

TEST_F(SdoRouting, NmtSyncTimeAndErrorControlStayOnTheirLine) {
  start();
  const std::vector<can::Frame> frames = {
      can::make_frame(0x000, {0x01, 0x00}),                // NMT: start all
      can::make_frame(0x080),                              // SYNC
      can::make_frame(0x100, {0, 0, 0, 0, 0, 0}),          // TIME
      can::make_frame(0x705, {0x00}),                      // boot-up
      can::make_frame(0x705, {0x05}),                      // heartbeat
      can::make_frame(0x7E5, {0x04, 1, 0, 0, 0, 0, 0, 0})  // LSS
  };
  for (can::Frame frame : frames) {
    frame.time = now_;
    line(1).receive(std::span(&frame, 1), now_);
    line(1).advance(now_);
  }
  Message message;
  EXPECT_FALSE(line(1).pop_message(message));
  pass(milliseconds(10));
  can::Frame frame;
  EXPECT_FALSE(line(2).next_frame(frame, now_)) << frame.id;
}

// --- several connections, and access to channels ------------------------------------------------

TEST_F(SdoRouting, OneConnectionAServerSdoAndANode) {
  of_line(1).additional_servers = 2;
  of_line(2).channels = ChannelRule::per_node;
  start();
  for (const std::uint8_t server_number : std::initializer_list<std::uint8_t>{1, 2}) {
    const auto step = static_cast<std::uint8_t>(server_number * 16);
    hear(1, 0x67F, {0x23, server_number, 0x12, 1, step, 0x02, 0, 0});
    hear(1, 0x67F, {0x23, server_number, 0x12, 2, static_cast<std::uint8_t>(step + 1), 2, 0, 0});
  }
  (void)sent(1);
  open();
  hear(1, 0x210, {0xE0, 2, 0, 6, 1, 0, 0, 0});
  hear(1, 0x220, {0xE0, 2, 0, 6, 1, 0, 0, 0});  // waits for node 6
  EXPECT_EQ(counters(1).open, 2U);
  EXPECT_EQ(counters(2).channels, 3U);
  hear(1, 0x210, {0x40, 0, 0x10, 0, 0, 0, 0, 0});
  client({0x40, 1, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(2), (Frames{"606 4000100000000000", "605 4001100000000000"}));
  hear(2, 0x586, {0x43, 0, 0x10, 0, 1, 2, 3, 4});
  pass(milliseconds(1));
  EXPECT_EQ(counters(1).open, 2U);  // the waiting connection is opened
  EXPECT_EQ(counters(1).finished, 1U);
  pass(seconds(6));
  expect_nothing_left();
}

TEST_F(SdoRouting, WhoWaitsTooLongForANodeIsRefused) {
  of_line(1).additional_servers = 1;
  of_line(2).channels = ChannelRule::per_node;
  start();
  hear(1, 0x67F, {0x23, 0x01, 0x12, 1, 0x10, 0x02, 0, 0});
  hear(1, 0x67F, {0x23, 0x01, 0x12, 2, 0x11, 0x02, 0, 0});
  (void)sent(1);
  open();
  hear(1, 0x210, {0xE0, 2, 0, 5, 1, 0, 0, 0});
  pass(milliseconds(240));
  EXPECT_EQ(counters(1).refused, 0U);
  pass(milliseconds(20));  // half of the SDO time-out
  EXPECT_TRUE(refused_with(1, AbortCode::sdo_connection));
  EXPECT_EQ(counters(2).channels, 1U);
}

TEST_F(SdoRouting, AHookMayChooseTheClientSdo) {
  std::vector<unsigned> asked;
  std::uint8_t answer = 3;
  of_line(2).choose_channel = [&](std::uint16_t network, std::uint8_t node) {
    asked.push_back(network * 1000U + node);
    return answer;
  };
  start();
  open();
  EXPECT_EQ(asked, std::vector<unsigned>{2005});
  answer = 0;
  client({0xE0, 2, 0, 6, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000023000A06"});
}

TEST_F(SdoRouting, ATransferGoesThroughTheArbiterOfTheTargetLine) {
  start();
  open();
  line(2).execute({.tag = 1, .request = line::SdoRead{.node = 5, .address = {0x1008, 0}}}, now_);
  EXPECT_EQ(sent(2), Frames{});  // waits until the connection is over
  client({0x40, 0, 0x10, 0, 0, 0, 0, 0});
  server({0x43, 0, 0x10, 0, 0x91, 1, 2, 3});
  pass(milliseconds(1));
  EXPECT_EQ(sent(2), (Frames{"605 4000100000000000", "605 4008100000000000"}));
  EXPECT_EQ(line(2).state().counters.sdo_transfers, 1U);
}

// --- access -------------------------------------------------------------------------------------

TEST_F(SdoRouting, AccessIsClosedUnlessARuleOpensIt) {
  of_line(2).access = {{.first = 2, .last = 9, .sdo_read = true}};
  start();
  client({0xE0, 2, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000021000008"});
  EXPECT_TRUE(refused_with(2, AbortCode::local_control));
  EXPECT_EQ(counters(2).not_permitted, 1U);
  EXPECT_EQ(counters(2).channels, 0U);
}

TEST_F(SdoRouting, AReaderMayNotWrite) {
  of_line(2).access = {{.first = 1, .last = 1, .sdo_read = true}};
  start();
  for (const std::uint8_t initiate : std::initializer_list<std::uint8_t>{0x23, 0x21, 0xC6}) {
    open_again();
    client({initiate, 0, 0x20, 1, 9, 0, 0, 0});
    EXPECT_EQ(sent(1), Frames{"5FF 8000200102000106"});
    EXPECT_TRUE(refused_with(2, AbortCode::read_only));
  }
  EXPECT_EQ(sent(2), Frames{});
  expect_nothing_left();
}

TEST_F(SdoRouting, AWriterMayNotRead) {
  of_line(2).access = {{.first = 1, .last = 1, .sdo_write = true}};
  start();
  for (const std::uint8_t initiate : std::initializer_list<std::uint8_t>{0x40, 0xA4}) {
    open_again();
    client({initiate, 0, 0x20, 1, 9, 0, 0, 0});
    EXPECT_EQ(sent(1), Frames{"5FF 8000200101000106"});
  }
  EXPECT_EQ(counters(2).not_permitted, 2U);
  expect_nothing_left();
}

// The next gateway has reserved the connection beyond it, so it must be aborted.
TEST_F(SdoRouting, TheNextGatewayIsToldOfATransferThatIsNotPermitted) {
  with_next_gateway();
  of_line(2).access = {{.first = 1, .last = 1, .sdo_read = true}};
  start();
  client({0xE0, 3, 0, 5, 1, 0, 0, 0});
  ASSERT_EQ(sent(2), Frames{"609 E003000502000000"});
  hear(2, 0x589, {0xE0, 3, 0, 5, 2, 0, 0, 0});
  ASSERT_EQ(sent(1), Frames{"5FF E003000501000000"});
  client({0x23, 0, 0x20, 1, 9, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000200102000106"});
  EXPECT_EQ(sent(2), Frames{"609 8000000000000008"});
  expect_nothing_left();
}

TEST_F(SdoRouting, ALateAbortOfAnotherTransferDoesNotRefuseAnIndication) {
  with_next_gateway();
  start();
  client({0xE0, 3, 0, 5, 1, 0, 0, 0});
  ASSERT_EQ(sent(2), Frames{"609 E003000502000000"});
  hear(2, 0x589, {0x80, 0, 0x20, 1, 0, 0, 4, 5});
  EXPECT_EQ(sent(1), Frames{});
  hear(2, 0x589, {0xE0, 3, 0, 5, 2, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF E003000501000000"});
}

TEST_F(SdoRouting, ALineThatStopsIsEnteredNoMore) {
  start();
  line(2).stop(now_);
  client({0xE0, 2, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000022000008"});
  EXPECT_EQ(counters(2).channels, 0U);
}

// The rules of this gateway permit both. Codes of the target and of the next gateway may be the
// same as those of the rules.
TEST_F(SdoRouting, RefusalsOfTheTargetAndOfTheNextGatewayAreNotThoseOfTheRules) {
  with_next_gateway();
  start();
  open();
  client({0x23, 0, 0x20, 1, 9, 0, 0, 0});
  ASSERT_EQ(sent(2), Frames{"605 2300200109000000"});
  server({0x80, 0, 0x20, 1, 0x02, 0, 0x01, 0x06});
  EXPECT_EQ(sent(1), Frames{"5FF 8000200102000106"});
  EXPECT_EQ(counters(1).aborted, 1U);
  client({0xE0, 3, 0, 5, 1, 0, 0, 0});
  ASSERT_EQ(sent(2), Frames{"609 E003000502000000"});
  hear(2, 0x589, {0x80, 0, 0, 0, 0x21, 0, 0, 0x08});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000021000008"});
  EXPECT_EQ(counters(1).refused, 1U);
  for (const unsigned number : {1U, 2U}) {
    EXPECT_EQ(counters(number).not_permitted, 0U);
  }
}

// --- 1F2Ch --------------------------------------------------------------------------------------

TEST_F(SdoRouting, TheTableIsReadAndWrittenBySdoAndTakesEffect) {
  start();
  client({0x40, 0x2C, 0x1F, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 4F2C1F0001000000"});
  client({0x40, 0x2C, 0x1F, 1, 0, 0, 0, 0});
  client({0x60, 0, 0, 0, 0, 0, 0, 0});
  client({0x70, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1),
            (Frames{"5FF 412C1F0108000000", "5FF 0002000200020000", "5FF 1D00000000000000"}));
  // Entry 2: networks 3 to 4 over interface 2, next gateway 9, cost 1.
  client({0x21, 0x2C, 0x1F, 2, 8, 0, 0, 0});
  client({0x00, 3, 0, 4, 0, 2, 9, 1});
  client({0x1D, 0, 0, 0, 0, 0, 0, 0});
  client({0x2F, 0x2C, 0x1F, 0, 2, 0, 0, 0});
  EXPECT_EQ(sent(1).back(), "5FF 602C1F0000000000");
  client({0xE0, 4, 0, 7, 1, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{"609 E004000702000000"});
}

TEST_F(SdoRouting, ABadWriteToTheTableIsRefused) {
  start();
  const auto write = [&](std::initializer_list<std::uint8_t> first, std::uint8_t last) {
    client({0x21, 0x2C, 0x1F, 1, 8, 0, 0, 0});
    client(first);
    client({0x1D, last, 0, 0, 0, 0, 0, 0});
    return sent(1).back();
  };
  EXPECT_EQ(write({0x00, 2, 0, 2, 0, 7, 0, 0}, 0), "5FF 802C1F0130000906");    // no interface 7
  EXPECT_EQ(write({0x00, 3, 0, 3, 0, 2, 126, 0}, 0), "5FF 802C1F0130000906");  // the own node
  // First network 4, last network 3
  EXPECT_EQ(write({0x00, 4, 0, 3, 0, 2, 9, 0}, 0), "5FF 802C1F0130000906");
  client({0x2F, 0x2C, 0x1F, 0, 255, 0, 0, 0});
  EXPECT_EQ(sent(1).back(), "5FF 802C1F0031000906");
  // A second route of equal cost: refused when sub-index 0 is written.
  client({0x21, 0x2C, 0x1F, 2, 8, 0, 0, 0});
  client({0x00, 2, 0, 2, 0, 2, 0, 0});
  client({0x1D, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1).back(), "5FF 3000000000000000");
  client({0x2F, 0x2C, 0x1F, 0, 2, 0, 0, 0});
  EXPECT_EQ(sent(1).back(), "5FF 802C1F0043000406");
}

TEST_F(SdoRouting, TheNetworkIdsOfTheLinesAreReadable) {  // 5F20h
  start();
  client({0x40, 0x20, 0x5F, 2, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 4B205F0202000000"});
  client({0x2B, 0x20, 0x5F, 2, 7, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 80205F0202000106"});
}

// --- trace --------------------------------------------------------------------------------------

class TracedRouting : public SdoRouting {
 protected:
  void trace(std::uint16_t seconds_long) {
    line(1).execute(
        {.tag = 1, .request = line::RoutingTrace{.duration = std::chrono::seconds(seconds_long)}},
        now_);
  }
  std::vector<Event> emitted() {
    return events(1, EventKind::routing_opened, EventKind::routing_ended);
  }
  void transfer() {
    open_again();
    client({0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
    server({0x4B, 0x18, 0x10, 1, 0x91, 1, 0, 0});
    (void)sent(1);
  }
};

TEST_F(TracedRouting, ConnectionsAreEventsWhileSomebodyAskedForThem) {
  start();
  transfer();
  EXPECT_TRUE(emitted().empty());
  trace(10);
  transfer();
  const std::vector<Event> one = emitted();
  ASSERT_EQ(one.size(), 2U);
  const std::uint32_t connection = std::get<event::RoutingOpened>(one[0].data).connection;
  EXPECT_EQ(one[0].data, EventData(event::RoutingOpened{.connection = connection,
                                                        .suppressed = 0,
                                                        .source = 1,
                                                        .target = 2,
                                                        .target_node = 5,
                                                        .interface = 2,
                                                        .gateway = 0,
                                                        .hops = 1}));
  EXPECT_EQ(one[1].data, EventData(event::RoutingEnded{.connection = connection,
                                                       .abort = AbortCode::none,
                                                       .bytes = 2,
                                                       .source = 1,
                                                       .target = 2,
                                                       .index = 0x1018,
                                                       .sub = 1,
                                                       .target_node = 5,
                                                       .interface = 2,
                                                       .gateway = 0,
                                                       .service = event::SdoService::upload}));
  trace(5);  // a second listener, with a shorter time
  pass(seconds(9));
  transfer();
  EXPECT_EQ(emitted().size(), 2U);
  pass(seconds(1));
  transfer();
  EXPECT_TRUE(emitted().empty());
}

TEST_F(TracedRouting, AnEndTellsWhyAndOfWhichTransfer) {
  start();
  trace(100);
  open();
  client({0x23, 0, 0x20, 1, 9, 0, 0, 0});
  server({0x80, 0, 0x20, 1, 0, 0, 2, 6});  // abort: the object does not exist
  (void)sent(1);
  std::vector<Event> seen = emitted();
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(std::get<event::RoutingEnded>(seen[1].data).abort, AbortCode::no_object);
  EXPECT_EQ(std::get<event::RoutingEnded>(seen[1].data).service, event::SdoService::download);
  open_again();
  pass(seconds(6));
  seen = emitted();
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(std::get<event::RoutingEnded>(seen[1].data).abort, AbortCode::timeout);
  EXPECT_EQ(std::get<event::RoutingEnded>(seen[1].data).service, event::SdoService::none)
      << "no transfer began";
}

TEST_F(TracedRouting, AToolThatDoesManyTransfersDoesNotDrownOtherEvents) {
  start();
  trace(100);
  for (int i = 0; i < 70; ++i) {
    transfer();
  }
  EXPECT_EQ(emitted().size(), 2U * Trace::kMostASecond);
  pass(seconds(1));
  transfer();
  const std::vector<Event> later = emitted();
  ASSERT_EQ(later.size(), 2U);
  EXPECT_EQ(std::get<event::RoutingOpened>(later[0].data).suppressed, 20U);
}

TEST_F(TracedRouting, ATraceOfNoTimeOrOfALineWithoutRoutesIsRefused) {
  start();
  line::Reply reply;
  for (const std::uint16_t wrong : std::initializer_list<std::uint16_t>{0, 3601}) {
    trace(wrong);
    ASSERT_TRUE(line(1).pop_reply(reply));
    EXPECT_EQ(reply.error, to_error(line::Refusal::bad_request));
  }
  line::LineConfig alone;
  alone.name = "alone";
  alone.node_id = 127;
  auto made = line::Line::make(alone);
  ASSERT_TRUE(made.ok());
  (*made.value)->start(now_);
  (*made.value)
      ->execute({.tag = 1, .request = line::RoutingTrace{.duration = std::chrono::seconds(5)}},
                now_);
  ASSERT_TRUE((*made.value)->pop_reply(reply));
  EXPECT_EQ(reply.error, to_error(line::Refusal::wrong_role));
}

std::uint64_t word(std::initializer_list<unsigned> bytes) {
  std::uint64_t out = 0;
  unsigned shift = 0;
  for (const unsigned byte : bytes) {
    out |= std::uint64_t{byte} << shift;
    shift += 8;
  }
  return out;
}

TEST(BytesOfATransfer, AreCountedInSegments) {
  SdoPhase phase;
  EXPECT_EQ(phase.service(), SdoPhase::Service::none);
  phase.request(word({0x40, 8, 0x10, 0}));
  phase.response(word({0x41, 8, 0x10, 0, 10}));
  phase.request(word({0x60}));
  phase.response(word({0x00}));
  phase.request(word({0x70}));
  EXPECT_EQ(phase.response(word({0x19})), SdoPhase::End::finished);
  EXPECT_EQ(phase.bytes(), 10U);
  EXPECT_EQ(phase.service(), SdoPhase::Service::upload);
  phase.request(word({0x21, 0, 0x20, 0, 8}));
  phase.response(word({0x60, 0, 0x20, 0}));
  phase.request(word({0x00}));
  phase.response(word({0x20}));
  phase.request(word({0x1D}));
  EXPECT_EQ(phase.response(word({0x30})), SdoPhase::End::finished);
  EXPECT_EQ(phase.bytes(), 8U);
  EXPECT_EQ(phase.service(), SdoPhase::Service::download);
}

TEST(BytesOfATransfer, AreCountedInBlocksAsTheyAreAcknowledged) {
  SdoPhase phase;
  phase.request(word({0xC6, 0, 0x20, 0, 10}));
  phase.response(word({0xA4, 0, 0x20, 0, 127}));
  phase.request(word({0x01}));
  phase.request(word({0x82}));
  phase.response(word({0xA2, 1, 127}));  // the second segment was lost
  phase.request(word({0x81}));
  phase.response(word({0xA2, 1, 127}));
  phase.request(word({0xD1}));  // 4 bytes are unused
  EXPECT_EQ(phase.response(word({0xA1})), SdoPhase::End::finished);
  EXPECT_EQ(phase.bytes(), 10U);
  phase.request(word({0xA4, 0, 0x20, 0, 127}));
  phase.response(word({0xC6, 0, 0x20, 0, 0xC5, 1}));
  phase.request(word({0xA3}));
  for (unsigned number = 1; number < 65; ++number) {
    phase.response(word({number}));
  }
  phase.response(word({0xC1}));  // segment 65, which looks like an end
  phase.request(word({0xA2, 65, 127}));
  phase.response(word({0xC9}));  // 2 bytes are unused
  EXPECT_EQ(phase.request(word({0xA1})), SdoPhase::End::finished);
  EXPECT_EQ(phase.bytes(), 453U);
}

}  // namespace
}  // namespace linegate::routing::test
