// SPDX-License-Identifier: Apache-2.0
// A program of a stranger that makes mistakes: a reader of one topic, for doctor.py.
//
// foreign_endpoint DOMAIN PROFILES TOPIC TYPE PARTITION QOS   TYPE: its name; PARTITION: "-" for
// the default one; QOS: fits, or exclusive (ownership). Prints "ready", and ends at the end of its
// standard input.
#include <cstdio>
#include <cstdlib>
#include <string>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <linegatePubSubTypes.h>

namespace {

namespace fast = eprosima::fastdds::dds;

class NamedType : public linegate::v1::LineStatePubSubType {
 public:
  explicit NamedType(const std::string& name) { setName(name.c_str()); }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7)
    return EXIT_FAILURE;
  auto* factory = fast::DomainParticipantFactory::get_instance();
  fast::DomainParticipantQos participant_qos;
  if (factory->load_XML_profiles_file(argv[2]) != ReturnCode_t::RETCODE_OK ||
      factory->get_participant_qos_from_profile("linegate", participant_qos) !=
          ReturnCode_t::RETCODE_OK)
    return EXIT_FAILURE;
  participant_qos.name("viewer");
  fast::DomainParticipant* const participant =
      factory->create_participant(static_cast<std::uint32_t>(std::atoi(argv[1])), participant_qos);
  const fast::TypeSupport type(new NamedType(argv[4]));
  type.register_type(participant);
  fast::Topic* const topic =
      participant->create_topic(argv[3], type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  fast::SubscriberQos subscriber_qos = fast::SUBSCRIBER_QOS_DEFAULT;
  if (std::string(argv[5]) != "-")
    subscriber_qos.partition().push_back(argv[5]);
  fast::Subscriber* const subscriber = participant->create_subscriber(subscriber_qos);
  fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
  if (std::string(argv[6]) == "exclusive")
    qos.ownership().kind = fast::EXCLUSIVE_OWNERSHIP_QOS;
  if (subscriber->create_datareader(topic, qos) == nullptr)
    return EXIT_FAILURE;
  std::puts("ready");
  std::fflush(stdout);
  while (std::getchar() != EOF) {
  }
  participant->delete_contained_entities();
  factory->delete_participant(participant);
}
