// SPDX-License-Identifier: Apache-2.0
// Topics read with the dynamic types of Fast DDS, which are not generated. A line of text for each
// sample: topic, then "path=value" of each member: numbers in decimal, real numbers, texts and
// octets as hexadecimal digits. Ends when its standard input is closed.
//
// dynamic_reader DOMAIN PROFILES PARTICIPANT_PROFILE TYPES.xml [TOPIC TYPE]...
// dynamic_reader DOMAIN PROFILES PARTICIPANT_PROFILE: each topic whose type is described over DDS,
// with the described type.
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastrtps/types/DynamicDataFactory.h>
#include <fastrtps/types/DynamicPubSubType.h>
#include <fastrtps/types/DynamicTypeMember.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <poll.h>
#include <unistd.h>

namespace {

namespace fast = eprosima::fastdds::dds;
namespace types = eprosima::fastrtps::types;

std::string hex(std::uint64_t value, int digits) {
  char out[20];
  std::snprintf(out, sizeof out, "%0*llX", digits, static_cast<unsigned long long>(value));
  return out;
}

std::string text_of(types::DynamicData& data, types::MemberId id, types::TypeKind kind) {
  std::string out;
  switch (kind) {
    case types::TK_BOOLEAN:
      return data.get_bool_value(id) ? "true" : "false";
    case types::TK_BYTE:
      return std::to_string(data.get_byte_value(id));
    case types::TK_INT16:
      return std::to_string(data.get_int16_value(id));
    case types::TK_UINT16:
      return std::to_string(data.get_uint16_value(id));
    case types::TK_INT32:
      return std::to_string(data.get_int32_value(id));
    case types::TK_UINT32:
      return std::to_string(data.get_uint32_value(id));
    case types::TK_INT64:
      return std::to_string(data.get_int64_value(id));
    case types::TK_UINT64:
      return std::to_string(data.get_uint64_value(id));
    case types::TK_FLOAT32:
      return hex(std::bit_cast<std::uint32_t>(data.get_float32_value(id)), 8);
    case types::TK_FLOAT64:
      return hex(std::bit_cast<std::uint64_t>(data.get_float64_value(id)), 16);
    case types::TK_STRING8:
      for (const char c : data.get_string_value(id))
        out += hex(static_cast<std::uint8_t>(c), 2);
      return out;
    default:
      return "?";
  }
}

void print(types::DynamicData& data, types::DynamicType_ptr type, const std::string& path) {
  std::map<types::MemberId, types::DynamicTypeMember*> members;
  type->get_all_members(members);
  for (const auto& [id, member] : members) {
    const types::MemberDescriptor* const about = member->get_descriptor();
    const std::string name = path + member->get_name();
    if (about->get_kind() == types::TK_STRUCTURE || about->get_kind() == types::TK_ARRAY) {
      types::DynamicData* const inner = data.loan_value(id);
      if (about->get_kind() == types::TK_STRUCTURE) {
        print(*inner, about->get_type(), name + '.');
      } else {
        std::string octets;
        for (std::uint32_t i = 0; i < inner->get_item_count(); ++i)
          octets += hex(inner->get_byte_value(i), 2);
        std::printf("\t%s=%s", name.c_str(), octets.c_str());
      }
      data.return_loaned_value(inner);
    } else {
      std::printf("\t%s=%s", name.c_str(), text_of(data, id, about->get_kind()).c_str());
    }
  }
}

// With a key, which the XML of Fast DDS 2.9 cannot express for a member: a named topic of one plant
// has one instance.
class KeyedDynamicType : public types::DynamicPubSubType {
 public:
  explicit KeyedDynamicType(types::DynamicType_ptr type) : DynamicPubSubType(type) {
    m_isGetKeyDefined = true;
  }
  bool getKey(void* /*data*/, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
              bool /*force_md5*/) override {
    *handle = eprosima::fastrtps::rtps::InstanceHandle_t();
    handle->value[0] = 1;
    return true;
  }
};

class Listener : public fast::DataReaderListener {
 public:
  explicit Listener(types::DynamicType_ptr type) : type_(type) {}
  void on_data_available(fast::DataReader* reader) override {
    types::DynamicData* const data = types::DynamicDataFactory::get_instance()->create_data(type_);
    fast::SampleInfo info;
    while (reader->take_next_sample(data, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data)
        continue;
      flockfile(stdout);  // each reader may have a thread of its own
      std::printf("%s", reader->get_topicdescription()->get_name().c_str());
      print(*data, type_, "");
      std::printf("\n");
      std::fflush(stdout);
      funlockfile(stdout);
    }
    types::DynamicDataFactory::get_instance()->delete_data(data);
  }

 private:
  types::DynamicType_ptr type_;
};

bool read_topic(fast::DomainParticipant& participant, const std::string& topic,
                types::DynamicType_ptr type) {
  fast::TypeSupport support(new KeyedDynamicType(type));
  support.get()->auto_fill_type_information(false);
  support.get()->auto_fill_type_object(false);
  support.register_type(&participant);
  fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  auto* const subscriber = participant.create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  auto* const made =
      participant.create_topic(topic, support.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  return made != nullptr && subscriber->create_datareader(made, qos, new Listener(type)) != nullptr;
}

bool read_topic_of_file(fast::DomainParticipant& participant, const char* topic,
                        const char* type_name) {
  auto* const builder =
      eprosima::fastrtps::xmlparser::XMLProfileManager::getDynamicTypeByName(type_name);
  return builder != nullptr && read_topic(participant, topic, builder->build());
}

// Types that were described over DDS.
class DescribedTypes : public fast::DomainParticipantListener {
 public:
  using Type = std::pair<std::string, types::DynamicType_ptr>;  // with its topic

  void on_type_discovery(fast::DomainParticipant* /*participant*/,
                         const eprosima::fastrtps::rtps::SampleIdentity& /*request*/,
                         const eprosima::fastrtps::string_255& topic,
                         const types::TypeIdentifier* /*identifier*/,
                         const types::TypeObject* /*object*/,
                         types::DynamicType_ptr type) override {
    const std::lock_guard lock(mutex_);
    if (type)
      found_.emplace_back(topic.to_string(), type);
  }
  std::vector<Type> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(found_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<Type> found_;
};

bool is_input_open() {
  constexpr int kWait = 20;  // ms
  pollfd input{STDIN_FILENO, POLLIN, 0};
  return ::poll(&input, 1, kWait) == 0;
}

int read_described(fast::DomainParticipant& participant, DescribedTypes& described) {
  std::map<std::string, bool> known;
  while (is_input_open()) {
    for (const auto& [topic, type] : described.take()) {
      if (known.emplace(topic, true).second && !read_topic(participant, topic, type))
        return 4;
    }
  }
  return 0;
}

int read_topics_of_file(fast::DomainParticipant& participant, int count, char** names) {
  for (int i = 0; i + 1 < count; i += 2) {
    if (!read_topic_of_file(participant, names[i], names[i + 1]))
      return 4;
  }
  while (is_input_open()) {
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  auto* const factory = fast::DomainParticipantFactory::get_instance();
  const bool described = argc == 4;
  if (argc < 4 || factory->load_XML_profiles_file(argv[2]) != ReturnCode_t::RETCODE_OK ||
      (!described && factory->load_XML_profiles_file(argv[4]) != ReturnCode_t::RETCODE_OK))
    return 2;
  DescribedTypes types_over_dds;
  auto* const participant = factory->create_participant_with_profile(
      static_cast<fast::DomainId_t>(std::strtoul(argv[1], nullptr, 10)), argv[3],
      described ? &types_over_dds : nullptr, fast::StatusMask::none());
  if (participant == nullptr)
    return 3;
  const int status = described ? read_described(*participant, types_over_dds)
                               : read_topics_of_file(*participant, argc - 5, argv + 5);
  participant->set_listener(nullptr);
  participant->delete_contained_entities();
  factory->delete_participant(participant);
  return status;
}
