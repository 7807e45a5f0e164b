// SPDX-License-Identifier: Apache-2.0
// Samples of two writers in an order that a reader of Fast DDS 2.9.1 cannot sort. The samples are
// well-formed: the guard replaces their timestamps (bridges/dds/guard/sample_times.h).
#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/rtps/common/Guid.h>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"

#include "tests/dds/fixtures.h"
#include "tests/dds/guard/datagram.h"
#include "tests/dds/guard/forger.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

// Two live writers of outputs, and samples that are forged in their names.
class Interleaved : public testing::TestWithParam<const char*> {
 protected:
  static constexpr std::int64_t kNext = 1'001;  // forged numbers begin above those of the writers

  void SetUp() override {
    ASSERT_FALSE(gateway_.expect("ready").empty());
    std::uint16_t group = 0;  // each writer has its own group, because both have the same strength
    for (auto* writer : {first_, second_}) {
      ASSERT_NE(writer, nullptr);
      v1::OutputWrite sample = sample_of(++group);
      ASSERT_TRUE(eventually([&] {
        writer->write(&sample);
        return is_received(group, std::chrono::milliseconds(200));
      }));
      forge(*writer, 0x08, [&](std::uint32_t id) { return gap(1, kNext, 0, true, id); });
    }
  }

  bool is_received(std::uint16_t group, std::chrono::milliseconds deadline = kDeadline) {
    return !gateway_
                .expect("output line=line1 client=live group=" + std::to_string(group) + " ",
                        deadline)
                .empty();
  }

  // seconds: source timestamp, 0: none. group: part of the key.
  void forge_sample(eprosima::fastdds::dds::DataWriter& writer, std::int64_t number,
                    std::uint32_t seconds, std::uint16_t group) {
    v1::OutputWrite sample = sample_of(group);
    eprosima::fastrtps::rtps::SerializedPayload_t payload(4096);
    ASSERT_TRUE(v1::OutputWritePubSubType().serialize(&sample, &payload));
    const std::vector<std::uint8_t> octets(payload.data, payload.data + payload.length);
    forge(
        writer, 0x15, [&](std::uint32_t id) { return data(number, id).octets(octets); }, kHasData,
        seconds);
  }

  template <class Make>
  void forge(eprosima::fastdds::dds::DataWriter& writer, unsigned kind, Make body,
             unsigned flags = 0, std::uint32_t seconds = 1) {
    const eprosima::fastrtps::rtps::GUID_t& guid = writer.guid();
    dds::guard::Guid octets{};
    std::copy_n(guid.guidPrefix.value, 12, octets.begin());
    std::copy_n(guid.entityId.value, 4, octets.begin() + 12);
    Datagram datagram(dds::guard::prefix_of(octets));
    if (seconds != 0)
      datagram.add(0x09, Fields().u32(seconds).u32(0));
    datagram.add(kind, body(dds::guard::Wire(octets, false).u32(12)), flags);
    forger_.unicast(datagram.get());
  }

  static v1::OutputWrite sample_of(std::uint16_t group) {
    v1::OutputWrite sample;
    sample.gateway(known::kGateway);
    sample.line(known::kLine);
    sample.client("live");
    sample.group(group);
    sample.values().resize(1);
    sample.values()[0].data({1});
    return sample;
  }

  // Keys that the gateway has not received yet, so that they are new instances.
  static constexpr std::uint16_t kA = 100;
  static constexpr std::uint16_t kB = 200;
  static constexpr std::uint16_t kC = 300;

  Peer gateway_{GetParam()};
  std::vector<Diagnostic> diagnostics_;
  dds::Endpoints endpoints_{"live", domain(), paths::kLoopbackProfiles, diagnostics_};
  eprosima::fastdds::dds::DataWriter* first_ =
      endpoints_.writer<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE);
  eprosima::fastdds::dds::DataWriter* second_ =
      endpoints_.writer<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE);

 private:
  Forger forger_;
};

// The library sorts samples of one writer by number, and samples of two writers by source
// timestamp. Here number 2 of the first writer precedes the second writer's sample, which precedes
// number 1 of the first writer, which precedes number 2. Number 1 is inserted behind number 2: it
// is read, but not found when its instance is to be counted. The next sample of its instance then
// ends the process (DataReaderInstance.hpp:105), also without the guard unless the view state of
// the instance remains NEW (bridges/dds/guard/instance_states.h). Both writers omit a number at
// first, so that their samples stay in the reader.
TEST_P(Interleaved, SourceTimestampsThatFallEndNoProcess) {
  forge_sample(*first_, kNext + 1, 2'000'000'010, kB);
  forge_sample(*second_, kNext + 1, 2'000'000'020, kC);
  forge_sample(*first_, kNext, 2'000'000'030, kA);
  ASSERT_TRUE(is_received(kA));
  forge_sample(*first_, kNext + 2, 2'000'000'031, kA);
  EXPECT_TRUE(is_received(kA));
  EXPECT_TRUE(gateway_.end());
}

// Equal or missing timestamps have the same effect.
TEST_P(Interleaved, EqualSourceTimestampsEndNoProcess) {
  for (const auto& [writer, number, group] :
       {std::tuple{first_, kNext + 1, kB}, {second_, kNext + 1, kC}, {first_, kNext, kA}})
    forge_sample(*writer, number, 0, group);
  ASSERT_TRUE(is_received(kA));
  forge_sample(*first_, kNext + 2, 0, kA);
  EXPECT_TRUE(is_received(kA));
  EXPECT_TRUE(gateway_.end());
}

// Source timestamps that rise with the numbers of each writer, as from a clock that is never set
// back, are harmless.
TEST_P(Interleaved, SourceTimestampsThatRiseWithTheNumbersDoNot) {
  forge_sample(*first_, kNext + 1, 2'000'000'030, kB);
  forge_sample(*second_, kNext + 1, 2'000'000'020, kC);
  forge_sample(*first_, kNext, 2'000'000'010, kA);
  ASSERT_TRUE(is_received(kA));
  ASSERT_TRUE(is_received(kB));
  forge_sample(*first_, kNext + 2, 2'000'000'031, kA);
  ASSERT_TRUE(is_received(kA));
  EXPECT_TRUE(gateway_.end());
}

// A reader keeps one highest number for all writers with the same persistence GUID. When one of
// them ends, a sample of it that waits for a missing earlier number is not removed but read. The
// guard drops the announcements of such writers.
class InterleavedGuarded : public Interleaved {};
INSTANTIATE_TEST_SUITE_P(Peers, InterleavedGuarded, testing::Values("gateway"));

TEST_P(InterleavedGuarded, WritersWithOnePersistenceGuidAreNotTaken) {
  auto qos = first_->get_qos();
  qos.properties().properties().emplace_back("dds.persistence.guid",
                                             "1.2.3.4.5.6.7.8.9.a.b.c|0.0.1.3");
  auto* publisher = const_cast<eprosima::fastdds::dds::Publisher*>(first_->get_publisher());
  ASSERT_NE(publisher->create_datawriter(first_->get_topic(), qos), nullptr);
  EXPECT_FALSE(gateway_.expect("guard discovery ").empty());
  forge_sample(*first_, kNext, 1, kA);
  EXPECT_TRUE(is_received(kA));
  EXPECT_TRUE(gateway_.end());
}

// A GAP lists the number of a fragmented sample that is incomplete. The library looks up that
// sample under a wrong number, does not remove it, and notifies the reader of it.
TEST_P(Interleaved, AGapThatListsAnIncompleteSampleEndsNoProcess) {
  forge(*first_, 0x16, [](std::uint32_t id) { return fragment_of(id, kNext + 2, 128); });
  forge(*first_, 0x08, [](std::uint32_t id) {
    return Fields().entity(0).entity(id).number(kNext).number(kNext + 1).u32(2).u32(0xC0000000);
  });
  forge_sample(*first_, kNext + 3, 1, kA);
  EXPECT_TRUE(is_received(kA));
  EXPECT_TRUE(gateway_.end());
}

INSTANTIATE_TEST_SUITE_P(Peers, Interleaved, testing::Values("gateway", "unguarded"),
                         [](const auto& it) { return std::string(it.param); });

}  // namespace
}  // namespace linegate::test
