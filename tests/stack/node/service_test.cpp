// SPDX-License-Identifier: Apache-2.0
// The services of a whole node: objects that take effect immediately, PDOs, EMCY, order, wake-ups.
#include "stack/time/service.h"

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using Frames = std::vector<Sent>;

TEST_F(NodeTest, AHeartbeatStartsWithTheWrite) {
  boot();
  EXPECT_EQ(sdo_write({0x1017, 0}, 2, 100, 7ms), 0U);
  EXPECT_EQ(others, (Frames{{at(7ms), 0x705, {0x7F}}}));
  EXPECT_EQ(node->next_wake(), at(107ms));
  EXPECT_EQ(advance(107ms), (Frames{{at(107ms), 0x705, {0x7F}}}));
  nmt(0x02, kNodeId, 150ms);
  EXPECT_EQ(advance(207ms), (Frames{{at(207ms), 0x705, {0x04}}}));
}

TEST_F(NodeTest, ASyncCommitsRpdosAndSamplesTpdos) {
  boot_and_start();
  hear(1ms, 0x305, {0xCD, 0xAB});
  EXPECT_EQ(number(0x2000, 2), 0x2222U);
  ASSERT_TRUE(node->dictionary().set({0x2001, 1}, 0x1234));
  hear(2ms, 0x080, {});
  EXPECT_EQ(number(0x2000, 2), 0xABCDU);
  EXPECT_EQ(drain(at(2ms)), (Frames{{at(2ms), 0x185, {0x34, 0x12}}}));
}

// A synchronous TPDO transmits 1013h with each SYNC: consumers learn the exact time of the SYNC.
TEST_F(NodeTest, ASyncProducerStampsItsSyncs) {
  od::Dictionary dictionary = example_dictionary();
  ASSERT_TRUE(dictionary.remove(0x1A00).ok());
  using enum od::DataType;
  ASSERT_TRUE(dictionary.add(testing::object(0x1013, unsigned32, 0, od::Access::rw, true)).ok());
  ASSERT_TRUE(dictionary
                  .add(testing::record(0x1A00, {testing::sub(0, unsigned8, 1),
                                                testing::sub(1, unsigned32, 0x1013'0020)}))
                  .ok());
  node =
      std::make_unique<Node>(std::move(dictionary), Options{.node_id = kNodeId}, events, nullptr);
  boot_and_start();
  EXPECT_EQ(sdo_write({0x1006, 0}, 4, 10'000), 0U);
  EXPECT_EQ(sdo_write({0x1005, 0}, 4, 0x4000'0080), 0U);
  // 1000.010 s are 3B9AF110h us.
  const Frames expected{{at(10ms), 0x080, {}}, {at(10ms), 0x185, {0x10, 0xF1, 0x9A, 0x3B}}};
  EXPECT_EQ(advance(10ms), expected);
}

// 1007h: 5 ms after each SYNC.
TEST_F(NodeTest, ASynchronousRpdoAfterTheWindowIsDropped) {
  boot_and_start();
  EXPECT_EQ(sdo_write({0x1007, 0}, 4, 5000), 0U);
  hear(1ms, 0x305, {0x01, 0x00});
  hear(10ms, 0x080, {});
  EXPECT_EQ(number(0x2000, 2), 1U) << "no window before the first SYNC";
  hear(15ms, 0x305, {0x02, 0x00});
  hear(16ms, 0x305, {0x03, 0x00});
  hear(16ms, 0x205, {0x04, 0x00});
  EXPECT_EQ(number(0x2000, 1), 4U) << "event-driven RPDOs have no window";
  hear(20ms, 0x080, {});
  EXPECT_EQ(number(0x2000, 2), 2U);
  EXPECT_EQ(node->pdos().counters().after_window, 1U);
  EXPECT_EQ(sdo_write({0x1007, 0}, 4, 0, 21ms), 0U);
  hear(29ms, 0x305, {0x05, 0x00});
  hear(30ms, 0x080, {});
  EXPECT_EQ(number(0x2000, 2), 5U) << "without a window";
}

TEST_F(NodeTest, ASynchronousTpdoThatFoundNoRoomInTheWindowIsDropped) {
  boot_and_start();
  EXPECT_EQ(sdo_write({0x1007, 0}, 4, 5000), 0U);
  hear(10ms, 0x080, {});
  EXPECT_EQ(node->next_wake(), at(15ms));
  EXPECT_EQ(drain(at(14ms)), (Frames{{at(14ms), 0x185, {0x11, 0x11}}}));
  hear(20ms, 0x080, {});
  EXPECT_TRUE(node->wants_to_send(at(20ms)));
  node->advance(at(25ms));
  EXPECT_FALSE(node->wants_to_send(at(25ms)));
  EXPECT_TRUE(drain(at(25ms)).empty());
  hear(30ms, 0x080, {});
  EXPECT_FALSE(node->wants_to_send(at(36ms))) << "also when called late";
  EXPECT_TRUE(drain(at(36ms)).empty());
  EXPECT_EQ(node->pdos().counters().after_window, 2U);
  hear(40ms, 0x080, {});
  EXPECT_EQ(drain(at(41ms)).size(), 1U);
}

// Type 0: the event has occurred, and no other frame carries the value.
TEST_F(NodeTest, AnAcyclicTpdoThatFoundNoRoomInTheWindowIsSentAfterTheNextSync) {
  node->dictionary().set(od::Address{0x1800, 2}, std::uint8_t{0});
  boot_and_start();
  EXPECT_EQ(sdo_write({0x1007, 0}, 4, 5000), 0U);
  hear(10ms, 0x080, {});  // sends the value that was due at the start
  EXPECT_TRUE(node->wants_to_send(at(10ms)));
  node->advance(at(15ms));
  EXPECT_TRUE(drain(at(15ms)).empty());
  EXPECT_EQ(node->pdos().counters().after_window, 1U);
  hear(20ms, 0x080, {});
  EXPECT_EQ(drain(at(21ms)), (Frames{{at(21ms), 0x185, {0x11, 0x11}}}));
  hear(30ms, 0x080, {});
  EXPECT_TRUE(drain(at(31ms)).empty());
}

TEST_F(NodeTest, AProducerActsUponItsOwnSync) {
  boot_and_start();
  EXPECT_EQ(sdo_write({0x1006, 0}, 4, 10'000), 0U);
  EXPECT_EQ(sdo_write({0x1005, 0}, 4, 0x4000'0080), 0U);
  hear(1ms, 0x305, {0xCD, 0xAB});
  const Frames expected{{at(10ms), 0x080, {}}, {at(10ms), 0x185, {0x11, 0x11}}};
  EXPECT_EQ(advance(10ms), expected);
  EXPECT_EQ(number(0x2000, 2), 0xABCDU);
  EXPECT_EQ(node->counters().syncs, 1U);
  nmt(0x02);
  EXPECT_TRUE(advance(20ms).empty());
}

struct Watch : Application {
  void time_received(const time::TimeOfDay& time, Instant now) override { got = {time, now}; }
  std::pair<time::TimeOfDay, Instant> got{};
};

TEST_F(NodeTest, ATimeMessageIsToldToTheApplication) {
  Watch application;
  node->set_application(&application);
  boot();
  hear(3ms, 0x100, {0xE8, 0x03, 0, 0, 7, 0});
  EXPECT_EQ(application.got, (std::pair{time::TimeOfDay{1000, 7}, at(3ms)}));
  EXPECT_EQ(node->clock().network_utc(at(5ms)), time::to_utc({1002, 7}));
  EXPECT_EQ(node->counters().times, 1U);
  nmt(0x02);
  hear(4ms, 0x100, {0xE9, 0x03, 0, 0, 7, 0});
  EXPECT_EQ(node->counters().times, 1U) << "not in Stopped";
}

TEST_F(NodeTest, ATimeProducerSendsInTheOrderOfTheBus) {
  boot();
  node->clock().set_utc(Duration{std::chrono::seconds(441'763'200)} - at(0s).time_since_epoch());
  node->clock().produce_every(1s);
  EXPECT_EQ(sdo_write({0x1012, 0}, 4, 0x4000'0100), 0U);
  EXPECT_EQ(node->next_wake(), at(1s));
  EXPECT_EQ(advance(1s), (Frames{{at(1s), 0x100, {0xE8, 0x03, 0, 0, 0, 0}}}));
}

TEST_F(NodeTest, TheObjectsRefuseWhatTheyMust) {
  boot();
  EXPECT_EQ(sdo_write({0x1019, 0}, 1, 1), 0x0609'0030U);
  EXPECT_EQ(sdo_write({0x1006, 0}, 4, 1000), 0U);
  EXPECT_EQ(sdo_write({0x1019, 0}, 1, 10), 0x0800'0022U);
  EXPECT_EQ(sdo_write({0x1014, 0}, 4, 0x86), 0x0609'0030U);
  EXPECT_EQ(sdo_write({0x1003, 0}, 1, 5), 0x0609'0030U);
  EXPECT_EQ(sdo_write({0x1016, 1}, 4, 0x0007'0064), 0U);
  EXPECT_EQ(sdo_write({0x1016, 2}, 4, 0x0007'0064), 0x0604'0043U);
}

TEST_F(NodeTest, ALostHeartbeatIsAnEmcyAndEndsOperational) {
  boot_and_start();
  sdo_write({0x1016, 1}, 4, 0x0007'0064);
  hear(10ms, 0x707, {0x05});
  testing::pop_events(events);
  const Frames lost{{at(110ms), 0x085, {0x30, 0x81, 0x11, 7, 0, 0, 0, 0}}};
  EXPECT_EQ(node->next_wake(), at(110ms));
  EXPECT_EQ(advance(110ms), lost);
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
  EXPECT_EQ(kinds(), (std::vector<EventKind>{EventKind::heartbeat_lost, EventKind::emcy_sent,
                                             EventKind::own_state}));
  hear(120ms, 0x707, {0x05});
  const Frames back{{at(120ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(120ms)), back);
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
}

TEST_F(NodeTest, ErrorBehaviourSaysWhatALostHeartbeatDoes) {
  const std::pair<std::uint32_t, nmt::State> table[] = {
      {0, nmt::State::pre_operational}, {1, nmt::State::operational}, {2, nmt::State::stopped}};
  boot();
  Duration time = 0ms;
  for (const auto& [behaviour, state] : table) {
    nmt(0x82, kNodeId, time);
    nmt(0x01, kNodeId, time);
    sdo_write({0x1029, 1}, 1, behaviour, time);
    sdo_write({0x1016, 1}, 4, 0x0007'0064, time);
    hear(time, 0x707, {0x05});
    advance(time + 100ms);
    EXPECT_EQ(node->state(), state) << behaviour;
    time += 1s;
  }
}

TEST_F(NodeTest, EmcysOfListedNodesBecomeEvents) {
  boot();
  sdo_write({0x1028, 7}, 4, 0x87);
  hear(1ms, 0x087, {0x00, 0x10, 0x01, 0, 0, 0, 0, 0});
  hear(1ms, 0x088, {0x00, 0x10, 0x01, 0, 0, 0, 0, 0});
  EXPECT_EQ(kinds(), (std::vector<EventKind>{EventKind::emcy}));
  EXPECT_EQ(node->counters().unused, 1U);
}

TEST_F(NodeTest, AShortRpdoIsAnEmcyUntilARightOneComes) {
  boot_and_start();
  hear(1ms, 0x205, {0x01});
  const Frames error{{at(1ms), 0x085, {0x10, 0x82, 0x11, 1, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(1ms)), error);
  EXPECT_EQ(number(0x2000, 1), 0x1111U);
  EXPECT_EQ(number(0x1001, 0), 0x11U);
  EXPECT_EQ(number(0x1003, 1), 0x0001'8210U);
  hear(2ms, 0x205, {0x01});
  EXPECT_TRUE(drain(at(2ms)).empty());
  hear(3ms, 0x205, {0x01, 0x00});
  const Frames reset{{at(3ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(3ms)), reset);
  EXPECT_EQ(number(0x1001, 0), 0U);
}

TEST_F(NodeTest, ALongRpdoIsUsedAndAnEmcy) {
  boot_and_start();
  hear(1ms, 0x205, {0x01, 0x00, 0xFF});
  const Frames error{{at(1ms), 0x085, {0x20, 0x82, 0x11, 1, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(1ms)), error);
  EXPECT_EQ(number(0x2000, 1), 1U);
  hear(2ms, 0x205, {0x02, 0x00, 0xFF});
  EXPECT_TRUE(drain(at(2ms)).empty());
  hear(3ms, 0x205, {0x03, 0x00});
  const Frames reset{{at(3ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(3ms)), reset);
  EXPECT_EQ(number(0x1001, 0), 0U);
  hear(4ms, 0x205, {0x01, 0x00, 0xFF});
  EXPECT_EQ(drain(at(4ms)).size(), 1U) << "an error again";
}

TEST_F(NodeTest, ASynchronousRpdoThatWasTooLongIsRightAgain) {
  boot_and_start();
  hear(1ms, 0x305, {0x01, 0x00, 0xFF});
  EXPECT_EQ(drain(at(1ms)).size(), 1U);
  hear(2ms, 0x080, {});
  EXPECT_EQ(number(0x1001, 0), 0x11U);
  hear(3ms, 0x305, {0x01, 0x00});
  EXPECT_EQ(number(0x1001, 0), 0U);
}

TEST_F(NodeTest, AWrongLengthOutlastsPreOperationalButNotTheRpdo) {
  boot_and_start();
  hear(1ms, 0x205, {0x01, 0x00, 0xFF});
  hear(1ms, 0x305, {0x01});
  nmt(0x80, kNodeId, 2ms);
  nmt(0x01, kNodeId, 2ms);
  hear(3ms, 0x205, {0x01, 0x00});
  EXPECT_EQ(number(0x1001, 0), 0x11U);
  EXPECT_EQ(sdo_write({0x1401, 1}, 4, 0x8000'0305), 0U);
  EXPECT_EQ(number(0x1001, 0), 0U);
}

TEST_F(NodeTest, ADeadlineThatPassedIsOverWithTheRpdo) {
  boot_and_start();
  EXPECT_EQ(sdo_write({0x1400, 5}, 2, 50), 0U);
  hear(10ms, 0x205, {0x01, 0x00});
  advance(60ms);
  EXPECT_EQ(number(0x1001, 0), 0x11U);
  EXPECT_EQ(sdo_write({0x1400, 1}, 4, 0x8000'0205, 61ms), 0U);
  EXPECT_EQ(number(0x1001, 0), 0U);
}

TEST_F(NodeTest, AnRpdoDeadlineIsAnEmcy) {
  boot_and_start();
  EXPECT_EQ(sdo_write({0x1400, 5}, 2, 50), 0U);
  hear(10ms, 0x205, {0x01, 0x00});
  const Frames error{{at(60ms), 0x085, {0x50, 0x82, 0x11, 1, 0, 0, 0, 0}}};
  EXPECT_EQ(advance(60ms), error);
  hear(70ms, 0x205, {0x01, 0x00});
  const Frames reset{{at(70ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(70ms)), reset);
}

TEST_F(NodeTest, ErrorsOfTheApplicationStayInTheRegister) {
  boot_and_start();
  node->emcy().send(0x2310, 0x03, {}, at(0ms));
  hear(1ms, 0x205, {0x01});
  EXPECT_EQ(number(0x1001, 0), 0x13U);
  hear(2ms, 0x205, {0x01, 0x00});
  EXPECT_EQ(number(0x1001, 0), 0x03U);
}

TEST_F(NodeTest, FramesLeaveInTheOrderOfTheBus) {
  boot_and_start();
  sdo_write({0x1017, 0}, 2, 10, 0ms);
  drain(at(0ms));
  hear(1ms, 0x080, {});
  hear(1ms, 0x605, {0x40, 0x00, 0x20, 0x01, 0, 0, 0, 0});
  node->emcy().send(0x1000, 0x01, {}, at(1ms));
  node->advance(at(10ms));
  EXPECT_TRUE(node->wants_to_send(at(10ms)));
  std::vector<std::uint32_t> ids;
  for (const Sent& sent : drain(at(10ms))) {
    ids.push_back(sent.id);
  }
  EXPECT_EQ(ids, (std::vector<std::uint32_t>{0x085, 0x185, 0x585, 0x705}));
  EXPECT_FALSE(node->wants_to_send(at(10ms)));
}

// Callers that skip idle rounds rely on these counters.
TEST_F(NodeTest, FramesOfServicesAreCountedAsServedAndPdosThatAreSentAreNot) {
  boot_and_start();
  std::uint64_t served = node->served();
  const auto grows = [&] { return std::exchange(served, node->served()) != served; };
  hear(3ms, 0x080, {});
  EXPECT_TRUE(grows()) << "SYNC";
  ASSERT_FALSE(drain(at(3ms)).empty());
  EXPECT_FALSE(grows()) << "a transmitted TPDO";
  hear(4ms, 0x605, {0x40, 0x00, 0x20, 0x01, 0, 0, 0, 0});
  ASSERT_EQ(drain(at(4ms)).size(), 1U);
  EXPECT_TRUE(grows()) << "SDO";
  hear(5ms, 0x123, {});
  EXPECT_TRUE(grows()) << "an unknown identifier";
}

struct Witness : MasterServices {
  void receive(const can::Target& target, const can::Frame& frame) override {
    got.push_back({target.service, frame.id});
  }
  void synced(Instant /*now*/) override { ++syncs; }

  std::vector<std::pair<can::Service, std::uint32_t>> got;
  int syncs = 0;
};

TEST_F(NodeTest, MasterServicesGetWhatTheNodeDoesNotServe) {
  Witness master_services;
  node->set_master_services(&master_services);
  using enum can::Service;
  node->dispatch().add(0x587, false, sdo_client, 0);
  node->dispatch().add(0x607, false, sdo_server, 0x107);
  node->dispatch().add(0x707, false, error_control, 7);
  node->dispatch().add(0x087, false, can::Service::emcy, 7);
  boot();
  sdo_write({0x1016, 1}, 4, 0x0007'0064);
  testing::pop_events(events);
  for (const std::uint32_t id : {0x587U, 0x607U, 0x707U, 0x087U}) {
    hear(1ms, id, {0x05});
  }
  hear(2ms, 0x080, {});
  const std::vector<std::pair<can::Service, std::uint32_t>> expected{{sdo_client, 0x587},
                                                                     {sdo_server, 0x607},
                                                                     {error_control, 0x707},
                                                                     {can::Service::emcy, 0x087}};
  EXPECT_EQ(master_services.got, expected);
  EXPECT_EQ(master_services.syncs, 1);
  EXPECT_EQ(kinds(), (std::vector<EventKind>{EventKind::node_state}));
}

TEST_F(NodeTest, FurtherSdoServersAnswerOnTheirOwnIdentifiers) {
  using enum od::DataType;
  od::Dictionary dictionary = example_dictionary();
  ASSERT_TRUE(dictionary
                  .add(testing::record(0x1201, {testing::sub(0, unsigned8, 2, od::Access::constant),
                                                testing::sub(1, unsigned32, 0x8000'0000),
                                                testing::sub(2, unsigned32, 0x8000'0000)}))
                  .ok());
  node =
      std::make_unique<Node>(std::move(dictionary), Options{kNodeId, false, true}, events, nullptr);
  boot();
  EXPECT_EQ(sdo_write({0x1201, 1}, 4, 0x640), 0x0609'0030U);
  EXPECT_EQ(sdo_write({0x1201, 1}, 4, 0x6C0), 0U);
  hear(1ms, 0x6C0, {0x40, 0x00, 0x20, 0x01, 0, 0, 0, 0});
  EXPECT_TRUE(drain(at(1ms)).empty());
  EXPECT_EQ(sdo_write({0x1201, 2}, 4, 0x6C1), 0U);
  hear(2ms, 0x6C0, {0x40, 0x00, 0x20, 0x01, 0, 0, 0, 0});
  const Frames answer{{at(2ms), 0x6C1, {0x4B, 0x00, 0x20, 0x01, 0x11, 0x11, 0, 0}}};
  EXPECT_EQ(drain(at(2ms)), answer);
}

// No other report explains why such a PDO is never used. The reset restores the valid mapping.
TEST_F(NodeTest, APdoThatCannotBeUsedIsTold) {
  od::Dictionary dictionary = example_dictionary();
  ASSERT_TRUE(dictionary.set(od::Address{0x1A01, 1}, std::uint32_t{0x2001'0208}));
  node =
      std::make_unique<Node>(std::move(dictionary), Options{.node_id = kNodeId}, events, nullptr);
  node->start(at(1ms));
  const auto told = testing::pop_events(events);
  const auto it = std::ranges::find(told, EventKind::configuration_error, &Event::kind);
  ASSERT_NE(it, told.end());
  EXPECT_EQ(it->time, at(1ms));
  EXPECT_EQ(it->node, kNodeId);
  EXPECT_EQ(it->data, EventData(event::ConfigurationError{
                          .abort = AbortCode::length_mismatch, .index = 0x1A01, .sub = 1}));
  nmt(0x81);
  EXPECT_EQ(kinds(), (std::vector<EventKind>{EventKind::own_state, EventKind::own_state}));
}

TEST_F(NodeTest, RemoteFramesAreForTpdosOnly) {
  boot_and_start();
  can::Frame remote = frame_at(at(1ms), 0x285, {});
  remote.flags = can::Frame::kRemote;
  node->receive({&remote, 1});
  EXPECT_EQ(drain(at(1ms)), (Frames{{at(1ms), 0x285, {0x22, 0x22}}}));
  for (const std::uint32_t id : {0x000U, 0x080U, 0x185U, 0x205U, 0x605U}) {
    remote.id = id;
    node->receive({&remote, 1});
  }
  EXPECT_EQ(node->counters().unused, 5U);
  EXPECT_TRUE(drain(at(1ms)).empty());
  EXPECT_EQ(node->state(), nmt::State::operational);
  EXPECT_EQ(node->counters().malformed, 0U);
}

// A SYNC producer, a heartbeat producer, an event timer, inhibited EMCYs and a lost heartbeat.
TEST_F(NodeTest, WakingWhenToldIsAsGoodAsWakingAllTheTime) {
  const auto run = [this](bool polling) {
    events = EventLog();
    node =
        std::make_unique<Node>(example_dictionary(), Options{kNodeId, true, true}, events, nullptr);
    Frames sent;
    const auto collect = [&](Instant now) {
      for (Sent& frame : drain(now)) {
        sent.push_back(std::move(frame));
      }
    };
    node->start(at(0ms));
    sdo_write({0x1029, 1}, 1, 1);
    sdo_write({0x1006, 0}, 4, 1300);
    sdo_write({0x1005, 0}, 4, 0x4000'0080);
    sdo_write({0x1017, 0}, 2, 7);
    sdo_write({0x1015, 0}, 2, 50);
    sdo_write({0x1016, 1}, 4, 0x0007'0011);
    sdo_write({0x1801, 5}, 2, 3);
    hear(0ms, 0x707, {0x05});
    for (int i = 0; i < 3; ++i) {
      node->emcy().send(0x1000, 0x01, {}, at(0ms));
    }
    collect(at(0ms));
    const Instant end = at(100ms);
    for (Instant now = at(0ms); now <= end;
         now = polling ? now + 100us : std::max(now + 1ns, node->next_wake())) {
      node->advance(now);
      collect(now);
    }
    return sent;
  };
  const Frames polled = run(true);
  const Frames woken = run(false);
  EXPECT_GT(polled.size(), 150U);
  EXPECT_EQ(polled, woken);
}

}  // namespace
}  // namespace linegate::node
