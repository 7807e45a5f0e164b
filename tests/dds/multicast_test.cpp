// SPDX-License-Identifier: Apache-2.0
// Readers that announce multicast locators must not crash a gateway.
#include <array>
#include <string>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastrtps/utils/IPLocator.h>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/profiles.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;

Locator_t locator(const std::string& address, std::uint16_t port) {
  Locator_t out;
  out.kind = LOCATOR_KIND_UDPv4;
  IPLocator::setIPv4(out, address);
  IPLocator::setPhysicalPort(out, port);
  return out;
}

// A reader of LineState that announces its own unicast locator and a multicast locator.
class MulticastReader {
 public:
  explicit MulticastReader(std::uint16_t unicast_port) {
    auto* factory = fast::DomainParticipantFactory::get_instance();
    fast::DomainParticipantQos qos;
    factory->get_participant_qos_from_profile(dds::kParticipantProfile, qos);
    participant_ = factory->create_participant(domain(), qos);
    subscriber_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    fast::TypeSupport type(new v1::LineStatePubSubType());
    type->auto_fill_type_information(false);
    type->auto_fill_type_object(false);
    type.register_type(participant_);
    auto* topic = participant_->create_topic(v1::TOPIC_LINE_STATE, type.get_type_name(),
                                             fast::TOPIC_QOS_DEFAULT);
    fast::DataReaderQos reader_qos;
    subscriber_->get_datareader_qos_from_profile(v1::TOPIC_LINE_STATE, reader_qos);
    reader_qos.endpoint().unicast_locator_list.push_back(locator("127.0.0.1", unicast_port));
    reader_qos.endpoint().multicast_locator_list.push_back(locator("239.255.7.7", 27'777));
    reader_ = subscriber_->create_datareader(topic, reader_qos);
  }
  ~MulticastReader() {
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  MulticastReader(const MulticastReader&) = delete;
  MulticastReader& operator=(const MulticastReader&) = delete;

  bool receives() {
    v1::LineState sample;
    fast::SampleInfo info;
    reader_->wait_for_unread_message({0, 50'000'000});
    return reader_->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK;
  }

 private:
  fast::DomainParticipant* participant_ = nullptr;
  fast::Subscriber* subscriber_ = nullptr;
  fast::DataReader* reader_ = nullptr;
};

// Both readers have a unicast locator and the same multicast locator: Fast DDS 2.9 ends the process
// of the writer with an assertion unless it keeps no multicast locators
// (Endpoints::create_participant).
TEST(Multicast, TwoReadersWithOneMulticastLocatorReceiveByUnicast) {
  std::vector<Diagnostic> diagnostics;
  ASSERT_TRUE(dds::load_profiles(paths::kLoopbackProfiles, diagnostics));
  Peer gateway("gateway");
  ASSERT_EQ(gateway.expect("ready"), "ready");
  const auto port = static_cast<std::uint16_t>(20'000 + 10 * domain());
  MulticastReader first(port);
  EXPECT_TRUE(eventually([&] { return first.receives(); }));
  MulticastReader second(static_cast<std::uint16_t>(port + 1));
  EXPECT_TRUE(eventually([&] { return second.receives(); }));
  EXPECT_TRUE(gateway.end()) << "the gateway ended unexpectedly";
}

}  // namespace
}  // namespace linegate::test
