// SPDX-License-Identifier: Apache-2.0
// One participant with its writers and readers, each as its profile says. Owns them all.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "bridges/dds/guard/guard.h"
#include "bridges/dds/name_watch.h"
#include "bridges/dds/received_type.h"
#include "bridges/dds/written_type.h"
#include "stack/base/diagnostic.h"

namespace linegate::dds {

class Endpoints {
 public:
  // Loads the profiles (see load_profiles) and creates the participant. On failure ok() is false
  // and a diagnostic tells why.
  // guarded: a guard judges what is received (bridges/dds/guard). participants: others that are
  // taken note of at the same time; 0: as the profile says, or kMostParticipants.
  Endpoints(const std::string& name, std::uint32_t domain, const std::string& profile_file,
            std::vector<Diagnostic>& diagnostics, bool guarded = true,
            std::size_t participants = 0);
  ~Endpoints();
  Endpoints(const Endpoints&) = delete;
  Endpoints& operator=(const Endpoints&) = delete;

  // False as soon as anything could not be created.
  bool ok() const { return ok_; }

  // From now on failures are told by nullptr alone: the diagnostics may go. No more topics are
  // created, and writers and readers may be from any thread.
  void seal() { diagnostics_ = nullptr; }

  // Other participants of the domain that have its name, see namesakes.h. From any thread.
  std::size_t namesakes() const { return names_.namesakes(); }
  // The other gateways of the domain. From any thread.
  Peers peers() const { return names_.peers(); }
  // Other participants of the domain. From any thread.
  DiscoveryCounters discovery() const { return names_.discovery(); }

  // What the guard received and dropped; zeros without one. From any thread.
  guard::Counters guard_counters() const {
    return guard_ == nullptr ? guard::Counters{} : guard_->counters();
  }

  // Received samples that could not be read, since the last call.
  std::uint64_t take_unreadable() { return unreadable_->take(); }

  // Nobody may write meanwhile; what a reader has not got yet is lost to it.
  void remove(eprosima::fastdds::dds::DataWriter* writer);
  void remove(eprosima::fastdds::dds::DataReader* reader) {
    subscriber_->delete_datareader(reader);
  }

  // nullptr on failure, with a diagnostic. strength: of the ownership, where the profile says
  // EXCLUSIVE.
  template <class PubSubType>
  eprosima::fastdds::dds::DataWriter* writer(const std::string& topic, std::uint32_t strength = 0) {
    return make_writer(topic, eprosima::fastdds::dds::TypeSupport(new WrittenType<PubSubType>()),
                       strength);
  }
  template <class PubSubType>
  eprosima::fastdds::dds::DataReader* reader(const std::string& topic) {
    auto* type = new ReceivedType<PubSubType>(unreadable_);
    return make_reader(topic, eprosima::fastdds::dds::TypeSupport(type));
  }

 private:
  void create_participant(const std::string& name, std::uint32_t domain, bool guarded);
  void bound_discovery(eprosima::fastdds::dds::DomainParticipantQos& qos);
  eprosima::fastdds::dds::DataWriter* make_writer(const std::string& topic,
                                                  eprosima::fastdds::dds::TypeSupport type,
                                                  std::uint32_t strength);
  eprosima::fastdds::dds::DataReader* make_reader(const std::string& topic,
                                                  eprosima::fastdds::dds::TypeSupport type);
  eprosima::fastdds::dds::Topic* make_topic(const std::string& topic,
                                            eprosima::fastdds::dds::TypeSupport type);
  void fail(std::string text);

  std::vector<Diagnostic>* diagnostics_;  // nullptr once it has been set up
  std::shared_ptr<UnreadableCount> unreadable_ = std::make_shared<UnreadableCount>();
  std::shared_ptr<guard::Guard> guard_;  // nullptr: switched off
  NameWatch names_;                      // outlives the participant, which it listens to
  std::string origin_;                   // of the profiles
  std::size_t participants_;
  bool ok_ = true;
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
  std::map<std::string, eprosima::fastdds::dds::Topic*> topics_;
};

}  // namespace linegate::dds
