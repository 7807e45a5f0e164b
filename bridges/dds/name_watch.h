// SPDX-License-Identifier: Apache-2.0
// Observes the other participants in the domain: their number, those with the name of this
// participant, the gateways, and the discovery results that the guard needs. Fast DDS reports them
// to a listener only.
//
// With DDS-Security, names count from the authentication on: an announcement is not protected, so
// anybody can forge one, or send a recorded one again.
#pragma once

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fastdds/dds/core/policy/ParameterTypes.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/rtps/builtin/data/ParticipantProxyData.h>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <fastrtps/utils/IPLocator.h>
#include <linegate.h>

#include "bridges/dds/discovery_record.h"
#include "bridges/dds/fan_out.h"
#include "bridges/dds/guard/guard.h"
#include "bridges/dds/namesakes.h"
#include "bridges/dds/observed_qos.h"
#include "bridges/dds/peer_gateways.h"
#include "bridges/dds/values.h"
#include "bridges/dds/writer_partitions.h"
#include "bridges/named/group_types.h"

namespace linegate::dds {

class NameWatch : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  explicit NameWatch(std::string name) : name_(std::move(name)) {}

  // Call it before the participant is created.
  void inform(std::shared_ptr<guard::Guard> guard) { guard_ = std::move(guard); }

  // Call it before the participant is created. nullptr: records nothing.
  void record(std::shared_ptr<DiscoveryRecord> record) { record_ = std::move(record); }

  // From any thread.
  std::size_t namesakes() const {
    const std::lock_guard lock(mutex_);
    return others_.count(now());
  }
  Peers peers() const {
    const std::lock_guard lock(mutex_);
    return {.gateways = peers_.names(), .unchanged = now() - peers_.changed()};
  }

  // The host of a participant as it announced it: its host name, or an address; empty if it
  // announced none, or is not discovered. From any thread.
  std::string host_of(const guard::Prefix& participant) const {
    const std::lock_guard lock(mutex_);
    const auto known = hosts_.find(participant);
    return known == hosts_.end() ? std::string() : known->second;
  }

  // The participant uses DDS-Security: record the partitions of writers of requests, and count the
  // names of authenticated participants only. Call it before the participant is created.
  void expect_authentication() { secured_ = true; }
  // See WriterPartitions::of(). From any thread.
  std::optional<std::vector<std::string>> partitions_of(const guard::Guid& writer) const {
    return partitions_.of(writer);
  }

  // From any thread.
  DiscoveryCounters discovery() const {
    const std::lock_guard lock(mutex_);
    return discovery_;
  }
  // Call it before the participant is created.
  void set_most(std::size_t participants) { discovery_.most = participants; }

  // Called by threads of Fast DDS; only records the change.
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& it) override {
    using Info = eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
    const bool gone =
        it.status == Info::REMOVED_PARTICIPANT || it.status == Info::DROPPED_PARTICIPANT;
    if (guard_ != nullptr) {
      const guard::Prefix prefix = guard::prefix_of(guid(it.info.m_guid));
      const bool endless = it.info.m_leaseDuration.seconds == std::numeric_limits<int>::max();
      gone ? guard_->participant_lost(prefix) : guard_->participant_found(prefix, endless);
    }
    const std::string name = it.info.m_participantName.to_string();
    if (record_ != nullptr) {
      const ObservedPrefix prefix = guard::prefix_of(guid(it.info.m_guid));
      gone ? record_->remove(prefix)
           : record_->add(ObservedParticipant{
                 .prefix = prefix, .name = name, .host = announced_host(it.info)});
    }
    const std::lock_guard lock(mutex_);
    count(it.status == Info::DISCOVERED_PARTICIPANT, gone);
    if (gone) {
      hosts_.erase(guard::prefix_of(guid(it.info.m_guid)));
      named_.erase(it.info.m_guid);
      peers_.go(it.info.m_guid, now());
      others_.go(it.info.m_guid);
      return;
    }
    if (hosts_.size() < kMostHosts) {
      hosts_.insert_or_assign(guard::prefix_of(guid(it.info.m_guid)), announced_host(it.info));
    }
    if (Named* const known = entry_of(it.info.m_guid)) {
      known->name = name;
      known->lease = std::max(Duration::zero(), Duration(it.info.m_leaseDuration.to_ns()));
      count_name(it.info.m_guid, *known);
    }
  }

  // May be called before the discovery of the participant is reported.
  void onParticipantAuthentication(
      eprosima::fastdds::dds::DomainParticipant*,
      eprosima::fastrtps::rtps::ParticipantAuthenticationInfo&& it) override {
    using Info = eprosima::fastrtps::rtps::ParticipantAuthenticationInfo;
    if (record_ != nullptr) {
      record_->authenticated(guard::prefix_of(guid(it.guid)),
                             it.status == Info::AUTHORIZED_PARTICIPANT);
    }
    const std::lock_guard lock(mutex_);
    Named* const known = it.status == Info::AUTHORIZED_PARTICIPANT ? entry_of(it.guid) : nullptr;
    if (known != nullptr) {
      known->authenticated = true;
      count_name(it.guid, *known);
    }
  }

  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& it) override {
    using Info = eprosima::fastrtps::rtps::WriterDiscoveryInfo;
    const bool gone = it.status == Info::REMOVED_WRITER;
    endpoint(it.info.guid(), gone);
    record_endpoint(it.info, true, gone);
    if (!secured_)
      return;
    if (gone) {
      partitions_.forget(guid(it.info.guid()));
    } else if (is_request(it.info.topicName().to_string())) {
      partitions_.note(guid(it.info.guid()), it.info.m_qos.m_partition.names());
    }
  }
  void on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant*,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& it) override {
    using Info = eprosima::fastrtps::rtps::ReaderDiscoveryInfo;
    const bool gone = it.status == Info::REMOVED_READER;
    endpoint(it.info.guid(), gone);
    record_endpoint(it.info, false, gone);
  }

 private:
  struct Named {
    std::string name;  // empty until it is discovered
    Duration lease{};
    bool authenticated = false;
  };

  static constexpr std::size_t kMostHosts = 1024;  // bounded, as PeerGateways
  static constexpr std::size_t kLongestHost = 64;

  // Fast DDS announces "name:number"; other libraries may announce locators only.
  static std::string announced_host(const eprosima::fastrtps::rtps::ParticipantProxyData& it) {
    using eprosima::fastrtps::rtps::IPLocator;
    for (const auto& property : it.m_properties) {
      if (property.first() == eprosima::fastdds::dds::parameter_policy_physical_data_host) {
        const std::string host = property.second();
        return host.substr(0, std::min(host.find(':'), kLongestHost));
      }
    }
    for (const auto& locator : it.default_locators.unicast) {
      if (locator.kind == LOCATOR_KIND_UDPv4 || locator.kind == LOCATOR_KIND_TCPv4) {
        return IPLocator::toIPv4string(locator);
      }
    }
    return {};
  }

  // nullptr if there are kMostHosts others.
  Named* entry_of(const eprosima::fastrtps::rtps::GUID_t& it) {
    const auto known = named_.find(it);
    if (known != named_.end())
      return &known->second;
    return named_.size() < kMostHosts ? &named_[it] : nullptr;
  }
  void count_name(const eprosima::fastrtps::rtps::GUID_t& it, const Named& known) {
    if (known.name.empty() || (secured_ && !known.authenticated))
      return;
    peers_.come(it, known.name, now());
    if (known.name == name_)
      others_.come(it, now(), known.lease);
  }

  static bool is_request(const std::string& topic) {
    return topic == v1::TOPIC_OUTPUT_WRITE || topic == v1::TOPIC_COMMAND_REQUEST ||
           named::is_set_topic(topic);
  }

  static guard::Guid guid(const eprosima::fastrtps::rtps::GUID_t& it) {
    guard::Guid out{};
    std::copy_n(it.guidPrefix.value, 12, out.begin());
    std::copy_n(it.entityId.value, 4, out.begin() + 12);
    return out;
  }

  void endpoint(const eprosima::fastrtps::rtps::GUID_t& it, bool gone) {
    if (guard_ == nullptr)
      return;
    gone ? guard_->endpoint_lost(guid(it)) : guard_->endpoint_found(guid(it));
  }

  template <class Discovered>
  void record_endpoint(Discovered& it, bool writer, bool gone) {
    if (record_ == nullptr)
      return;
    if (gone)
      return record_->remove(guid(it.guid()));
    record_->add(ObservedEndpoint{
        .guid = guid(it.guid()),
        .writer = writer,
        .keyed = it.topicKind() == eprosima::fastrtps::rtps::WITH_KEY,
        .multicast = writer && std::ranges::equal(it.m_qos.m_userData.data_vec(), kFanOutMark),
        .topic = it.topicName().to_string(),
        .type = it.typeName().to_string(),
        .qos = observed_qos(it.m_qos),
    });
  }

  static Instant now() {
    return Instant(
        std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
  }

  void count(bool discovered, bool gone) {
    discovery_.discovered += discovered ? 1U : 0U;
    discovery_.gone += gone ? 1U : 0U;
    discovery_.participants = static_cast<std::size_t>(discovery_.discovered - discovery_.gone);
  }

  const std::string name_;
  std::shared_ptr<guard::Guard> guard_;
  std::shared_ptr<DiscoveryRecord> record_;
  mutable std::mutex mutex_;
  Namesakes<eprosima::fastrtps::rtps::GUID_t> others_;
  PeerGateways<eprosima::fastrtps::rtps::GUID_t> peers_{now()};
  DiscoveryCounters discovery_;
  std::map<guard::Prefix, std::string> hosts_;
  std::map<eprosima::fastrtps::rtps::GUID_t, Named> named_;
  bool secured_ = false;
  WriterPartitions partitions_;
};

}  // namespace linegate::dds
