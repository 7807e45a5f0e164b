// SPDX-License-Identifier: Apache-2.0
// Judges whole datagrams: participants and endpoints that discovery accepts.
#include <algorithm>
#include <array>

#include "tests/dds/guard/guard_fixture.h"

namespace linegate::test {
namespace {

using dds::guard::Guard;
using dds::guard::Reason;
namespace entity = dds::guard::entity;

constexpr std::uint32_t kEndless = 0x7FFFFFFF;
constexpr dds::guard::Address kStranger = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 10, 0, 0, 66};
constexpr dds::guard::Address kPeer = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 10, 0, 0, 2};

Fields guid_fields(const dds::guard::Prefix& whose, std::uint32_t id) {
  Fields out;
  for (const std::uint8_t octet : dds::guard::make_guid(whose, id))
    out.u8(octet);
  return out;
}

// Announces `whom` in a datagram of the participant `from`.
Datagram announce_participant(const dds::guard::Prefix& whom, const dds::guard::Prefix& from,
                              std::uint32_t lease = 20, unsigned id = 0x50) {
  const Fields list = Fields()
                          .u8(0)
                          .u8(3)
                          .u16(0)
                          .parameter(0x02, Fields().u32(lease).zeros(4))
                          .parameter(id, guid_fields(whom, 0x000001C1))
                          .sentinel();
  return Datagram(from).add(0x15, data(1, entity::kParticipants).octets(list.get()), kHasData);
}

Datagram announce_participant(Sender whom, std::uint32_t lease = 20) {
  return announce_participant(prefix_of(whom), prefix_of(whom), lease);
}

class PlacesTest : public testing::Test {
 protected:
  static constexpr Sender kPlaces = 8;

  // Announces 16 participants, one after the other. Returns how many of them get a place.
  int come(Guard& guard, Sender first, const dds::guard::Address& from, std::uint32_t lease = 20) {
    int count = 0;
    for (Sender i = 0; i < 2 * kPlaces; ++i) {
      const auto sender = static_cast<Sender>(first + i);
      const Reason reason = guard.judge(announce_participant(sender, lease).get(), 0, from).reason;
      if (reason == Reason::none && count < kPlaces) {
        guard.participant_found(prefix_of(sender), lease == kEndless);
        ++count;
      } else if (reason != Reason::none) {
        EXPECT_EQ(reason, Reason::participants);
      }
    }
    return count;
  }
};

TEST_F(PlacesTest, AQuarterIsLeftForConfiguredPeers) {
  Guard guard(false, {.participants = kPlaces, .peers = {kPeer}});
  EXPECT_EQ(come(guard, 10, kStranger), 6);
  EXPECT_EQ(guard.judge(announce_participant(11).get(), 0, kStranger).reason, Reason::none);
  EXPECT_EQ(guard.judge(announce_participant(90).get(), 0, kStranger).reason, Reason::participants);
  EXPECT_EQ(guard.judge(announce_participant(90).get(), 0, kPeer).reason, Reason::none);
  guard.participant_lost(prefix_of(11));
  EXPECT_EQ(guard.judge(announce_participant(91).get(), 0, kStranger).reason, Reason::none);
}

TEST_F(PlacesTest, WithoutConfiguredPeersNoneIsLeft) {
  Guard guard(false, {.participants = kPlaces, .peers = {}});
  EXPECT_EQ(come(guard, 10, kStranger), kPlaces);
}

// Each participant costs the library a match, and about 100 octets that it never frees.
TEST(ArrivalsTest, ParticipantsThatComeAndGoAreBoundedInTime) {
  constexpr std::uint32_t kMany = 100'000;
  constexpr std::int64_t kInterval = dds::guard::Discovered::kArrivalInterval;
  Guard guard(false, {.participants = 100, .peers = {kPeer}});
  std::int64_t now = 0;
  const auto comes_and_goes = [&](std::uint32_t number, const dds::guard::Address& from) {
    dds::guard::Prefix prefix = prefix_of(1);
    for (unsigned i = 0; i < 4; ++i)
      prefix[8 + i] = static_cast<std::uint8_t>(number >> 8 * i);
    Datagram announced = announce_participant(prefix, prefix);
    if (guard.judge(announced.get(), now, from).reason != Reason::none)
      return false;
    guard.participant_found(prefix);
    EXPECT_EQ(guard.judge(announced.get(), now, from).reason, Reason::none)
        << "the participant is known already";
    guard.participant_lost(prefix);
    return true;
  };
  std::int64_t come = 0;
  for (std::uint32_t i = 0; i < kMany; ++i) {
    come += comes_and_goes(i, kStranger) ? 1 : 0;
    now += kInterval / 1000;
  }
  EXPECT_LE(come, dds::guard::Discovered::kArrivals + kMany / 1000 + 1);
  EXPECT_GE(come, kMany / 1000);
  EXPECT_EQ(guard.counters().of(Reason::participants), kMany - static_cast<std::uint64_t>(come));
  for (std::uint32_t i = 0; i < 1'000; ++i)
    EXPECT_TRUE(comes_and_goes(kMany + i, kPeer)) << "a configured peer";
}

TEST(ArrivalsTest, AnAddressDoesNotUseUpWhatOthersHaveSaved) {
  Guard guard(false);
  const auto comes = [&](Sender sender, const dds::guard::Address& from) {
    return guard.judge(announce_participant(sender).get(), 0, from).reason == Reason::none;
  };
  int of_stranger = 0;
  for (int i = 0; i < 1'000; ++i) {
    of_stranger += comes(9, kStranger) ? 1 : 0;
    guard.participant_found(prefix_of(9));
    guard.participant_lost(prefix_of(9));
  }
  EXPECT_EQ(of_stranger, dds::guard::Discovered::kArrivals);
  int of_others = 0;
  for (std::uint8_t i = 100; i < 164; ++i) {
    dds::guard::Address other = kStranger;
    other[15] = i;
    of_others += comes(10, other) ? 1 : 0;
  }
  // Not all 64: a hash of the address selects the counter, so some addresses share one.
  EXPECT_GT(of_others, 32);
}

TEST(ArrivalsTest, APrefixOfZerosCountsToo) {
  Guard guard(false);
  Datagram announced = announce_participant(dds::guard::Prefix{}, dds::guard::Prefix{});
  int come = 0;
  for (int i = 0; i < 1'000; ++i)
    come += guard.judge(announced.get(), 0, kStranger).reason == Reason::none ? 1 : 0;
  EXPECT_EQ(come, dds::guard::Discovered::kArrivals);
}

// A participant also receives its own announcements.
TEST(ArrivalsTest, AParticipantThatIsNeverFoundCountsOnce) {
  Guard guard(false);
  for (int i = 0; i < 1'000; ++i)
    EXPECT_EQ(guard.judge(announce_participant(9).get(), 0, kStranger).reason, Reason::none);
  EXPECT_EQ(guard.judge(announce_participant(10).get(), 0, kStranger).reason, Reason::none);
}

TEST_F(PlacesTest, ParticipantsThatNeverGoTakeHalfAtMost) {
  Guard guard(false, {.participants = kPlaces, .peers = {}});
  EXPECT_EQ(come(guard, 10, kStranger, kEndless), kPlaces / 2);
  EXPECT_EQ(come(guard, 40, kStranger, 3600), kPlaces / 2);
}

TEST_F(PlacesTest, ForPeersThereIsAQuarterRoundedUpOfFourAndMore) {
  constexpr std::array<int, 9> kForOthers = {0, 1, 2, 3, 3, 3, 4, 5, 6};
  for (std::size_t places = 1; places < kForOthers.size(); ++places) {
    Guard guard(false, {.participants = places, .peers = {kPeer}});
    EXPECT_EQ(come(guard, 10, kStranger), kForOthers[places]) << places;
  }
}

TEST_F(PlacesTest, ALeaseIsAnHourAtMostOrInfinite) {
  Guard guard(false, {.participants = kPlaces, .peers = {kPeer}});
  for (const std::uint32_t lease : {3601U, 86'400U, 0x7FFFFFFEU, 0x80000000U, 0xFFFFFFFFU}) {
    EXPECT_EQ(come(guard, 10, kStranger, lease), 0);
    EXPECT_EQ(come(guard, 10, kPeer, lease), 0);
  }
  EXPECT_EQ(come(guard, 10, kStranger, 3600), 6);
}

// Fast DDS uses the lease that was announced last.
TEST_F(PlacesTest, ALeaseDoesNotBecomeInfinite) {
  Guard guard(false, {.participants = kPlaces, .peers = {}});
  guard.participant_found(prefix_of(1));
  guard.participant_found(prefix_of(2), true);
  const auto announce = [&](Sender whom, std::uint32_t lease) {
    return guard.judge(announce_participant(whom, lease).get(), 0, kStranger).reason;
  };
  EXPECT_EQ(announce(1, 600), Reason::none);
  EXPECT_EQ(announce(1, kEndless), Reason::participants);
  EXPECT_EQ(announce(2, kEndless), Reason::none);
  EXPECT_EQ(announce(2, 600), Reason::participants);
}

// Fast DDS reads the GUID of the announced participant from the payload.
TEST_F(PlacesTest, AParticipantAnnouncesItselfAlone) {
  Guard guard(false, {.participants = kPlaces, .peers = {}});
  Guard with_server(
      false, {.participants = kPlaces, .peers = {}, .servers = {prefix_of(3)}, .simple = false});
  for (const unsigned id : {0x50U, 0x70U}) {
    const auto announce = [&](Guard& by, Sender whom, Sender from) {
      return by
          .judge(announce_participant(prefix_of(whom), prefix_of(from), 20, id).get(), 0, kStranger)
          .reason;
    };
    EXPECT_EQ(announce(guard, 1, 1), Reason::none);
    EXPECT_EQ(announce(guard, 2, 1), Reason::discovery);
    EXPECT_EQ(announce(with_server, 2, 1), Reason::discovery);
    EXPECT_EQ(announce(with_server, 2, 3), Reason::none) << "a server announces others";
  }
  const Fields nobody = Fields().u8(0).u8(3).u16(0).sentinel();
  Datagram unnamed =
      Datagram(1).add(0x15, data(1, entity::kParticipants).octets(nobody.get()), kHasData);
  EXPECT_EQ(guard.judge(unnamed.get(), 0, kStranger).reason, Reason::discovery);
}

Datagram announce_end(Sender from, unsigned status, std::uint32_t writer = entity::kParticipants,
                      Sender whom = 0) {
  Fields end = Fields().parameter(0x71, Fields().zeros(3).u8(status));
  if (whom != 0)
    end.parameter(0x70, guid_fields(prefix_of(whom), 0x000001C1));
  end.sentinel();
  return Datagram(from)
      .add(0x09, Fields().zeros(8))
      .add(0x15, data(1, writer).octets(end.get()), kHasInlineQos)
      .add(0x80, Fields().zeros(56));
}

TEST_F(GuardTest, TheEndOfAParticipantIsLeftToItsLease) {
  for (const unsigned status : {1U, 2U, 3U}) {
    EXPECT_EQ(judge(announce_end(1, status)), Reason::none);
    EXPECT_EQ(passed, 20U + 12);
  }
  // Without the statistics submessage.
  const std::size_t all = announce_end(1, 3).get().size() - 60;
  EXPECT_EQ(judge(announce_end(1, 0)), Reason::none);
  EXPECT_EQ(passed, all);
  EXPECT_EQ(judge(announce_end(1, 3, entity::kPublications)), Reason::none);
  EXPECT_EQ(passed, all);
  // The submessages behind it are not passed on, so they have no effect in the guard either.
  EXPECT_EQ(beat(1), Reason::none);
  EXPECT_EQ(judge(announce_end(1, 3).add(0x07, heartbeat(1'000'000, 1'000'000))), Reason::none);
  EXPECT_EQ(beat(1'000'000), Reason::rate);
  Guard with_server(false, {.simple = false});
  EXPECT_EQ(with_server.judge(announce_end(1, 3).get(), now).size, all);
}

// Whoever a server announces takes a place, also if the server's host is a configured peer.
TEST_F(PlacesTest, ParticipantsOfAServerAreLimitedLikeOthers) {
  for (const bool is_peer : {false, true}) {
    const std::vector<dds::guard::Address> peers(is_peer ? 1 : 0, kPeer);
    const std::size_t places = is_peer ? kPlaces - (kPlaces + 3) / 4 : kPlaces;
    Guard guard(false, {.participants = kPlaces, .peers = peers, .servers = {prefix_of(3)}});
    const auto announce = [&](Sender whom, std::uint32_t lease = 20) {
      Datagram announced = announce_participant(prefix_of(whom), prefix_of(3), lease);
      return guard.judge(announced.get(), 0, kPeer).reason;
    };
    for (std::size_t i = 0; i < places; ++i) {
      const auto whom = static_cast<Sender>(10 + i);
      EXPECT_EQ(announce(whom), Reason::none);
      guard.participant_found(prefix_of(whom));
    }
    EXPECT_EQ(announce(90), Reason::participants);
    EXPECT_EQ(announce(90, kEndless), Reason::participants);
    EXPECT_EQ(announce(10), Reason::none);
    EXPECT_EQ(announce(3), Reason::none) << "the server itself";
  }
}

// Such a lease never expires, so the participant frees its place only when it announces its end.
TEST_F(PlacesTest, AParticipantWithAnInfiniteLeaseEnds) {
  Guard guard(false, {.participants = kPlaces, .peers = {}});
  for (Sender i = 1; i <= 50; ++i) {
    EXPECT_EQ(guard.judge(announce_participant(i, kEndless).get(), 0).reason, Reason::none);
    guard.participant_found(prefix_of(i), true);
    std::vector<std::uint8_t> end = announce_end(i, 3, entity::kParticipants, i).get();
    EXPECT_EQ(guard.judge(end, 0).size, end.size() - 60);  // without the statistics submessage
    guard.participant_lost(prefix_of(i));
  }
  // A participant can end only itself.
  guard.participant_found(prefix_of(1), true);
  guard.participant_found(prefix_of(2), false);
  EXPECT_EQ(guard.judge(announce_end(1, 3, entity::kParticipants, 2).get(), 0).size, 20U + 12);
  EXPECT_EQ(guard.judge(announce_end(2, 3, entity::kParticipants, 1).get(), 0).size, 20U + 12);
  EXPECT_EQ(guard.judge(announce_end(2, 3, entity::kParticipants, 2).get(), 0).size, 20U + 12);
  EXPECT_EQ(guard.judge(announce_end(1, 3).get(), 0).size, 20U + 12);
}

Datagram announce_endpoint(Sender from, std::uint32_t id, bool reader = false, Sender whose = 0,
                           unsigned parameter = 0x5A) {
  const Fields guid = guid_fields(prefix_of(whose == 0 ? from : whose), id);
  const Fields list = Fields().u8(0).u8(3).u16(0).parameter(parameter, guid).sentinel();
  const std::uint32_t writer = reader ? entity::kSubscriptions : entity::kPublications;
  return Datagram(from).add(0x15, data(1, writer).octets(list.get()), kHasData);
}

TEST_F(GuardTest, AParticipantAnnouncesABoundedNumberOfEndpoints) {
  guard.participant_found(prefix_of(1));
  guard.participant_found(prefix_of(2));
  std::size_t passed_on = 0;
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    now += kSecond / 10;
    const std::uint32_t id = (i + 1) << 8U | (i % 2 == 0 ? 3U : 4U);
    if (judge(announce_endpoint(1, id, i % 2 != 0)) != Reason::none)
      continue;
    guard.endpoint_found(dds::guard::make_guid(prefix_of(1), id));
    ++passed_on;
  }
  EXPECT_EQ(passed_on, dds::guard::Discovered::kEndpoints);
  EXPECT_GT(guard.counters().of(Reason::endpoints), 0U);
  EXPECT_EQ(judge(announce_endpoint(1, 1U << 8U | 3U)), Reason::none);  // a known endpoint
  // An endpoint of another participant.
  EXPECT_EQ(judge(announce_endpoint(2, 1U << 8U | 3U)), Reason::none);
  guard.endpoint_lost(dds::guard::make_guid(prefix_of(1), 1U << 8U | 3U));
  EXPECT_EQ(judge(announce_endpoint(1, 0x77777703)), Reason::none);
}

TEST_F(GuardTest, AServerAnnouncesEndpointsOfOthers) {
  constexpr Sender kServer = 3;
  Guard with_server(false, {.servers = {prefix_of(kServer)}, .simple = false});
  with_server.participant_found(prefix_of(1));
  const auto announce = [&](Sender from, std::uint32_t id, Sender whose) {
    now += kSecond;
    return with_server.judge(announce_endpoint(from, id, false, whose).get(), now).reason;
  };
  EXPECT_EQ(announce(2, 1U << 8U | 3U, 1), Reason::discovery);
  for (std::uint32_t i = 1; i <= dds::guard::Discovered::kEndpoints; ++i) {
    EXPECT_EQ(announce(kServer, i << 8U | 3U, 1), Reason::none);
    with_server.endpoint_found(dds::guard::make_guid(prefix_of(1), i << 8U | 3U));
  }
  EXPECT_EQ(announce(kServer, 0x77777703, 1), Reason::endpoints) << "of the same participant";
}

Fields key_of(const dds::guard::Guid& endpoint) {
  Fields out;
  for (const std::uint8_t octet : endpoint)
    out.u8(octet);
  return out;
}

// The end of an endpoint as Fast DDS announces it: key hash and status info, without payload.
Datagram end_endpoint(Sender from, const dds::guard::Guid& endpoint, std::uint32_t writer) {
  const Fields qos = Fields()
                         .parameter(0x70, key_of(endpoint))
                         .parameter(0x71, Fields().zeros(3).u8(3))
                         .sentinel();
  return Datagram(from).add(0x15, data(1, writer).octets(qos.get()), kHasInlineQos);
}

// The end of an endpoint as Cyclone DDS announces it: status info, and the key as payload.
Datagram end_endpoint_by_payload(Sender from, const dds::guard::Guid& endpoint,
                                 std::uint32_t writer) {
  const Fields qos = Fields().parameter(0x71, Fields().zeros(3).u8(3)).sentinel();
  const Fields key = Fields().u8(0).u8(3).u16(0).parameter(0x5A, key_of(endpoint)).sentinel();
  return Datagram(from).add(0x15, data(1, writer).octets(qos.get()).octets(key.get()),
                            kHasInlineQos | kHasKey);
}

class FullOfEndpoints : public GuardTest {
 protected:
  static constexpr std::uint32_t kMost = dds::guard::Discovered::kEndpoints;

  static std::uint32_t id(std::uint32_t number) { return number << 8U | 3U; }
  static dds::guard::Guid endpoint(std::uint32_t number) {
    return dds::guard::make_guid(prefix_of(1), id(number));
  }
  void SetUp() override {
    guard.participant_found(prefix_of(1));
    for (std::uint32_t i = 1; i <= kMost; ++i)
      come(i);
    EXPECT_EQ(judge(announce_endpoint(1, id(kMost + 1))), Reason::endpoints);
  }
  void come(std::uint32_t number) {
    now += kSecond;
    EXPECT_EQ(judge(announce_endpoint(1, id(number))), Reason::none);
    guard.endpoint_found(endpoint(number));
  }
};

// The library processes the end of an endpoint only after the preceding announcement, which was
// dropped for lack of a place.
TEST_F(FullOfEndpoints, OneThatEndsGivesItsPlaceBeforeTheLibraryTakesItsEnd) {
  EXPECT_EQ(judge(end_endpoint(1, endpoint(1), entity::kPublications)), Reason::none);
  EXPECT_EQ(judge(end_endpoint_by_payload(1, endpoint(2), entity::kSubscriptions)), Reason::none);
  come(kMost + 1);
  come(kMost + 2);
  EXPECT_EQ(judge(announce_endpoint(1, id(kMost + 3))), Reason::endpoints);
  // The library has processed both ends, whose places were freed before.
  guard.endpoint_lost(endpoint(1));
  guard.endpoint_lost(endpoint(2));
  EXPECT_EQ(judge(announce_endpoint(1, id(kMost + 3))), Reason::endpoints);
  EXPECT_EQ(guard.counters().endpoints, kMost);
}

TEST_F(FullOfEndpoints, AnEndGivesOnePlaceOnce) {
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(judge(end_endpoint(1, endpoint(1), entity::kPublications)), Reason::none);
  come(kMost + 1);
  EXPECT_EQ(judge(announce_endpoint(1, id(kMost + 2))), Reason::endpoints);
}

TEST_F(FullOfEndpoints, NoOtherEndGivesAPlace) {
  // An endpoint that was never found.
  judge(end_endpoint(1, endpoint(kMost + 9), entity::kPublications));
  judge(end_endpoint(2, endpoint(1), entity::kPublications));  // from another participant
  judge(end_endpoint(1, endpoint(1), kWriter));                // not from a builtin writer
  EXPECT_EQ(judge(announce_endpoint(1, id(kMost + 1))), Reason::endpoints);
}

TEST_F(GuardTest, AParticipantAnnouncesItsOwnEndpoints) {
  for (const bool reader : {false, true}) {
    for (const unsigned parameter : {0x50U, 0x5AU, 0x70U}) {
      EXPECT_EQ(judge(announce_endpoint(1, kWriter, reader, 1, parameter)), Reason::none);
      EXPECT_EQ(judge(announce_endpoint(1, kWriter, reader, 2, parameter)), Reason::discovery);
    }
  }
}

// Writers with the same persistence GUID would share one range of numbers in a reader.
TEST_F(GuardTest, AWriterHasNoPersistenceGuidButItsOwn) {
  const auto announce = [&](const Fields& persistence, std::uint32_t id) {
    const Fields list = Fields()
                            .u8(0)
                            .u8(3)
                            .u16(0)
                            .parameter(0x8002, persistence)
                            .parameter(0x5A, guid_fields(prefix_of(1), id))
                            .sentinel();
    return judge(
        Datagram(1).add(0x15, data(1, entity::kPublications).octets(list.get()), kHasData));
  };
  EXPECT_EQ(announce(guid_fields(prefix_of(1), kWriter), kWriter), Reason::none);
  EXPECT_EQ(announce(Fields().zeros(16), kWriter), Reason::none);
  EXPECT_EQ(announce(guid_fields(prefix_of(1), 0x303), kWriter), Reason::discovery);
  EXPECT_EQ(announce(guid_fields(prefix_of(2), kWriter), kWriter), Reason::discovery);
}

TEST_F(GuardTest, EndpointsThatComeAndGoAreBoundedInTime) {
  guard.participant_found(prefix_of(1));
  const auto passes = [&](std::uint32_t count) {
    std::uint32_t out = 0;
    for (std::uint32_t i = 0; i < count; ++i)
      out += judge(announce_endpoint(1, i << 8U | 3U)) == Reason::none ? 1U : 0U;
    return out;
  };
  EXPECT_EQ(passes(5'000), 1'024U);
  EXPECT_EQ(passes(5'000), 0U);
  now += kSecond;
  EXPECT_EQ(passes(5'000), 50U);
}

}  // namespace
}  // namespace linegate::test
