// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/connections.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/manager/connection_network.h"

namespace linegate::manager {
namespace {

using event::ConnectionResult;
using testing::ElementsAre;
using testing::IsEmpty;

struct ConnectionsTest : testing::Test, ConnectionNetwork {
  using Kind = Answer::Kind;

  ConnectionsTest() = default;
  explicit ConnectionsTest(ConnectionPool pool) : ConnectionNetwork(pool) {}

  std::vector<ConnectionResult> results() {
    std::vector<ConnectionResult> out;
    for (const event::SdoConnection& each : take_events()) {
      out.push_back(each.result);
    }
    return out;
  }
  bool any_valid() const {
    return devices.at(kClient).valid(0x1280) || devices.at(kClient).valid(0x1281) ||
           devices.at(kServer).valid(0x1201) || devices.at(kServer).valid(0x1202);
  }
  // The device treats its request number `at` (from 0), counted over both, like this; `then` all
  // later ones of the device.
  void treat(std::size_t at, Answer how, bool then) {
    answer = [this, at, how, then, hit = std::uint8_t{0}](std::uint8_t node, od::Address,
                                                          bool) mutable {
      if (log.size() - 1 == at) {
        hit = node;
        return how;
      }
      return then && hit == node ? Answer{Kind::silent} : Answer{};
    };
  }
};

// The requests of an opening, in their order.
const std::vector<std::string> kOpening{"8 1201:1",
                                        "8 1201:2",  // free
                                        "5 1280:1",
                                        "5 1280:2",
                                        "8 1201:1 = 80000000",
                                        "8 1201:2 = 80000000",
                                        "8 1201:3 = 00000005",
                                        "5 1280:1 = 80000000",
                                        "5 1280:2 = 80000000",
                                        "5 1280:3 = 00000008",
                                        "8 1201:1 = 40000681",
                                        "8 1201:2 = 40000680",
                                        "5 1280:1 = 40000681",
                                        "5 1280:2 = 40000680"};
constexpr std::size_t kFirstValid = 10;

TEST_F(ConnectionsTest, OpensWithTheRecordsNotValidFirst) {
  const std::uint32_t number = open();
  EXPECT_EQ(log, kOpening);
  EXPECT_THAT(take_ended(), ElementsAre("1: 00000000"));
  const Connection expected{.number = number,
                            .client = kClient,
                            .server = kServer,
                            .client_record = 0x1280,
                            .server_record = 0x1201,
                            .request = 0x681,
                            .response = 0x680,
                            .state = ConnectionState::open};
  EXPECT_THAT(connections.table(), ElementsAre(expected));
  EXPECT_THAT(take_events(), ElementsAre(event::SdoConnection{.number = number,
                                                              .client_record = 0x1280,
                                                              .server_record = 0x1201,
                                                              .request = 0x681,
                                                              .response = 0x680,
                                                              .client = kClient,
                                                              .server = kServer}));
}

TEST_F(ConnectionsTest, ClosesTheClientFirst) {
  const std::uint32_t number = open();
  (void)take_events();
  (void)take_ended();
  log.clear();
  EXPECT_TRUE(close(number));
  EXPECT_THAT(log, ElementsAre("5 1280:1 = 80000000", "5 1280:2 = 80000000", "8 1201:1 = 80000000",
                               "8 1201:2 = 80000000"));
  EXPECT_THAT(take_ended(), ElementsAre("1: 00000000"));
  EXPECT_THAT(results(), ElementsAre(ConnectionResult::closed));
  EXPECT_THAT(connections.table(), IsEmpty());
  EXPECT_FALSE(close(number)) << "there is none any more";
}

TEST_F(ConnectionsTest, TakesTheFirstRecordThatIsFree) {
  devices[kServer] = {};
  devices[kServer].add(0x1201, 0x690, 0x691);
  devices[kServer].add(0x1202, kNotValid, 0x692);  // another node may be writing it
  devices[kServer].add(0x1203, kNotValid | 0x7FF, kNotValid | 0x600);
  const std::uint32_t first = open();
  EXPECT_EQ(connections.find(first)->server_record, 0x1203);
  open();
  EXPECT_THAT(take_ended(), ElementsAre("1: 00000000", "2: 060A0023"))
      << "that of the first connection is not read again";
  EXPECT_EQ(connections.table().size(), 1U);
}

TEST_F(ConnectionsTest, ADeviceWithoutRecordsSaysSo) {
  devices[kClient] = {};
  open();
  EXPECT_THAT(take_ended(), ElementsAre("1: 06020000"));
  EXPECT_THAT(log, ElementsAre("8 1201:1", "8 1201:2", "5 1280:1"));
  EXPECT_THAT(results(), ElementsAre(ConnectionResult::failed));
  EXPECT_THAT(connections.table(), IsEmpty());
}

TEST_F(ConnectionsTest, TheDeviceFileNamesTheRecords) {
  devices[kServer] = {};
  devices[kServer].add(0x1210);
  files[kServer] = {0x1201, 0x1210};
  EXPECT_EQ(connections.find(open())->server_record, 0x1210);
  EXPECT_THAT(take_ended(), ElementsAre("1: 00000000"));
  EXPECT_EQ(log[0], "8 1201:1");
  EXPECT_EQ(log[1], "8 1210:1");
}

TEST_F(ConnectionsTest, TheNodeIdOfAServersRecordIsOptional) {
  devices[kServer] = {};
  devices[kServer].add(0x1201, kNotValid, kNotValid, false);
  open();
  EXPECT_THAT(take_ended(), ElementsAre("1: 00000000"));
  devices[kClient] = {};
  devices[kClient].add(0x1281, kNotValid, kNotValid, false);
  devices[kServer].add(0x1202);
  files[kClient] = {0x1281};
  open();
  EXPECT_THAT(take_ended(), ElementsAre("2: 06090011")) << "that of a client is not";
}

TEST_F(ConnectionsTest, CanIdsInUseAreNotAssigned) {
  used = {0x681};                              // of a service of the line
  devices[kClient].add(0x1280, 0x600, 0x682);  // of a record that is read
  connections.heard(0x685, now);               // received from the bus
  EXPECT_EQ(open(), 1U);
  EXPECT_THAT(take_ended(), ElementsAre("1: 060A0023"));
  now += Connections::kQuiet;
  EXPECT_EQ(connections.find(open())->request, 0x685) << "heard long ago";
  connections.heard(0x685, now);
  connections.heard(0x123, now);
  EXPECT_THAT(take_ended(), ElementsAre("2: 00000000"));
  EXPECT_TRUE(close(2));
  EXPECT_EQ(connections.find(open())->request, 0x685) << "the frames of the connection itself";
}

TEST_F(ConnectionsTest, ThePoolIsExhausted) {
  devices[kClient].add(0x1282);
  devices[kServer].add(0x1203);
  devices[kClient].add(0x1283);
  devices[kServer].add(0x1204);
  std::set<std::uint16_t> ids;
  for (int i = 0; i < 3; ++i) {
    const Connection* const made = connections.find(open());
    ASSERT_NE(made, nullptr);
    ids.insert({made->request, made->response});
  }
  EXPECT_THAT(ids, ElementsAre(0x680, 0x681, 0x682, 0x683, 0x684, 0x685));
  log.clear();
  (void)take_ended();
  open();
  EXPECT_THAT(take_ended(), ElementsAre("4: 060A0023"));
  EXPECT_THAT(log, IsEmpty()) << "no device is asked for nothing";
  EXPECT_TRUE(close(2));
  EXPECT_EQ(connections.find(open())->request, 0x683);
}

TEST_F(ConnectionsTest, ARefusalAtAnyStepLeavesNothingValid) {
  for (std::size_t at = 0; at < kOpening.size(); ++at) {
    ConnectionsTest_ARefusalAtAnyStepLeavesNothingValid_Test fresh;
    fresh.treat(at, {Kind::abort, AbortCode::device_state}, false);
    fresh.open();
    const bool is_read = at < 4;
    if (is_read) {  // the next record is taken
      EXPECT_THAT(fresh.take_ended(), ElementsAre("1: 00000000")) << at;
      continue;
    }
    EXPECT_THAT(fresh.take_ended(), ElementsAre("1: 08000022")) << at;
    EXPECT_FALSE(fresh.any_valid()) << at;
    EXPECT_THAT(fresh.connections.table(), IsEmpty()) << at;
    EXPECT_THAT(fresh.results(), ElementsAre(ConnectionResult::failed)) << at;
  }
}

// A write that is not answered may have been executed.
TEST_F(ConnectionsTest, ADeviceThatFallsSilentLeavesAStaleConnection) {
  for (std::size_t at = 0; at < kOpening.size(); ++at) {
    ConnectionsTest_ADeviceThatFallsSilentLeavesAStaleConnection_Test fresh;
    fresh.treat(at, {Kind::executed}, true);
    fresh.open();
    EXPECT_THAT(fresh.take_ended(), ElementsAre("1: 05040000")) << at;
    if (at < kFirstValid) {
      EXPECT_THAT(fresh.results(), ElementsAre(ConnectionResult::failed)) << at;
      EXPECT_THAT(fresh.connections.table(), IsEmpty()) << at;
      continue;
    }
    EXPECT_THAT(fresh.results(), ElementsAre(ConnectionResult::failed, ConnectionResult::stale));
    const std::vector<Connection> table = fresh.connections.table();
    ASSERT_EQ(table.size(), 1U) << at;
    EXPECT_EQ(table[0].state, ConnectionState::stale);
    EXPECT_EQ(table[0].abort, AbortCode::timeout);
    fresh.answer = {};
    EXPECT_EQ(fresh.connections.find(fresh.open())->request, 0x683) << "not those of the stale one";
    fresh.connections.recovered(at < 12 ? kServer : kClient, fresh.now);
    fresh.run();
    EXPECT_EQ(fresh.connections.find(1), nullptr) << at;
    EXPECT_EQ(fresh.results().back(), ConnectionResult::cleared);
    EXPECT_FALSE(fresh.devices[kServer].valid(0x1201));
    EXPECT_FALSE(fresh.devices[kClient].valid(0x1280));
  }
}

// The reset takes effect before, or after, the request that is under way.
TEST_F(ConnectionsTest, AResetAtAnyStepEndsTheOpening) {
  for (const std::uint8_t node : {kClient, kServer}) {
    for (const auto before : {true, false}) {
      for (std::size_t at = 0; at < kOpening.size(); ++at) {
        ConnectionsTest_AResetAtAnyStepEndsTheOpening_Test fresh;
        fresh.answer = [&](std::uint8_t, od::Address, bool) {
          if (fresh.log.size() - 1 != at) {
            return Answer{};
          }
          if (before) {
            fresh.reset(node);
            return Answer{};
          }
          return Answer{Kind::executed};
        };
        EXPECT_NE(fresh.connections.open(kClient, kServer, {}, fresh.now), 0U);
        fresh.settle();
        if (!before) {
          fresh.reset(node);
        }
        fresh.run();
        EXPECT_THAT(fresh.take_ended(), ElementsAre("1: 08000022")) << at;
        EXPECT_FALSE(fresh.any_valid()) << at;
        EXPECT_THAT(fresh.connections.table(), IsEmpty()) << at;
      }
    }
  }
}

TEST_F(ConnectionsTest, AnOpenConnectionIsLostWithTheResetOfEither) {
  for (const std::uint8_t node : {kClient, kServer}) {
    open();
    (void)results();
    reset(node);
    run();
    EXPECT_THAT(results(), ElementsAre(ConnectionResult::lost));
    EXPECT_FALSE(any_valid());
    EXPECT_THAT(connections.table(), IsEmpty());
  }
  open();
  reset(9);
  run();
  EXPECT_EQ(connections.table().size(), 1U) << "another node";
}

TEST_F(ConnectionsTest, ARecordThatANodeStoredIsNotValidAfterItsReset) {
  open();
  devices[kClient].store();
  reset(kClient);
  EXPECT_TRUE(devices[kClient].valid(0x1280));
  run();
  EXPECT_FALSE(any_valid());
  EXPECT_THAT(connections.table(), IsEmpty());
}

TEST_F(ConnectionsTest, ARecordThatANodeStoredIsNotValidAfterALaterReset) {
  const std::uint32_t number = open();
  devices[kClient].store();
  devices[kServer].store();
  EXPECT_TRUE(close(number));
  EXPECT_EQ(open(), 2U) << "with the same records";
  (void)results();
  EXPECT_TRUE(close(2));
  EXPECT_THAT(results(), ElementsAre(ConnectionResult::closed));
  for (const std::uint8_t node : {kClient, kServer, kClient}) {
    reset(node);
    run();
    EXPECT_FALSE(any_valid());
    EXPECT_THAT(connections.table(), IsEmpty());
    EXPECT_THAT(results(), IsEmpty()) << "it ended before";
  }
  for (const std::uint8_t node : {kServer, kClient}) {
    reset(node);
  }
  run();
  EXPECT_FALSE(any_valid()) << "both at once";
  answer = [](std::uint8_t, od::Address, bool) { return Answer{Kind::silent}; };
  reset(kClient);
  run();
  EXPECT_THAT(results(), ElementsAre(ConnectionResult::stale));
  answer = {};
  EXPECT_EQ(connections.find(open())->request, 0x683);
}

TEST_F(ConnectionsTest, AResetDuringTheReleaseWritesAgain) {
  for (std::size_t at = 0; at < 4; ++at) {
    ConnectionsTest_AResetDuringTheReleaseWritesAgain_Test fresh;
    const std::uint32_t number = fresh.open();
    fresh.devices[kClient].store();
    fresh.log.clear();
    fresh.answer = [&](std::uint8_t, od::Address, bool) {
      if (fresh.log.size() - 1 == at) {
        fresh.reset(kClient);
      }
      return Answer{};
    };
    EXPECT_TRUE(fresh.close(number));
    EXPECT_FALSE(fresh.any_valid()) << at;
    EXPECT_THAT(fresh.connections.table(), IsEmpty()) << at;
  }
}

TEST_F(ConnectionsTest, ANodeThatBootsForEverIsGivenUp) {
  const std::uint32_t number = open();
  devices[kClient].store();
  answer = [this](std::uint8_t node, od::Address, bool) {
    if (node == kClient) {
      reset(kClient);
      return Answer{Kind::silent};
    }
    return Answer{};
  };
  EXPECT_TRUE(connections.close(number, {}, now));
  run();
  ASSERT_EQ(connections.table().size(), 1U);
  EXPECT_EQ(connections.table()[0].state, ConnectionState::stale);
  answer = {};
  reset(kClient);
  run();
  EXPECT_THAT(connections.table(), IsEmpty());
  EXPECT_FALSE(any_valid());
}

TEST_F(ConnectionsTest, AStaleConnectionCanBeClosed) {
  const std::uint32_t number = open();
  answer = [](std::uint8_t node, od::Address, bool) {
    return node == kServer ? Answer{Kind::abort, AbortCode::device_state} : Answer{};
  };
  (void)take_ended();
  (void)results();
  EXPECT_TRUE(close(number));
  EXPECT_THAT(take_ended(), ElementsAre("1: 08000022"));
  EXPECT_THAT(results(), ElementsAre(ConnectionResult::stale));
  EXPECT_FALSE(devices[kClient].valid(0x1280));
  log.clear();
  EXPECT_TRUE(close(number));
  EXPECT_THAT(take_ended(), ElementsAre("1: 08000022"));
  EXPECT_THAT(results(), IsEmpty()) << "as before";
  EXPECT_THAT(log, ElementsAre("8 1201:1 = 80000000", "8 1201:2 = 80000000"));
  answer = {};
  EXPECT_TRUE(close(number));
  EXPECT_THAT(take_ended(), ElementsAre("1: 00000000"));
  EXPECT_THAT(results(), ElementsAre(ConnectionResult::cleared));
}

TEST_F(ConnectionsTest, ARecordThatDoesNotExistAnyMoreIsReleased) {
  const std::uint32_t number = open();
  devices[kServer].remove();  // another program was loaded
  EXPECT_TRUE(close(number));
  EXPECT_THAT(connections.table(), IsEmpty());
  EXPECT_THAT(results(), ElementsAre(ConnectionResult::opened, ConnectionResult::closed));
}

TEST_F(ConnectionsTest, ARequestEndsAtItsDeadline) {
  answer = [this](std::uint8_t, od::Address, bool) {
    now += Milliseconds(100);
    return Answer{};
  };
  open(kClient, kServer, Milliseconds(1150));  // after the write that makes the server valid
  EXPECT_THAT(take_ended(), ElementsAre("1: expired"));
  EXPECT_FALSE(any_valid());
  EXPECT_THAT(connections.table(), IsEmpty());
  const std::uint32_t number = open();
  (void)take_ended();
  EXPECT_TRUE(connections.close(number, {.timeout = Milliseconds(150)}, now));
  run();
  EXPECT_THAT(take_ended(), ElementsAre("2: expired"));
  EXPECT_FALSE(any_valid()) << "the release goes on";
  EXPECT_THAT(connections.table(), IsEmpty());
}

TEST_F(ConnectionsTest, RequestsTakeTurns) {
  answer = [](std::uint8_t, od::Address, bool) { return Answer{Kind::silent}; };
  for (std::size_t i = 0; i < Connections::kMostWaiting; ++i) {
    EXPECT_NE(connections.open(kClient, kServer, {.timeout = Milliseconds(10)}, now), 0U);
  }
  EXPECT_EQ(connections.open(kClient, kServer, {}, now), 0U) << "busy";
  run();
  EXPECT_EQ(take_ended().size(), Connections::kMostWaiting);
  EXPECT_THAT(connections.table(), IsEmpty());
}

TEST_F(ConnectionsTest, ALineThatStopsReleasesAll) {
  open();
  open();
  EXPECT_NE(connections.open(kClient, kServer, {}, now), 0U);
  (void)take_ended();
  connections.release_all(now);
  run();
  EXPECT_THAT(take_ended(), IsEmpty());
  EXPECT_FALSE(any_valid());
  EXPECT_THAT(connections.table(), IsEmpty());
}

TEST_F(ConnectionsTest, ALineThatStopsDuringAnOpeningReleasesIt) {
  for (std::size_t at = 0; at < kOpening.size(); ++at) {
    ConnectionsTest_ALineThatStopsDuringAnOpeningReleasesIt_Test fresh;
    fresh.answer = [&](std::uint8_t, od::Address, bool) {
      if (fresh.log.size() - 1 == at) {
        fresh.connections.release_all(fresh.now);
      }
      return Answer{};
    };
    fresh.open();
    EXPECT_THAT(fresh.take_ended(), IsEmpty()) << at;
    EXPECT_FALSE(fresh.any_valid()) << at;
    EXPECT_THAT(fresh.connections.table(), IsEmpty()) << at;
  }
}

TEST_F(ConnectionsTest, ALineThatIsNoMasterAnyMoreSendsNothing) {
  open();
  EXPECT_NE(connections.open(kClient, kServer, {}, now), 0U);
  settle();
  (void)results();
  log.clear();
  connections.abandon(now);
  run();
  EXPECT_THAT(log, IsEmpty());
  EXPECT_EQ(connections.table().size(), 2U);
  EXPECT_EQ(connections.table()[0].state, ConnectionState::stale);
  EXPECT_EQ(connections.table()[0].abort, AbortCode::local_control);
  EXPECT_THAT(results(), ElementsAre(ConnectionResult::stale, ConnectionResult::stale));
  reset(kClient);  // it is master again, and resets its nodes
  reset(kServer);
  run();
  EXPECT_THAT(connections.table(), IsEmpty());
}

}  // namespace
}  // namespace linegate::manager
