// Which other participants of the domain have the name of this one, and which are gateways: Fast
// DDS reports participants to a listener only.
#pragma once

#include <algorithm>
#include <chrono>
#include <mutex>
#include <string>
#include <utility>

#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>

#include "bridges/dds/namesakes.h"
#include "bridges/dds/peer_gateways.h"
#include "bridges/dds/values.h"

namespace linegate::dds {

class NameWatch : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  explicit NameWatch(std::string name) : name_(std::move(name)) {}

  // From any thread.
  std::size_t namesakes() const {
    const std::lock_guard lock(mutex_);
    return others_.count(now());
  }
  Peers peers() const {
    const std::lock_guard lock(mutex_);
    return {.gateways = peers_.names(), .unchanged = now() - peers_.changed()};
  }

  // From threads of Fast DDS: they only note it.
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& it) override {
    using Info = eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
    const bool gone =
        it.status == Info::REMOVED_PARTICIPANT || it.status == Info::DROPPED_PARTICIPANT;
    const std::string name = it.info.m_participantName.to_string();
    const std::lock_guard lock(mutex_);
    if (gone) {
      peers_.go(it.info.m_guid, now());
    } else {
      peers_.come(it.info.m_guid, name, now());
    }
    if (name != name_)
      return;
    if (gone) {
      others_.go(it.info.m_guid);
    } else {
      const Duration lease(it.info.m_leaseDuration.to_ns());
      others_.come(it.info.m_guid, now(), std::max(Duration::zero(), lease));
    }
  }

 private:
  static Instant now() {
    return Instant(
        std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
  }

  const std::string name_;
  mutable std::mutex mutex_;
  Namesakes<eprosima::fastrtps::rtps::GUID_t> others_;
  PeerGateways<eprosima::fastrtps::rtps::GUID_t> peers_{now()};
};

}  // namespace linegate::dds
