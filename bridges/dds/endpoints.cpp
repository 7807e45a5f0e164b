// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/endpoints.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <linegate.h>

#include "bridges/dds/fan_out.h"
#include "bridges/dds/guard/instance_states.h"
#include "bridges/dds/guard/key_warnings.h"
#include "bridges/dds/guard/message_room.h"
#include "bridges/dds/guard/sent_tokens.h"
#include "bridges/dds/guard/transport.h"
#include "bridges/dds/network_qos.h"
#include "bridges/dds/profiles.h"
#include "bridges/dds/security_properties.h"

namespace linegate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;

// DDSI-RTPS 9.6.1.1: greater domain numbers have no ports
constexpr std::uint32_t kMaxDomain = 232;
// Of images: by unicast at most, and by multicast.
const eprosima::fastrtps::Duration_t kHeartbeat{0, 50'000'000};
const eprosima::fastrtps::Duration_t kMulticastHeartbeat{0, 100'000'000};

// According to the library settings of the profiles; enabled by default.
bool delivers_within_process() {
  using Profiles = eprosima::fastrtps::xmlparser::XMLProfileManager;
  return Profiles::library_settings().intraprocess_delivery != eprosima::fastrtps::INTRAPROCESS_OFF;
}

// Must be called before a writer is deleted. When Fast DDS 2.9 deletes a writer, it releases the
// samples in its history without holding its lock, while another thread may be sending a heartbeat
// of that writer. That thread then reads sequence number 0 and declares all numbers from there to
// the end of the range as missing (RTPSWriter::deinit,
// StatefulWriter::add_gaps_for_holes_in_history_; pull request 4076 of Fast DDS), and the thread
// that deletes the writer blocks forever. Clearing the history holds the lock.
void clear(fast::DataWriter& writer) {
  std::size_t dropped = 0;
  writer.clear_history(&dropped);
}

// Each image replaces the one before, so its readers need not acknowledge it. By default Fast DDS
// adds a heartbeat to each sample, to which each reader responds, and starts a timer for each
// reader that ignores repeated requests for a sample that was just sent; it ends at once. While the
// timer runs, it is not started again.
// With multicast the responses of all readers to a heartbeat are most of the cost.
void spare_acknowledgements(fast::DataWriterQos& qos, bool multicast) {
  auto& reliable = qos.reliable_writer_qos();
  // A reader that lost a datagram waits for the next heartbeat, whatever the profile has.
  reliable.times.heartbeatPeriod =
      multicast ? kMulticastHeartbeat : std::min(reliable.times.heartbeatPeriod, kHeartbeat);
  reliable.disable_heartbeat_piggyback = true;
  reliable.times.nackSupressionDuration = reliable.times.heartbeatPeriod;
}

void clear_writers(const fast::Publisher& publisher) {
  std::vector<fast::DataWriter*> writers;
  publisher.get_datawriters(writers);
  for (fast::DataWriter* writer : writers)
    clear(*writer);
}

}  // namespace

Endpoints::Endpoints(const std::string& name, std::uint32_t domain, const std::string& profile_file,
                     std::vector<Diagnostic>& diagnostics, bool guarded, std::size_t participants,
                     const Security& security, std::shared_ptr<DiscoveryRecord> record,
                     NetworkChoice network)
    : diagnostics_(&diagnostics),
      names_(name),
      participants_(participants),
      security_(security),
      network_(std::move(network)) {
  names_.record(std::move(record));
  const auto profiles = load_profiles(profile_file, diagnostics);
  if (!profiles) {
    ok_ = false;
    return;
  }
  origin_ = profiles->origin;
  create_participant(name, domain, guarded);
}

void Endpoints::create_participant(const std::string& name, std::uint32_t domain, bool guarded) {
  if (domain > kMaxDomain)
    return fail("DDS domain " + std::to_string(domain) + " is above 232");
  auto* factory = fast::DomainParticipantFactory::get_instance();
  fast::DomainParticipantQos qos;
  if (factory->get_participant_qos_from_profile(kParticipantProfile, qos) !=
      ReturnCode_t::RETCODE_OK) {
    return fail("there is no participant profile \"" + std::string(kParticipantProfile) + "\"");
  }
  domain_ = domain;
  qos.name(name);
  if (std::string reason = multicast_problem(guarded); !reason.empty())
    return fail(std::move(reason));
  if (std::string reason = apply(network_, qos); !reason.empty())
    return fail(std::move(reason));
  if (std::string reason = apply_environment(network_, security_.enabled(), qos); !reason.empty())
    return fail(std::move(reason));
  // Two readers that announce a unicast locator and the same multicast locator abort the process of
  // a writer of Fast DDS 2.9 (assertion in OutputTrafficManager.hpp:87). Without multicast locators
  // two readers share no locator. The library's default is 1, if the profile does not set it. With
  // 1 the guard leaves no endpoint both (guard/announced_locators.h).
  qos.allocation().locators.max_multicast_locators = network_.multicast_images ? 1 : 0;
  bound_discovery(qos);
  if (security_.enabled()) {
    add_properties(security_, qos);
    names_.expect_authentication();
  }
  if (!guard::watch_instance_states())
    return fail("the states of instances in this Fast DDS cannot be checked: linegate needs 2.9.1");
  if (guard::requires_protection(qos) && !guard::make_room_for_protection())
    return fail("this Fast DDS cannot be made to encrypt full messages: linegate needs 2.9.1");
  if (security_.enabled() && !guard::drop_sent_tokens())
    return fail("this Fast DDS cannot be made to drop sent keys: linegate needs 2.9.1");
  if (security_.enabled())
    guard::leave_out_key_warnings();  // else each costs time, but no more
  if (guarded) {
    guard_ = std::make_shared<guard::Guard>(guard::requires_protection(qos),
                                            guard::discovery_limits(qos));
    if (security_.accepts_certificate)
      guard_->watch_certificates(security_.accepts_certificate);
    if (network_.multicast_images)
      guard_->confine_multicast(image_group(domain));
    names_.inform(guard_);
    if (guard::has_tcp(qos))
      stalls_.emplace();
    guard::wrap_transports(qos, guard_);
  }
  participant_ = factory->create_participant(domain, qos, &names_, fast::StatusMask::none());
  if (participant_ == nullptr) {
    return fail("no DDS participant in domain " + std::to_string(domain) + ": " +
                (security_.enabled()
                     ? "the network, the participant profile or the identity " +
                           security_.certificate + " does not allow it (linegate security check)"
                     : "the network or the participant profile does not allow it"));
  }
  if (guard_ != nullptr && delivers_within_process()) {
    guard::Prefix prefix{};
    std::copy_n(participant_->guid().guidPrefix.value, prefix.size(), prefix.begin());
    guard_->set_process_of(prefix);
  }
  publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  fast::SubscriberQos readers = fast::SUBSCRIBER_QOS_DEFAULT;
  if (!security_.request_partition.empty())
    readers.partition().push_back(security_.request_partition.c_str());
  subscriber_ = participant_->create_subscriber(readers);
  if (publisher_ == nullptr || subscriber_ == nullptr)
    fail("no DDS publisher and subscriber");
}

// Any host on the network can forge participants and endpoints. Fast DDS ignores those beyond its
// allocation and accepts them when others have left; existing matches remain.
void Endpoints::bound_discovery(fast::DomainParticipantQos& qos) {
  auto& participants = qos.allocation().participants;  // all participants, including this one
  if (participants_ != 0) {
    participants.maximum = participants_ + 1;
  } else if (participants.maximum == std::numeric_limits<std::size_t>::max()) {
    participants.maximum = kMostParticipants + 1;
  }
  participants.initial = std::min(participants.initial, participants.maximum);
  for (auto* endpoints : {&qos.allocation().readers, &qos.allocation().writers}) {
    if (endpoints->maximum == std::numeric_limits<std::size_t>::max())
      endpoints->maximum = kMostEndpoints;
  }
  names_.set_most(participants.maximum - 1);
}

Endpoints::~Endpoints() {
  if (participant_ == nullptr)
    return;
  timers_.reset();
  if (publisher_ != nullptr)
    clear_writers(*publisher_);
  for (const auto& [partition, publisher] : publishers_)
    clear_writers(*publisher);
  participant_->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

void Endpoints::remove(fast::DataWriter* writer) {
  clear(*writer);
  // The library returns its own publisher as const.
  const_cast<fast::Publisher*>(writer->get_publisher())->delete_datawriter(writer);
}

// A reader in a partition has a subscriber of its own.
void Endpoints::remove(fast::DataReader* reader) {
  // The library returns its own subscriber as const.
  auto* const subscriber = const_cast<fast::Subscriber*>(reader->get_subscriber());
  subscriber->delete_datareader(reader);
  if (subscriber != subscriber_)
    participant_->delete_subscriber(subscriber);
}

void Endpoints::remove_partition(const std::string& partition) {
  const auto found = publishers_.find(partition);
  if (found == publishers_.end())
    return;
  participant_->delete_publisher(found->second);
  publishers_.erase(found);
}

void Endpoints::fail(std::string text) {
  if (diagnostics_ == nullptr)
    return;
  ok_ = false;
  diagnostics_->push_back(Diagnostic{Severity::error, origin_, 0, 0, std::move(text)});
}

fast::Topic* Endpoints::make_topic(const std::string& topic, fast::TypeSupport type) {
  if (!ok_)
    return nullptr;
  const auto known = topics_.find(topic);  // read only: two threads may call this after seal()
  if (known != topics_.end())
    return known->second;
  // Cyclone DDS rejects the TypeInformation of Fast DDS as malformed and ignores the endpoint.
  type->auto_fill_type_information(false);
  type->auto_fill_type_object(false);
  fast::Topic* made = nullptr;
  if (type.register_type(participant_) == ReturnCode_t::RETCODE_OK) {
    made = participant_->create_topic(topic, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  }
  if (made == nullptr) {
    fail("topic " + topic + " could not be created");
  } else {
    topics_[topic] = made;
  }
  return made;
}

fast::Topic* Endpoints::add_own_topic(const std::string& topic, fast::TypeSupport type,
                                      bool described) {
  if (!ok_)
    return nullptr;
  type->auto_fill_type_information(false);  // see make_topic()
  type->auto_fill_type_object(described);
  if (type.register_type(participant_) != ReturnCode_t::RETCODE_OK)
    return nullptr;
  return participant_->create_topic(topic, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
}

void Endpoints::remove_own_topic(fast::Topic* topic) {
  const std::string type = topic->get_type_name();
  if (participant_->delete_topic(topic) == ReturnCode_t::RETCODE_OK)
    participant_->unregister_type(type);
}

fast::DataReader* Endpoints::reader_of(fast::Topic* topic, const std::string& profile) {
  fast::DataReaderQos qos;
  if (subscriber_->get_datareader_qos_from_profile(profile, qos) != ReturnCode_t::RETCODE_OK)
    return nullptr;
  return subscriber_->create_datareader(topic, qos);
}

fast::DataWriter* Endpoints::writer_of(fast::Topic* topic, const std::string& profile,
                                       const std::string& partition, ReaderWatch* readers) {
  fast::Publisher* const publisher = partition.empty() ? publisher_ : publisher_in(partition, true);
  fast::DataWriterQos qos;
  if (publisher == nullptr ||
      publisher_->get_datawriter_qos_from_profile(profile, qos) != ReturnCode_t::RETCODE_OK)
    return nullptr;
  return publisher->create_datawriter(topic, qos, readers, ReaderWatch::statuses());
}

fast::DataWriter* Endpoints::make_writer(const std::string& topic, fast::TypeSupport type,
                                         std::uint32_t strength, fast::Publisher* publisher,
                                         Duration lifetime) {
  fast::Topic* made = make_topic(topic, std::move(type));
  if (made == nullptr || publisher == nullptr)
    return nullptr;
  fast::DataWriterQos qos;
  if (publisher_->get_datawriter_qos_from_profile(topic, qos) != ReturnCode_t::RETCODE_OK) {
    fail("there is no data_writer profile \"" + topic + "\"");
    return nullptr;
  }
  if (topic == v1::TOPIC_PROCESS_IMAGE)
    spare_acknowledgements(qos, network_.multicast_images);
  if (topic == v1::TOPIC_PROCESS_IMAGE && network_.multicast_images)
    qos.user_data().data_vec({kFanOutMark.begin(), kFanOutMark.end()});
  if (qos.ownership().kind == fast::EXCLUSIVE_OWNERSHIP_QOS && strength != 0) {
    qos.ownership_strength().value = strength;
  }
  if (lifetime > Duration::zero()) {
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(lifetime);
    qos.lifespan().duration = {static_cast<std::int32_t>(whole.count()),
                               static_cast<std::uint32_t>((lifetime - whole).count())};
    qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = qos.resource_limits().max_samples_per_instance;
  }
  fast::DataWriter* writer = publisher->create_datawriter(made, qos);
  if (writer == nullptr)
    fail(refusal("data_writer", topic));
  return writer;
}

// The name of the default partition is empty (DDS 1.4 2.2.3.13).
void Endpoints::join(const std::string& partition) {
  if (!ok_)
    return;
  fast::PublisherQos publisher = publisher_->get_qos();
  fast::SubscriberQos subscriber = subscriber_->get_qos();
  for (const char* name : {"", partition.c_str()}) {
    publisher.partition().push_back(name);
    subscriber.partition().push_back(name);
  }
  if (publisher_->set_qos(publisher) != ReturnCode_t::RETCODE_OK ||
      subscriber_->set_qos(subscriber) != ReturnCode_t::RETCODE_OK)
    fail("the partition " + partition + " cannot be used");
}

void Endpoints::read_in(const std::vector<std::string>& partitions) {
  if (!ok_)
    return;
  fast::SubscriberQos subscriber = subscriber_->get_qos();
  subscriber.partition().clear();
  for (const std::string& partition : partitions)
    subscriber.partition().push_back(partition.c_str());
  if (subscriber_->set_qos(subscriber) != ReturnCode_t::RETCODE_OK)
    fail("the partitions of the lines cannot be used");
}

fast::Publisher* Endpoints::publisher_in(const std::string& partition, bool and_default) {
  if (!ok_)
    return nullptr;
  fast::Publisher*& known = publishers_[partition];
  if (known == nullptr) {
    fast::PublisherQos qos = fast::PUBLISHER_QOS_DEFAULT;
    if (and_default)
      qos.partition().push_back("");
    qos.partition().push_back(partition.c_str());
    known = participant_->create_publisher(qos);
  }
  return known;
}

std::string Endpoints::refusal(std::string_view kind, const std::string& topic) const {
  const std::string profile = std::string(kind) + " profile \"" + topic + "\" is contradictory";
  if (!security_.enabled())
    return profile;
  return "the role of the certificate " + security_.certificate + " does not permit a " +
         std::string(kind == "data_writer" ? "writer" : "reader") + " of " + topic + ", or " +
         profile;
}

fast::Subscriber* Endpoints::subscriber_in(const std::string& partition) {
  if (!ok_)
    return nullptr;
  fast::SubscriberQos qos = fast::SUBSCRIBER_QOS_DEFAULT;
  if (!partition.empty())
    qos.partition().push_back(partition.c_str());
  return participant_->create_subscriber(qos);
}

fast::DataReader* Endpoints::make_reader(const std::string& topic, fast::TypeSupport type,
                                         fast::Subscriber* subscriber) {
  fast::Topic* made = make_topic(topic, std::move(type));
  if (made == nullptr || subscriber == nullptr)
    return nullptr;
  fast::DataReaderQos qos;
  if (subscriber_->get_datareader_qos_from_profile(topic, qos) != ReturnCode_t::RETCODE_OK) {
    fail("there is no data_reader profile \"" + topic + "\"");
    return nullptr;
  }
  if (network_.multicast_images && topic == v1::TOPIC_PROCESS_IMAGE)
    ask_for_multicast(*subscriber, *made, qos);
  fast::DataReader* reader = subscriber->create_datareader(made, qos);
  if (reader == nullptr)
    fail(refusal("data_reader", topic));
  return reader;
}

// A reader with a multicast locator of its own has no unicast locators if it does not name them,
// and a writer without multicast then sends it nothing. Fast DDS gives the locators of a
// participant only with those of a reader.
void Endpoints::ask_for_multicast(fast::Subscriber& subscriber, fast::Topic& topic,
                                  fast::DataReaderQos& qos) {
  fast::DataReader* const usual = subscriber.create_datareader(&topic, qos);
  if (usual == nullptr)
    return;
  eprosima::fastdds::rtps::LocatorList listening;
  usual->get_listening_locators(listening);
  subscriber.delete_datareader(usual);
  for (const eprosima::fastrtps::rtps::Locator_t& locator : listening) {
    if (!eprosima::fastrtps::rtps::IPLocator::isMulticast(locator))
      qos.endpoint().unicast_locator_list.push_back(locator);
  }
  qos.endpoint().multicast_locator_list.push_back(locator_of(image_group(domain_)));
}

std::string Endpoints::multicast_problem(bool guarded) const {
  if (!network_.multicast_images)
    return {};
  if (!guarded)
    return "images by multicast need the guard: announced locators could end this process";
  return security_.enabled()
             ? "images by multicast are not possible with DDS-Security: the guard cannot check "
               "encrypted announcements"
             : "";
}

}  // namespace linegate::dds
