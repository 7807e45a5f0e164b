// SPDX-License-Identifier: Apache-2.0
// A participant with its writers and readers, which it owns. Each has the QoS of its profile.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "bridges/dds/guard/guard.h"
#include "bridges/dds/guard/stall.h"
#include "bridges/dds/guard/stalled_connections.h"
#include "bridges/dds/guard/timer_watch.h"
#include "bridges/dds/name_watch.h"
#include "bridges/dds/network_choice.h"
#include "bridges/dds/reader_watch.h"
#include "bridges/dds/received_type.h"
#include "bridges/dds/security.h"
#include "bridges/dds/written_type.h"
#include "stack/base/diagnostic.h"
#include "stack/base/time.h"

namespace linegate::dds {

class Endpoints {
 public:
  // Loads the profiles (see load_profiles) and creates the participant. On failure ok() is false
  // and a diagnostic states the reason. guarded: a guard checks received datagrams
  // (bridges/dds/guard). participants: the number of other participants that are accepted at the
  // same time; 0: the number in the profile, or kMostParticipants. security: its files, and the
  // partition of the readers that reader() makes if request_partition is not empty. record: if not
  // nullptr, receives what is discovered. network: beside the profile.
  Endpoints(const std::string& name, std::uint32_t domain, const std::string& profile_file,
            std::vector<Diagnostic>& diagnostics, bool guarded = true, std::size_t participants = 0,
            const Security& security = {}, std::shared_ptr<DiscoveryRecord> record = nullptr,
            NetworkChoice network = {});
  ~Endpoints();
  Endpoints(const Endpoints&) = delete;
  Endpoints& operator=(const Endpoints&) = delete;

  // False once anything could not be created.
  bool ok() const { return ok_; }

  // From now on writer() and reader() use the default partition and `partition`, which may have
  // wildcards. Call it before the first of them.
  void join(const std::string& partition);

  // From now on reader() uses these partitions alone. Call it before the first of them.
  void read_in(const std::vector<std::string>& partitions);

  // Afterwards nullptr alone reports a failure, and the diagnostics may be destroyed. No more
  // topics are created, and any thread may create writers and readers.
  void seal() { diagnostics_ = nullptr; }

  // Number of other participants in the domain with the same name, see namesakes.h. From any
  // thread.
  std::size_t namesakes() const { return names_.namesakes(); }
  // The other gateways in the domain. From any thread.
  Peers peers() const { return names_.peers(); }
  // Counts the other participants in the domain. From any thread.
  DiscoveryCounters discovery() const { return names_.discovery(); }
  // See NameWatch::host_of(). From any thread.
  std::string host_of(const guard::Prefix& participant) const {
    return names_.host_of(participant);
  }

  // The partitions of a writer of requests, see NameWatch::partitions_of(). From any thread.
  std::optional<std::vector<std::string>> partitions_of(const guard::Guid& writer) const {
    return names_.partitions_of(writer);
  }

  // The number of datagrams that the guard received and dropped; zeros without a guard. From any
  // thread.
  guard::Counters guard_counters() const {
    return guard_ == nullptr ? guard::Counters{} : guard_->counters();
  }

  // From now on longest_stall() includes the timers of the library.
  void watch_timers() { timers_.emplace(*participant_); }
  // The time that the library has spent on the oldest datagram that it processes now (none without
  // a guard), or by which its timers are late, whichever is longer. From any thread.
  guard::Stall longest_stall() const {
    const std::int64_t now = Duration{std::chrono::steady_clock::now().time_since_epoch()}.count();
    guard::Stall call;
    if (guard_ != nullptr)
      call = {Duration{guard_->calls().longest(now)}, guard_->calls().thread_of_longest(now)};
    guard::Stall timer = timers_ ? timers_->stall() : guard::Stall{};
    if (guard_ != nullptr)  // the timers may need a lock of a long call
      timer.time = std::min(timer.time, Duration{guard_->calls().overdue(now)});
    return timer.time > call.time ? timer : call;
  }

  // Limits how long TCP connections may stall. Call it about every second, from one thread that
  // does not write.
  void limit_stalls() {
    if (stalls_)
      stalls_->advance(std::chrono::steady_clock::now().time_since_epoch());
  }

  // Number of received samples that could not be deserialized, since the last call.
  std::uint64_t pop_unreadable() { return unreadable_->take(); }
  // For the types of own topics.
  const std::shared_ptr<UnreadableCount>& unreadable() const { return unreadable_; }

  // No thread may write meanwhile. Samples that a reader has not received yet are lost.
  void remove(eprosima::fastdds::dds::DataWriter* writer);
  // After its last writer was removed. As writer_in(): one thread at a time.
  void remove_partition(const std::string& partition);
  // From any thread.
  void remove(eprosima::fastdds::dds::DataReader* reader);

  // Returns nullptr on failure, with a diagnostic. strength: ownership strength, used if the
  // profile selects EXCLUSIVE. lifetime: if not 0, samples are removed after it, acknowledged or
  // not, and the writer is not volatile.
  template <class PubSubType>
  eprosima::fastdds::dds::DataWriter* writer(const std::string& topic, std::uint32_t strength = 0,
                                             Duration lifetime = {}) {
    return make_writer(topic, eprosima::fastdds::dds::TypeSupport(new WrittenType<PubSubType>()),
                       strength, publisher_, lifetime);
  }
  // The same in a partition. One thread at a time may call it; also after seal(), if a writer of
  // the topic was created before or the topic was made by add_topic().
  template <class PubSubType>
  eprosima::fastdds::dds::DataWriter* writer_in(const std::string& partition,
                                                const std::string& topic,
                                                std::uint32_t strength = 0,
                                                Duration lifetime = {}) {
    return make_writer(topic, eprosima::fastdds::dds::TypeSupport(new WrittenType<PubSubType>()),
                       strength, publisher_in(partition), lifetime);
  }
  // The same in the default partition and another one; in those of writer() if it is empty. As
  // writer_in(): one thread at a time.
  template <class PubSubType>
  eprosima::fastdds::dds::DataWriter* writer_beside(const std::string& partition,
                                                    const std::string& topic) {
    return partition.empty()
               ? writer<PubSubType>(topic)
               : make_writer(topic,
                             eprosima::fastdds::dds::TypeSupport(new WrittenType<PubSubType>()), 0,
                             publisher_in(partition, true));
  }
  // Creates a topic whose writers are created later.
  template <class PubSubType>
  void add_topic(const std::string& topic) {
    make_topic(topic, eprosima::fastdds::dds::TypeSupport(new WrittenType<PubSubType>()));
  }
  // The same for a topic that has readers, too: reader() protects them from malformed samples only
  // if this is called before the first writer.
  template <class PubSubType>
  void add_received_topic(const std::string& topic) {
    make_topic(topic,
               eprosima::fastdds::dds::TypeSupport(new ReceivedType<PubSubType>(unreadable_)));
  }
  // Topics with types that are made at run time; they may come and go at any time. Any thread may
  // call these. described: describe_type() was called for the name of the type. nullptr on failure.
  eprosima::fastdds::dds::Topic* add_own_topic(const std::string& topic,
                                               eprosima::fastdds::dds::TypeSupport type,
                                               bool described = false);
  // After its last writer was removed.
  void remove_own_topic(eprosima::fastdds::dds::Topic* topic);
  // profile: of the data reader, which has the partition of reader().
  eprosima::fastdds::dds::DataReader* reader_of(eprosima::fastdds::dds::Topic* topic,
                                                const std::string& profile);
  // profile: of the data writer. partition: see writer_beside(); one thread at a time may call it.
  // readers must outlive this object.
  eprosima::fastdds::dds::DataWriter* writer_of(eprosima::fastdds::dds::Topic* topic,
                                                const std::string& profile,
                                                const std::string& partition, ReaderWatch* readers);
  template <class PubSubType>
  eprosima::fastdds::dds::DataReader* reader(const std::string& topic) {
    auto* type = new ReceivedType<PubSubType>(unreadable_);
    return make_reader(topic, eprosima::fastdds::dds::TypeSupport(type), subscriber_);
  }
  // The same in a partition, which may have wildcards, instead of that of all readers; empty: the
  // default one.
  template <class PubSubType>
  eprosima::fastdds::dds::DataReader* reader_in(const std::string& partition,
                                                const std::string& topic) {
    auto* type = new ReceivedType<PubSubType>(unreadable_);
    return make_reader(topic, eprosima::fastdds::dds::TypeSupport(type), subscriber_in(partition));
  }

 private:
  void create_participant(const std::string& name, std::uint32_t domain, bool guarded);
  void bound_discovery(eprosima::fastdds::dds::DomainParticipantQos& qos);
  eprosima::fastdds::dds::DataWriter* make_writer(const std::string& topic,
                                                  eprosima::fastdds::dds::TypeSupport type,
                                                  std::uint32_t strength,
                                                  eprosima::fastdds::dds::Publisher* publisher,
                                                  Duration lifetime = {});
  eprosima::fastdds::dds::Publisher* publisher_in(const std::string& partition,
                                                  bool and_default = false);
  // The reason for an endpoint that could not be created.
  std::string refusal(std::string_view kind, const std::string& topic) const;
  eprosima::fastdds::dds::Subscriber* subscriber_in(const std::string& partition);
  eprosima::fastdds::dds::DataReader* make_reader(const std::string& topic,
                                                  eprosima::fastdds::dds::TypeSupport type,
                                                  eprosima::fastdds::dds::Subscriber* subscriber);
  // Announces the group of process images beside the locators of other readers.
  void ask_for_multicast(eprosima::fastdds::dds::Subscriber& subscriber,
                         eprosima::fastdds::dds::Topic& topic,
                         eprosima::fastdds::dds::DataReaderQos& qos);
  // The reason for which images cannot be sent by multicast; empty if they can, or need not.
  std::string multicast_problem(bool guarded) const;
  eprosima::fastdds::dds::Topic* make_topic(const std::string& topic,
                                            eprosima::fastdds::dds::TypeSupport type);
  void fail(std::string text);

  std::vector<Diagnostic>* diagnostics_;  // nullptr after seal()
  std::shared_ptr<UnreadableCount> unreadable_ = std::make_shared<UnreadableCount>();
  std::shared_ptr<guard::Guard> guard_;       // nullptr: disabled
  std::optional<guard::StallLimits> stalls_;  // nullopt: no TCP, or no guard
  NameWatch names_;                           // outlives the participant, whose listener it is
  std::string origin_;                        // file of the profiles, for diagnostics
  std::size_t participants_;
  std::uint32_t domain_ = 0;
  const Security security_;
  const NetworkChoice network_;
  bool ok_ = true;
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  std::optional<guard::TimerWatch> timers_;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
  std::map<std::string, eprosima::fastdds::dds::Publisher*> publishers_;  // by partition
  std::map<std::string, eprosima::fastdds::dds::Topic*> topics_;
};

}  // namespace linegate::dds
