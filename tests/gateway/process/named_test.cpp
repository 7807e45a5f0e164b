// SPDX-License-Identifier: Apache-2.0
// Named topics of a gateway, read and written with types that fastddsgen generated from what
// `linegate idl` printed. The device is a line of the same gateway, in the role device.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <every_typePubSubTypes.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <gtest/gtest.h>

#include "bridges/dds/client.h"
#include "bridges/dds/profiles.h"
#include "gateway/process/gateway.h"
#include "gateway/runtime/clock.h"

#include "tests/bridges/named/every_value.h"
#include "tests/dds/own_domain.h"
#include "tests/gateway/plans.h"
#include "tests/gateway/process/gateway_listener.h"

namespace linegate::gateway {
namespace {

namespace fast = eprosima::fastdds::dds;
using Inputs = plant::press_every_inputs_26c77fbdaf07453c;
using InputsType = plant::press_every_inputs_26c77fbdaf07453cPubSubType;
using Outputs = plant::press_every_outputs_c3600e3d770d8694;
using OutputsType = plant::press_every_outputs_c3600e3d770d8694PubSubType;
using Set = plant::press_all_set_6496a29b850773f3;
using SetType = plant::press_all_set_6496a29b850773f3PubSubType;
using test::kEveryValue;

constexpr std::chrono::seconds kNamedPatience{30};

// outputs: `outputs:` of the line press, in the form of a mapping. dds: further keys of `dds:`.
config::Plant named_plant(bool named, const std::string& outputs = "{}",
                          const std::string& dds = {}) {
  const std::string file = LINEGATE_SOURCE_DIR "/tests/bridges/named/every_type.";
  auto loaded = config::read(
      "schema: 1\ngateway: {name: test}\ndds: {domain: " + std::to_string(test::own_domain()) +
          ", process: same, profile: " + LOOPBACK_PROFILES + dds +
          "}\nlines:\n"
          "  - name: press\n    interface: \"virtual:named\"\n    access: all\n    named: " +
          (named ? "true" : "false") + "\n    nodes: [{id: 5, name: every, eds: " + file +
          "eds, heartbeat: 100ms}]\n    outputs: " + outputs +
          "\n"
          "  - name: device\n    interface: \"virtual:named\"\n    role: device\n    access: all\n"
          "    devices: [{id: 5, name: every, eds: " +
          file + "eds}]\n",
      LINEGATE_SOURCE_DIR "/plant.yaml");
  EXPECT_TRUE(loaded.value);
  return loaded.value ? std::move(*loaded.value) : config::Plant{};
}

// A participant with one reader. The gateway has loaded the profiles.
template <class PubSubType>
class NamedReader {
 public:
  using Sample = typename PubSubType::type;

  explicit NamedReader(const std::string& topic, fast::DurabilityQosPolicyKind durability =
                                                     fast::TRANSIENT_LOCAL_DURABILITY_QOS) {
    auto* const factory = fast::DomainParticipantFactory::get_instance();
    participant_ = factory->create_participant_with_profile(
        static_cast<fast::DomainId_t>(test::own_domain()), dds::kParticipantProfile);
    fast::TypeSupport type(new PubSubType());
    type.register_type(participant_);
    auto* const made =
        participant_->create_topic(topic, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    auto* const subscriber = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = durability;
    reader_ = subscriber->create_datareader(made, qos);
  }
  ~NamedReader() {
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  NamedReader(const NamedReader&) = delete;
  NamedReader& operator=(const NamedReader&) = delete;

  void take() {
    Sample taken;
    fast::SampleInfo info;
    while (reader_->take_next_sample(&taken, &info) == ReturnCode_t::RETCODE_OK) {
      disposed = info.instance_state == fast::NOT_ALIVE_DISPOSED_INSTANCE_STATE;
      if (!info.valid_data) {
        continue;
      }
      back += taken.sequence_number() <= sample.sequence_number() ? 1 : 0;
      first = first == 0 ? taken.sequence_number() : first;
      sample = taken;
    }
  }
  int writers() {
    fast::SubscriptionMatchedStatus status;
    reader_->get_subscription_matched_status(status);
    return status.current_count;
  }

  Sample sample;  // the newest
  bool disposed = false;
  std::uint64_t first = 0;  // sequence_number of the first one
  int back = 0;             // samples with a number that is not above the one before

 private:
  fast::DomainParticipant* participant_ = nullptr;
  fast::DataReader* reader_ = nullptr;
};

// A participant with one writer, with the QoS of OutputWrite.
class SetWriter {
 public:
  // partition: empty for the default one.
  SetWriter(const std::string& client, std::uint32_t strength, const std::string& partition = {}) {
    auto* const factory = fast::DomainParticipantFactory::get_instance();
    participant_ = factory->create_participant_with_profile(
        static_cast<fast::DomainId_t>(test::own_domain()), dds::kParticipantProfile);
    fast::TypeSupport type(new SetType());
    type.register_type(participant_);
    auto* const topic = participant_->create_topic("plant/press/all/outputs/set",
                                                   type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    fast::PublisherQos publisher_qos = fast::PUBLISHER_QOS_DEFAULT;
    if (!partition.empty()) {
      publisher_qos.partition().push_back(partition.c_str());
    }
    auto* const publisher = participant_->create_publisher(publisher_qos);
    fast::DataWriterQos qos;
    publisher->get_datawriter_qos_from_profile("linegate/v1/OutputWrite", qos);
    qos.ownership_strength().value = strength;
    qos.resource_limits().max_samples = qos.resource_limits().max_instances = kMostInstances;
    writer_ = publisher->create_datawriter(topic, qos);
    sample.gateway("test");
    sample.line("press");
    sample.group(1);
    sample.client(client);
    sample.arming(1);
  }
  ~SetWriter() {
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  SetWriter(const SetWriter&) = delete;
  SetWriter& operator=(const SetWriter&) = delete;

  bool write() { return writer_->write(&sample); }
  int readers() {
    fast::PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return status.current_count;
  }

  static constexpr int kMostInstances = 2'000;
  Set sample;

 private:
  fast::DomainParticipant* participant_ = nullptr;
  fast::DataWriter* writer_ = nullptr;
};

struct NamedListener : GatewayListener {
  void on_gateway(const dds::Source&, const dds::GatewayInfo& info) override {
    participants = info.participants;
  }

  std::size_t participants = 0;
};

class NamedGatewayTest : public testing::Test {
 protected:
  explicit NamedGatewayTest(std::string outputs = "{}", std::string dds = {})
      : outputs_(std::move(outputs)), dds_(std::move(dds)) {}
  void SetUp() override {
    auto made = Gateway::make(named_plant(true, outputs_, dds_), kIncarnation);
    ASSERT_TRUE(made.ok());
    gateway_ = std::move(*made.value);
    gateway_->start();
    auto client = dds::Client::make(
        {.domain = test::own_domain(), .profile_file = LOOPBACK_PROFILES, .outputs = true});
    ASSERT_TRUE(client.ok());
    client_ = std::move(*client.value);
    ASSERT_TRUE(until([&] {
      return seen_.nodes["press/every"].state == nmt::State::operational &&
             client_->output_peers() > 0 && seen_.layouts.size() == 4;
    }));
  }

  bool until(const std::function<bool()>& condition) {
    const Instant give_up = monotonic_now() + kNamedPatience;
    while (!condition()) {
      if (monotonic_now() > give_up) {
        return false;
      }
      client_->poll(std::chrono::milliseconds(20), seen_);
    }
    return true;
  }
  // Writes each value to the entry "every.PREFIXname" of the outputs of a line.
  void write(const std::string& line, std::string_view prefix) {
    const image::Layout& layout = seen_.layouts[line + "/outputs"];
    line::OutputWrite write;
    write.layout_id = layout.id;
    for (const test::EveryValue& value : kEveryValue) {
      if (line == "device" && value.name == "Domain") {
        continue;  // of an object that its PDO cannot carry
      }
      const std::string name = "every." + std::string(prefix) + std::string(value.name);
      const auto entry = std::ranges::find(layout.entries, name, &image::Entry::name);
      ASSERT_NE(entry, layout.entries.end()) << name;
      line::OutputValue one;
      one.entry = static_cast<std::uint32_t>(entry - layout.entries.begin());
      one.length = value.length;
      std::ranges::transform(value.data, one.data.begin(),
                             [](std::uint8_t octet) { return std::byte{octet}; });
      write.values.push_back(one);
    }
    EXPECT_TRUE(client_->write_outputs({"test", line, 0}, write));
  }

  static constexpr std::uint64_t kIncarnation = 0x1234'5678'9ABC'DEF0;
  const std::string outputs_;
  const std::string dds_;
  std::unique_ptr<Gateway> gateway_;
  std::unique_ptr<dds::Client> client_;
  NamedListener seen_;
};

TEST_F(NamedGatewayTest, AnInputOfEveryTypeArrivesByName) {
  NamedReader<InputsType> reader("plant/press/every/inputs");
  write("device", "");
  ASSERT_TRUE(until([&] {
    reader.take();
    return reader.sample.values().Duration() == 86'400'002'000'000;  // of the last PDO
  }));
  const Inputs& sample = reader.sample;
  EXPECT_EQ(sample.gateway(), "test");
  EXPECT_EQ(sample.line(), "press");
  EXPECT_EQ(sample.incarnation(), kIncarnation);
  EXPECT_EQ(reader.back, 0);
  EXPECT_GT(sample.received().pdo1(), 1'700'000'000'000'000'000);
  EXPECT_GE(sample.time(), sample.received().pdo18());
  EXPECT_EQ(sample.received().pdo19(), 0);
  const auto& values = sample.values();
  EXPECT_TRUE(values.Flag());
  EXPECT_FALSE(values.Second_flag());
  EXPECT_EQ(values.n24V_supply(), 240);
  EXPECT_EQ(values.Signed_16(), -300);
  EXPECT_EQ(values.Unsigned_16(), 65'000);
  EXPECT_EQ(values.Signed_24(), -70'000);
  EXPECT_EQ(values.Unsigned_24(), 16'000'000U);
  EXPECT_EQ(values.Signed_32(), -2'000'000'000);
  EXPECT_EQ(values.Unsigned_32(), 4'000'000'000U);
  EXPECT_EQ(values.Signed_40(), -500'000'000'000);
  EXPECT_EQ(values.Unsigned_40(), 1'000'000'000'000U);
  EXPECT_EQ(values.Signed_48(), -100'000'000'000'000);
  EXPECT_EQ(values.Unsigned_48(), 200'000'000'000'000U);
  EXPECT_EQ(values.Signed_56(), -30'000'000'000'000'000);
  EXPECT_EQ(values.Unsigned_56(), 70'000'000'000'000'000U);
  EXPECT_EQ(values.Signed_64(), -9'000'000'000'000'000'000);
  EXPECT_EQ(values.Unsigned_64(), 18'000'000'000'000'000'000U);
  EXPECT_EQ(values.Real_64(), -0.1);
  EXPECT_EQ(values.Real_32_m_s(), 1.5F);
  EXPECT_EQ(values.Visible(), "Press 01");
  EXPECT_EQ(values.Octets(), (std::array<std::uint8_t, 8>{0, 1, 2, 3, 0xFC, 0xFD, 0xFE, 0xFF}));
  EXPECT_EQ(values.Unicode(),
            "\xE2\x82\xAC"
            "5 m");
  EXPECT_EQ(values.Time_of_day(), 1'796'000'400'001'000'000);
  EXPECT_EQ(values.Duration(), 86'400'002'000'000);
  // A device of ours does not send it.
  EXPECT_FALSE(sample.valid().Domain());
  EXPECT_TRUE(sample.valid().Duration());
  EXPECT_EQ(values.Domain(), (std::array<std::uint8_t, 8>{}));
}

// Nothing changes when the later readers come: they receive what is written because they came. A
// transient-local one would receive a sample of the time before first.
TEST_F(NamedGatewayTest, AReaderThatComesGetsThePresentStateAndNoOldOne) {
  write("device", "");
  const auto alone = [&] { return seen_.participants == 1; };
  ASSERT_TRUE(until(alone));
  std::uint64_t last = 0;
  {
    NamedReader<InputsType> reader("plant/press/every/inputs", fast::VOLATILE_DURABILITY_QOS);
    ASSERT_TRUE(until([&] {
      reader.take();
      return reader.sample.values().Duration() == 86'400'002'000'000;  // of the last PDO
    }));
    last = reader.sample.sequence_number();
  }
  for (const auto durability :
       {fast::VOLATILE_DURABILITY_QOS, fast::TRANSIENT_LOCAL_DURABILITY_QOS}) {
    ASSERT_TRUE(until(alone));  // the gateway has noticed that the reader before has left
    NamedReader<InputsType> reader("plant/press/every/inputs", durability);
    ASSERT_TRUE(until([&] {
      reader.take();
      return reader.first != 0;
    }));
    EXPECT_GT(reader.first, last);
    EXPECT_EQ(reader.sample.values().Duration(), 86'400'002'000'000);
    last = reader.sample.sequence_number();
  }
}

TEST_F(NamedGatewayTest, OutputsHaveTheirMarksAndAnInstanceEndsWithItsLine) {
  NamedReader<OutputsType> reader("plant/press/every/outputs");
  NamedReader<InputsType> stranger("plant/press/every/outputs");  // another type on that topic
  write("press", "Set ");
  ASSERT_TRUE(until([&] {
    reader.take();
    return reader.sample.valid().Set_Signed_16() && reader.sample.valid().Set_Domain();
  }));
  EXPECT_TRUE(reader.sample.known().Set_Signed_16());
  EXPECT_EQ(reader.sample.values().Set_Signed_16(), -300);
  EXPECT_EQ(reader.sample.values().Set_Unicode(),
            "\xE2\x82\xAC"
            "5 m");
  EXPECT_EQ(reader.sample.values().Set_Domain()[7], 8);
  EXPECT_GT(reader.sample.sent().pdo1(), 0);
  EXPECT_EQ(stranger.writers(), 0);
  EXPECT_EQ(reader.writers(), 1);

  const auto result = gateway_->reload(named_plant(false));
  ASSERT_TRUE(result.done);
  EXPECT_TRUE(until([&] {
    reader.take();
    return reader.disposed && reader.writers() == 0;
  }));
}

class NamedSetTest : public NamedGatewayTest {
 protected:
  explicit NamedSetTest(std::string dds = {})
      : NamedGatewayTest("{groups: [{name: all, written_by: named, entries: [every.*]}]}",
                         std::move(dds)) {}

  // Writes until the condition is true.
  bool write_until(SetWriter& writer, const std::function<bool()>& condition) {
    return until([&] {
      writer.write();
      return condition();
    });
  }
  // Of the group.
  const line::OutputState& state() { return seen_.output_states["press"]; }
  bool is_applied(const std::string& client) {
    return state().owner == client && state().applied > 0;
  }
};

// The device receives what was written; a member that is not given is not written.
TEST_F(NamedSetTest, WhatIsGivenReachesTheDevice) {
  NamedReader<OutputsType> outputs("plant/press/every/outputs");
  SetWriter writer("plc", 5);
  auto& values = writer.sample.values();
  auto& given = writer.sample.given();
  values.every_Set_Flag(true);
  given.every_Set_Flag(true);
  values.every_Set_Second_flag(false);
  given.every_Set_Second_flag(true);
  values.every_Set_class(-5);
  given.every_Set_class(true);
  values.every_Set_24V_supply(240);
  given.every_Set_24V_supply(true);
  values.every_Set_Signed_16(-300);
  given.every_Set_Signed_16(true);
  values.every_Set_Unsigned_16(65'000);
  given.every_Set_Unsigned_16(true);
  values.every_Set_Signed_56(-30'000'000'000'000'000);
  given.every_Set_Signed_56(true);
  values.every_Set_Visible("Press 01");
  given.every_Set_Visible(true);
  values.every_Set_Unicode("\xE2\x82\xAC 5");
  given.every_Set_Unicode(true);
  values.every_Set_Octets(std::array<std::uint8_t, 8>{1, 2, 3, 4, 5, 6, 7, 8});
  given.every_Set_Octets(true);
  values.every_Set_Time_of_day(1'796'000'400'001'000'000);
  given.every_Set_Time_of_day(true);
  values.every_Set_Unsigned_64(99);  // not given
  ASSERT_TRUE(write_until(writer, [&] {
    outputs.take();
    return outputs.sample.valid().Set_Time_of_day() && outputs.sample.valid().Set_Signed_16();
  }));
  const auto& sent = outputs.sample.values();
  EXPECT_TRUE(sent.Set_Flag());
  EXPECT_EQ(sent.Set_class(), -5);
  EXPECT_EQ(sent.Set_24V_supply(), 240);
  EXPECT_EQ(sent.Set_Signed_16(), -300);
  EXPECT_EQ(sent.Set_Signed_56(), -30'000'000'000'000'000);
  EXPECT_EQ(sent.Set_Visible(), "Press 01");
  EXPECT_EQ(sent.Set_Unicode(), "\xE2\x82\xAC 5");
  EXPECT_EQ(sent.Set_Octets(), (std::array<std::uint8_t, 8>{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(sent.Set_Time_of_day(), 1'796'000'400'001'000'000);
  EXPECT_FALSE(outputs.sample.known().Set_Unsigned_64());
  EXPECT_EQ(state().owner, "plc");
  EXPECT_EQ(state().group, 1);

  // Only one member is given, and of the others other values are in the sample.
  given = plant::press_all_set_6496a29b850773f3_given();
  given.every_Set_Signed_16(true);
  values.every_Set_Signed_16(7);
  values.every_Set_Unsigned_16(8);
  const auto arrived = [&] {
    outputs.take();
    const image::Layout& layout = seen_.layouts["device/inputs"];
    const auto entry =
        std::ranges::find(layout.entries, "every.Set Signed 16", &image::Entry::name);
    const image::Snapshot& image = seen_.images["device/inputs"];
    return entry != layout.entries.end() && image.bytes.size() > entry->bit_offset / 8 &&
           image.bytes[entry->bit_offset / 8] == std::byte{7} &&
           outputs.sample.values().Set_Signed_16() == 7;
  };
  ASSERT_TRUE(write_until(writer, arrived)) << "in the device";
  EXPECT_EQ(outputs.sample.values().Set_Unsigned_16(), 65'000);
}

TEST_F(NamedSetTest, TheWatchdogFiresAndANewArmingNumberEndsItsReaction) {
  SetWriter writer("plc", 5);
  writer.sample.values().every_Set_24V_supply(240);
  writer.sample.given().every_Set_24V_supply(true);
  writer.sample.watchdog_ns(100'000'000);
  writer.sample.reactions(line::kZeroOutputs);
  ASSERT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
  ASSERT_TRUE(until([&] { return state().tripped; })) << "the writer is silent";
  ASSERT_TRUE(
      write_until(writer, [&] { return state().refusal == line::OutputRefusal::not_armed; }));
  EXPECT_TRUE(state().tripped);
  writer.sample.arming(2);
  writer.sample.watchdog_ns(0);
  EXPECT_TRUE(write_until(writer, [&] { return state().arming == 2 && !state().tripped; }));
}

TEST_F(NamedSetTest, OutputWriteIsRefusedWithAReason) {
  line::OutputWrite write;
  write.group = 1;
  write.layout_id = seen_.layouts["press/outputs"].id;
  write.values.push_back({.entry = 0, .length = 1, .data = {std::byte{1}}});
  ASSERT_TRUE(until([&] {
    client_->write_outputs({"test", "press", 0}, write);
    return state().refusal == line::OutputRefusal::written_by_name;
  }));
  EXPECT_EQ(state().applied, 0U);
}

TEST_F(NamedSetTest, WhatDoesNotFitOrIsOfAnotherGroupIsRefused) {
  SetWriter writer("plc", 5);
  writer.sample.values().every_Set_Signed_24(0x800000);
  writer.sample.given().every_Set_Signed_24(true);
  ASSERT_TRUE(
      write_until(writer, [&] { return state().refusal == line::OutputRefusal::bad_value; }));
  EXPECT_EQ(state().applied, 0U);
  writer.sample.values().every_Set_Signed_24(0x7FFFFF);
  writer.sample.reactions(line::kNmtStop | line::kNmtResetNode);
  ASSERT_TRUE(
      write_until(writer, [&] { return state().refusal == line::OutputRefusal::bad_reaction; }));
  writer.sample.reactions(line::kHoldOutputs);
  writer.sample.incarnation(kIncarnation + 1);
  ASSERT_TRUE(
      write_until(writer, [&] { return state().refusal == line::OutputRefusal::stale_layout; }));
  EXPECT_EQ(state().applied, 0U);
  writer.sample.incarnation(kIncarnation);
  EXPECT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
  writer.sample.group(2);
  const auto is_unknown = [](const std::string& text) {
    return text.find("outputs of group 2") != std::string::npos;
  };
  EXPECT_TRUE(write_until(writer, [&] { return std::ranges::any_of(seen_.texts, is_unknown); }));
}

TEST_F(NamedSetTest, TheStrongerWriterOwnsTheGroupUntilItIsGone) {
  auto strong = std::make_unique<SetWriter>("strong", 10);
  SetWriter weak("weak", 1);
  ASSERT_TRUE(until([&] { return strong->readers() == 1 && weak.readers() == 1; }));
  ASSERT_TRUE(write_until(*strong, [&] { return is_applied("strong"); }));
  const std::uint64_t before = state().applied;
  bool weak_was_applied = false;
  ASSERT_TRUE(until([&] {
    strong->write();
    weak.write();
    weak_was_applied = weak_was_applied || state().owner == "weak";
    return state().applied > before + 10;
  }));
  EXPECT_FALSE(weak_was_applied);
  strong.reset();
  EXPECT_TRUE(write_until(weak, [&] { return is_applied("weak"); }));
}

// Two gateways may have lines of the same name and type, so their writers are matched with both.
TEST_F(NamedSetTest, ASampleForAnotherGatewayIsIgnored) {
  SetWriter writer("plc", 5);
  std::uint64_t own = 0;
  ASSERT_TRUE(until([&] {
    writer.sample.gateway("other");
    writer.write();
    writer.sample.gateway("test");
    own += writer.write() ? 1U : 0U;
    return state().applied > 5;
  }));
  EXPECT_LE(state().applied, own);
  EXPECT_EQ(state().refused, 0U);
}

// The reader of the gateway has 1024 instances.
TEST_F(NamedSetTest, AWriterWithTooManyKeysDoesNotSilenceOthers) {
  SetWriter hostile("hostile", 9);
  ASSERT_TRUE(until([&] { return hostile.readers() == 1; }));
  for (int i = 0; i < SetWriter::kMostInstances; ++i) {
    hostile.sample.line("line" + std::to_string(i));
    ASSERT_TRUE(hostile.write());
  }
  SetWriter writer("plc", 10);
  EXPECT_TRUE(write_until(writer, [&] {
    hostile.write();  // it stays alive
    return is_applied("plc");
  }));
}

class NamedSetPartitionTest : public NamedSetTest {
 protected:
  NamedSetPartitionTest() : NamedSetTest(", partitions: true") {}
};

TEST_F(NamedSetPartitionTest, ASampleInThePartitionOfTheLineIsReceived) {
  SetWriter writer("plc", 5, "test/press");
  EXPECT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
  SetWriter other("other", 9);  // in the default partition
  EXPECT_TRUE(write_until(other, [&] { return is_applied("other"); }));
}

// After a reload in which the group is not written by name any more its topic is gone, and
// OutputWrite has an effect.
TEST_F(NamedSetTest, AReloadChangesWhoWritesTheGroup) {
  SetWriter writer("plc", 5);
  ASSERT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
  ASSERT_TRUE(
      gateway_->reload(named_plant(true, "{groups: [{name: all, entries: [every.*]}]}")).done);
  EXPECT_TRUE(until([&] { return writer.readers() == 0; }));
  ASSERT_TRUE(until([&] {
    line::OutputWrite write;
    write.group = 1;
    write.layout_id = seen_.layouts["press/outputs"].id;
    client_->write_outputs({"test", "press", 0}, write);
    return is_applied(client_->name());
  }));
  ASSERT_TRUE(gateway_->reload(named_plant(true, outputs_)).done);
  EXPECT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
}

}  // namespace
}  // namespace linegate::gateway
