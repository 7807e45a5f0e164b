// SPDX-License-Identifier: Apache-2.0
// The known attacks on Fast DDS 2.9.1, sent to a live gateway and to the live participants of this
// process. Without a guard, each would abort them, or keep one of their threads busy for ever.
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/rtps/common/Guid.h>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"

#include "tests/dds/fixtures.h"
#include "tests/dds/guard/datagram.h"
#include "tests/dds/guard/forger.h"
#include "tests/dds/sanitizers.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

namespace entity = dds::guard::entity;
using dds::guard::Reason;

dds::guard::Guid to_guid(const eprosima::fastrtps::rtps::GUID_t& it) {
  dds::guard::Guid out{};
  std::copy_n(it.guidPrefix.value, 12, out.begin());
  std::copy_n(it.entityId.value, 4, out.begin() + 12);
  return out;
}

std::uint32_t entity_of(const dds::guard::Guid& guid) {
  return dds::guard::Wire(guid, false).u32(12);
}

// The announcement of a participant that the library accepts, so that its builtin endpoints are
// matched.
Datagram announcement(Sender sender) {
  Fields guid;
  for (const std::uint8_t octet : dds::guard::make_guid(prefix_of(sender), 0x000001C1))
    guid.u8(octet);
  const Fields locator = Fields().u32(1).u32(9).zeros(12).u8(127).u8(0).u8(0).u8(1);
  const Fields list = Fields()
                          .u8(0)
                          .u8(3)
                          .u16(0)
                          .parameter(0x15, Fields().u8(2).u8(3).zeros(2))
                          .parameter(0x16, Fields().u8(1).u8(0x0F).zeros(2))
                          .parameter(0x50, guid)
                          .parameter(0x32, locator)
                          .parameter(0x31, locator)
                          .parameter(0x02, Fields().u32(600).zeros(4))
                          .parameter(0x58, Fields().u32(0x0C3F))
                          .sentinel();
  return Datagram(sender).add(0x15, data(1, entity::kParticipants).octets(list.get()), kHasData);
}

class Lines : public dds::ClientListener {
 public:
  void on_line(const dds::Source&, const dds::LineInfo&, const line::LineState&,
               const std::vector<dds::Property>&) override {
    ++count;
  }
  int count = 0;
};

class Attack : public testing::Test {
 protected:
  explicit Attack(Freed freed = Freed::kept)
      : gateway("gateway", paths::kLoopbackProfiles, freed) {}

  void SetUp() override {
    ASSERT_FALSE(gateway.expect("ready").empty());
    outputs = endpoints.writer<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE);
    ASSERT_NE(outputs, nullptr);
    victim = to_guid(outputs->guid());
    ASSERT_TRUE(output_arrives());
  }
  void TearDown() override {
    EXPECT_TRUE(output_arrives());
    EXPECT_TRUE(a_new_client_finds_the_gateway());
    EXPECT_TRUE(gateway.end());
  }

  bool output_arrives() {
    v1::OutputWrite sample;
    sample.gateway(known::kGateway);
    sample.line(known::kLine);
    sample.client("live");
    sample.arming(++arming);
    sample.values().resize(1);
    sample.values()[0].data({1});
    const std::string line =
        "output line=line1 client=live group=0 layout=0 arming=" + std::to_string(arming) + " ";
    return eventually([&] {
      outputs->write(&sample);
      return !gateway.expect(line, std::chrono::milliseconds(200)).empty();
    });
  }

  static bool a_new_client_finds_the_gateway() {
    const auto client = make_client(client_options());
    Lines lines;
    return client != nullptr && eventually([&] {
             client->poll(std::chrono::milliseconds(50), lines);
             return lines.count > 0;
           });
  }

  // Repeats the datagram until the gateway and this process have dropped it for that reason.
  bool dropped(std::vector<std::uint8_t> datagram, Reason reason, bool multicast = false) {
    const std::string line = "guard " + std::string(to_string(reason));
    const std::uint64_t before = endpoints.guard_counters().of(reason);
    return eventually([&] {
      multicast ? forger.multicast(datagram) : forger.unicast(datagram);
      return !gateway.expect(line, std::chrono::milliseconds(200)).empty() &&
             endpoints.guard_counters().of(reason) > before;
    });
  }
  bool dropped(Datagram datagram, Reason reason) {
    return dropped(std::move(datagram.get()), reason);
  }
  Datagram forged() const { return Datagram(dds::guard::prefix_of(victim)); }

  Peer gateway;
  std::vector<Diagnostic> diagnostics;
  dds::Endpoints endpoints{"live", domain(), paths::kLoopbackProfiles, diagnostics};
  eprosima::fastdds::dds::DataWriter* outputs = nullptr;
  dds::guard::Guid victim{};  // the writer of outputs
  Forger forger;
  std::uint64_t arming = 0;
};

struct AttackOnMemory : Attack {
  AttackOnMemory() : Attack(Freed::released) {}
};

TEST_F(Attack, AStatisticsSubmessageThatIsNotTheLast) {
  Datagram datagram = Datagram(7).add(0x80, Fields().zeros(56)).add(0x01, Fields());
  ASSERT_EQ(datagram.get().size(), 84U);
  EXPECT_TRUE(dropped(datagram, Reason::statistics));
  EXPECT_TRUE(dropped(datagram.get(), Reason::statistics, true));
}

// The library would store its numbers for each sender.
TEST_F(Attack, AStatisticsSubmessageThatIsRepeated) {
  Fields statistics = Fields().zeros(24 + 8);
  statistics.u32(1).u32(0).u32(900).zeros(12);
  ASSERT_EQ(statistics.get().size(), 56U);
  Datagram datagram = Datagram(7).add(0x80, statistics);
  for (int i = 0; i < 3; ++i)
    forger.unicast(datagram.get());
  EXPECT_TRUE(output_arrives());
}

TEST_F(Attack, AGapOverAllNumbersOfALiveWriter) {
  for (const std::uint32_t writer :
       {entity_of(victim), entity::kPublications, entity::kSubscriptions, entity::kLiveliness}) {
    EXPECT_TRUE(dropped(forged().add(0x08, gap(1, std::int64_t{1} << 62, 0, true, writer)),
                        Reason::sequence_number));
    EXPECT_TRUE(
        dropped(forged().add(0x08, gap(1, std::int64_t{1} << 40, 0, true, writer)), Reason::rate));
  }
}

// The library would store every number of the gap at 64 octets each, because the first one is
// missing.
TEST_F(Attack, AGapOverManyNumbersOfAnInventedParticipant) {
  constexpr std::size_t kGrowth = (kIsSanitized ? 256U : 50U) << 20U;  // without a guard: 1 GB
  const std::size_t before = gateway.resident();
  for (Sender stranger = 9; stranger < 12; ++stranger) {
    for (int i = 0; i < 3; ++i)
      forger.unicast(announcement(stranger).get());
    // By then the gateway has processed the announcement.
    EXPECT_TRUE(a_new_client_finds_the_gateway());
    for (const std::int64_t base : {1 << 24, 2 + (1 << 17)})
      forger.unicast(
          Datagram(stranger).add(0x08, gap(2, base, 0, true, entity::kPublications)).get());
    EXPECT_TRUE(a_new_client_finds_the_gateway());
    ASSERT_LT(gateway.resident(), before + kGrowth);
  }
}

// The library reads as many numbers as the sequence claims: one datagram costs 4 GiB and a minute.
TEST_F(Attack, ASequenceOfNumbersOfMoreThanItHolds) {
  for (const unsigned id : {0x73U, 0x8006U}) {
    const Fields list =
        Fields().u8(0).u8(3).u16(0).parameter(id, Fields().u32(0xFFFFFFFF).u32(0)).sentinel();
    for (const std::uint32_t writer : {entity::kPublications, entity::kSubscriptions})
      EXPECT_TRUE(dropped(forged().add(0x15, data(1, writer).octets(list.get()), kHasData),
                          Reason::discovery));
  }
}

TEST_F(Attack, AHeartbeatFarAheadOfALiveWriter) {
  constexpr std::int64_t kFar = std::int64_t{1} << 40;
  for (const std::uint32_t writer :
       {entity_of(victim), entity::kPublications, entity::kSubscriptions, entity::kLiveliness}) {
    EXPECT_TRUE(dropped(forged().add(0x07, heartbeat(kFar, kFar, true, writer)), Reason::rate));
  }
}

TEST_F(Attack, ATokenOfMorePropertiesThanItHolds) {
  Fields guid;
  for (const std::uint8_t octet : dds::guard::make_guid(prefix_of(9), 0x000001C1))
    guid.u8(octet);
  const Fields token = Fields().string("DDS:Auth:PKI-DH:1.0").u32(1U << 24U);
  const Fields list =
      Fields().u8(0).u8(3).u16(0).parameter(0x50, guid).parameter(0x1001, token).sentinel();
  EXPECT_TRUE(
      dropped(Datagram(9).add(0x15, data(1, entity::kParticipants).octets(list.get()), kHasData),
              Reason::discovery));
}

TEST_F(Attack, AFragmentOfASampleThatIsTooLarge) {
  EXPECT_TRUE(
      dropped(forged().add(0x16, fragment_of(entity_of(victim), 5, 0x80000000)), Reason::fragment));
}

// Readers keep no sample of a writer that they are not matched with, whether its participant was
// never announced or is live.
TEST_F(AttackOnMemory, SamplesOfWritersThatNobodyAnnounced) {
  constexpr std::uint32_t kInvented = 10'000;
  constexpr std::size_t kMost = 64U << 20U;
  const std::size_t before = gateway.resident();
  for (std::uint32_t i = 0; i < kInvented; ++i) {
    dds::guard::Prefix from = i % 2 == 0 ? prefix_of(9) : dds::guard::prefix_of(victim);
    if (i % 2 == 0) {
      from[4] = static_cast<std::uint8_t>(i >> 8U);
      from[5] = static_cast<std::uint8_t>(i);
    }
    const std::uint32_t writer = i << 8U | 3U;
    const Fields sample = data(1, writer).u8(0).u8(1).u16(0).zeros(64);
    forger.unicast(Datagram(from)
                       .add(0x15, sample, kHasData)
                       .add(0x07, heartbeat(1, 1'000, true, writer))
                       .add(0x08, gap(1, 100, 32, true, writer))
                       .add(0x16, fragment_of(writer, 2'000, 60'000))
                       .add(0x15, data(1, entity::kLiveliness).octets(sample.get()))
                       .get());
  }
  EXPECT_TRUE(output_arrives());
  EXPECT_LT(gateway.resident(), before + kMost);
}

// The library reserves memory for the whole sample at its first fragment, and keeps it until the
// sample is complete.
TEST_F(Attack, AFragmentEachOfManySamples) {
  constexpr std::size_t kMost = 128U << 20U;
  Peer client{"subscriber"};
  ASSERT_FALSE(client.expect("image").empty());
  auto* images = endpoints.reader<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE);
  ASSERT_NE(images, nullptr);
  eprosima::fastdds::dds::SubscriptionMatchedStatus matched;
  ASSERT_TRUE(eventually([&] {
    images->get_subscription_matched_status(matched);
    return matched.current_count > 0;
  }));
  const dds::guard::Guid writer =
      to_guid(eprosima::fastrtps::rtps::iHandle2GUID(matched.last_publication_handle));
  const auto forge = [&](std::int64_t number, std::uint32_t size) {
    forger.unicast(Datagram(dds::guard::prefix_of(writer))
                       .add(0x16, fragment_of(entity_of(writer), number, size))
                       .get());
  };
  const std::size_t before = client.resident();
  for (const std::uint32_t size : {100'000U, 4U << 20U}) {
    std::int64_t number = 1'000;
    EXPECT_TRUE(eventually(
        [&] {
          for (int i = 0; i < 20; ++i)
            forge(++number, size);
          return !client.expect("guard fragment", std::chrono::milliseconds(200)).empty() &&
                 number >= 2'000;
        },
        std::chrono::seconds(60)));
  }
  EXPECT_LT(client.resident(), before + kMost);
  EXPECT_TRUE(client.end());
}

TEST_F(Attack, ProtectedContentThatClaimsMoreThanItHas) {
  for (const std::uint32_t claimed : {41U, 0x7FFFFFFFU, 0xFFFFFFFFU}) {
    const Fields content = Fields(false).u32(claimed).zeros(40);
    const Fields footer = Fields(false).zeros(20);
    EXPECT_TRUE(dropped(forged().add(0x33, Fields().zeros(20)).add(0x30, content).add(0x34, footer),
                        Reason::protection));
    EXPECT_TRUE(dropped(forged().add(0x31, Fields().zeros(20)).add(0x30, content).add(0x32, footer),
                        Reason::protection));
  }
}

// If the library kept such a reader, an acknowledgement from it would end the process.
TEST_F(Attack, ABestEffortReaderThatBecomesReliable) {
  Fields own;
  const auto guid = dds::guard::make_guid(dds::guard::prefix_of(victim), 0x00007704);
  for (const std::uint8_t octet : guid)
    own.u8(octet);
  std::int64_t number = 100;
  const auto announce = [&](unsigned reliability) {
    const Fields list = Fields()
                            .u8(0)
                            .u8(3)
                            .u16(0)
                            .parameter(0x05, Fields().string(v1::TOPIC_LINE_STATE))
                            .parameter(0x07, Fields().string("linegate::v1::LineState"))
                            .parameter(0x5A, own)
                            .parameter(0x1A, Fields().u32(reliability).zeros(8))
                            .sentinel();
    return forged().add(0x15, data(++number, entity::kSubscriptions).octets(list.get()), kHasData);
  };
  forger.unicast(announce(1).get());
  EXPECT_TRUE(dropped(announce(2), Reason::reliability));
  EXPECT_TRUE(dropped(forged().add(0x06, acknack(1, 0, 0x00007704, 0)), Reason::reliability));
}

// --- legitimate traffic --------------------------------------------------------------------------

TEST(GuardedSystem, NothingOfItIsDropped) {
  Peer gateway("gateway");
  ASSERT_FALSE(gateway.expect("ready").empty());
  const auto client = make_client(client_options());
  ASSERT_NE(client, nullptr);
  Lines lines;
  line::Command command{.request = line::SdoRead{
                            .node = 9, .address = {0, 100}}};  // in many samples, and in fragments
  const auto result = client->call(known_line(), command, std::chrono::seconds(30), lines);
  EXPECT_TRUE(result.reply.ok());
  EXPECT_EQ(result.reply.bytes().size(), 100U * 1024);
  const auto late = make_client(client_options());
  ASSERT_NE(late, nullptr);
  Lines late_lines;
  EXPECT_TRUE(eventually([&] {
    late->poll(std::chrono::milliseconds(50), late_lines);
    return late_lines.count > 0;
  }));
  // Wait until the liveliness was asserted a few times.
  EXPECT_TRUE(eventually([&] {
    client->poll(std::chrono::milliseconds(50), lines);
    return client->guard_counters().received > 200;
  }));
  for (const auto& counters : {client->guard_counters(), late->guard_counters()}) {
    for (std::size_t i = 0; i < dds::guard::kReasons; ++i)
      EXPECT_EQ(counters.dropped[i], 0U) << to_string(static_cast<Reason>(i));
  }
  EXPECT_EQ(gateway.expect("guard", std::chrono::milliseconds(0)), "");
}

// 2,000,000 samples were written before the reader joined: the writer positions the reader behind
// them.
TEST(GuardedSystem, ALateJoinerOfAnOldWriterGetsItsData) {
  std::vector<Diagnostic> diagnostics;
  dds::Endpoints endpoints("old", domain(), paths::kLoopbackProfiles, diagnostics);
  auto* outputs = endpoints.writer<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE);
  ASSERT_NE(outputs, nullptr);
  v1::OutputWrite sample;
  sample.gateway(known::kGateway);
  sample.line(known::kLine);
  sample.client("old");
  sample.values().resize(1);
  sample.values()[0].data({1});
  for (int i = 0; i < 2'000'000; ++i)
    outputs->write(&sample);
  Peer gateway("gateway");
  ASSERT_FALSE(gateway.expect("ready").empty());
  EXPECT_TRUE(eventually([&] {
    outputs->write(&sample);
    return !gateway.expect("output line=line1 client=old", std::chrono::milliseconds(200)).empty();
  }));
  EXPECT_TRUE(gateway.end());
}

// The writer keeps samples 2 and 1,000,001, and the reader shall receive neither. The GAP over them
// begins above number 1, and the writer repeats it until the reader has requested its missing
// numbers.
TEST(GuardedSystem, ALateJoinerOfAHistoryWithAHoleGetsItsData) {
  std::vector<Diagnostic> diagnostics;
  dds::Endpoints endpoints("old", domain(), paths::kLoopbackProfiles, diagnostics);
  auto* as_configured = endpoints.writer<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE);
  ASSERT_NE(as_configured, nullptr);
  eprosima::fastdds::dds::DataWriterQos qos = as_configured->get_qos();
  qos.durability().kind = eprosima::fastdds::dds::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = eprosima::fastdds::dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 1;
  auto* outputs = const_cast<eprosima::fastdds::dds::Publisher*>(as_configured->get_publisher())
                      ->create_datawriter(as_configured->get_topic(), qos);
  ASSERT_NE(outputs, nullptr);
  v1::OutputWrite sample;
  sample.gateway(known::kGateway);
  sample.line(known::kLine);
  sample.values().resize(1);
  sample.values()[0].data({1});
  sample.client("old");
  outputs->write(&sample);
  sample.group(1);  // another instance
  outputs->write(&sample);
  sample.group(0);
  for (int i = 0; i < 1'000'000; ++i)
    outputs->write(&sample);
  Peer gateway("gateway");
  ASSERT_FALSE(gateway.expect("ready").empty());
  EXPECT_TRUE(eventually(
      [&] {
        outputs->write(&sample);
        return !gateway
                    .expect("output line=line1 client=old group=0", std::chrono::milliseconds(200))
                    .empty();
      },
      std::chrono::seconds(60)));
  EXPECT_TRUE(gateway.end());
}

}  // namespace
}  // namespace linegate::test
