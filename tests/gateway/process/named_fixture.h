// SPDX-License-Identifier: Apache-2.0
// A gateway with named topics, and their readers and writers with types that fastddsgen generated
// from what `linegate idl` printed. The device is a line of the same gateway, in the role device.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
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
#include "bridges/dds/security.h"
#include "bridges/dds/security_properties.h"
#include "gateway/process/gateway.h"
#include "gateway/runtime/clock.h"
#include "gateway/security/files.h"

#include "tests/bridges/named/every_value.h"
#include "tests/dds/own_domain.h"
#include "tests/gateway/plans.h"
#include "tests/gateway/process/gateway_listener.h"
#include "tests/paths.h"

namespace linegate::gateway {

namespace fast = eprosima::fastdds::dds;
using InputsType = plant::press_every_inputs_26c77fbdaf07453cPubSubType;
using OutputsType = plant::press_every_outputs_41c5ad8c1defa64fPubSubType;
using SetType = plant::press_all_set_6496a29b850773f3PubSubType;

inline constexpr std::chrono::seconds kNamedPatience{30};

// outputs: `outputs:` of the line press, in the form of a mapping. dds: further keys of `dds:`.
inline config::Plant named_plant(bool named, const std::string& outputs = "{}",
                                 const std::string& dds = {}) {
  const std::string file = paths::in_repository("tests/bridges/named/every_type.");
  return make_plant(
      "schema: 1\ngateway: {name: test}\ndds: {domain: " + std::to_string(test::own_domain()) +
      ", process: " + place_of_dds().process + ", profile: " + paths::kLoopbackProfiles + dds +
      "}\nlines:\n"
      "  - name: press\n    interface: \"virtual:named\"\n    access: all\n    named: " +
      (named ? "true" : "false") + "\n    nodes: [{id: 5, name: every, eds: " + file +
      "eds, heartbeat: 100ms}]\n    outputs: " + outputs +
      "\n"
      "  - name: device\n    interface: \"virtual:named\"\n    role: device\n    access: all\n"
      "    devices: [{id: 5, name: every, eds: " +
      file + "eds}]\n");
}

// identity: its folder; empty without DDS-Security. The gateway has loaded the profiles.
inline fast::DomainParticipant* make_named_participant(const std::string& identity) {
  auto* const factory = fast::DomainParticipantFactory::get_instance();
  fast::DomainParticipantQos qos;
  factory->get_participant_qos_from_profile(dds::kParticipantProfile, qos);
  if (!identity.empty()) {
    dds::add_properties(dds::security_with(security::files_in(identity)), qos);
  }
  return factory->create_participant(static_cast<fast::DomainId_t>(test::own_domain()), qos);
}

// A participant with one reader.
template <class PubSubType>
class NamedReader {
 public:
  using Sample = typename PubSubType::type;

  explicit NamedReader(
      const std::string& topic,
      fast::DurabilityQosPolicyKind durability = fast::TRANSIENT_LOCAL_DURABILITY_QOS,
      const std::string& identity = {})
      : participant_(make_named_participant(identity)) {
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
  fast::DomainParticipant* participant_;
  fast::DataReader* reader_ = nullptr;
};

// A participant with one writer of group 1 of the line press, with the QoS of OutputWrite.
template <class PubSubType>
class GroupWriter {
 public:
  // partitions: without any, the default one.
  GroupWriter(const std::string& topic_name, const std::string& client, std::uint32_t strength,
              const std::vector<std::string>& partitions, const std::string& identity)
      : participant_(make_named_participant(identity)) {
    fast::TypeSupport type(new PubSubType());
    type.register_type(participant_);
    auto* const topic =
        participant_->create_topic(topic_name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    fast::PublisherQos publisher_qos = fast::PUBLISHER_QOS_DEFAULT;
    for (const std::string& partition : partitions) {
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
  ~GroupWriter() {
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  GroupWriter(const GroupWriter&) = delete;
  GroupWriter& operator=(const GroupWriter&) = delete;

  bool write() { return writer_->write(&sample); }
  int readers() {
    fast::PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return status.current_count;
  }

  static constexpr int kMostInstances = 2'000;
  typename PubSubType::type sample;

 private:
  fast::DomainParticipant* participant_;
  fast::DataWriter* writer_ = nullptr;
};

class SetWriter : public GroupWriter<SetType> {
 public:
  // partition: empty for the default one.
  explicit SetWriter(const std::string& client, std::uint32_t strength,
                     const std::string& partition = {}, const std::string& identity = {})
      : GroupWriter("plant/press/all/outputs/set", client, strength,
                    partition.empty() ? std::vector<std::string>{} : std::vector{partition},
                    identity) {}
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
        {.domain = test::own_domain(), .profile_file = paths::kLoopbackProfiles, .outputs = true});
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
    for (const test::EveryValue& value : test::kEveryValue) {
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

}  // namespace linegate::gateway
