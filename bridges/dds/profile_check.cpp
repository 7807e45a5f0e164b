// SPDX-License-Identifier: Apache-2.0
// Implements check_profiles(), see profiles.h.
#include <limits>
#include <string>

#include <fastrtps/attributes/ParticipantAttributes.h>
#include <fastrtps/attributes/PublisherAttributes.h>
#include <fastrtps/attributes/SubscriberAttributes.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <linegate.h>

#include "bridges/dds/profile_text.h"
#include "bridges/dds/profiles.h"
#include "bridges/dds/transport_check.h"
#include "bridges/dds/values.h"

namespace linegate::dds {
namespace {

namespace rtps = eprosima::fastrtps;
using Profiles = rtps::xmlparser::XMLProfileManager;

std::vector<std::string> topics_of_gateway() {
  return {v1::TOPIC_GATEWAY_STATE, v1::TOPIC_LINE_STATE,    v1::TOPIC_NODE_STATE,
          v1::TOPIC_OUTPUT_STATE,  v1::TOPIC_IMAGE_LAYOUT,  v1::TOPIC_PROCESS_IMAGE,
          v1::TOPIC_PDO_UPDATE,    v1::TOPIC_PDO_RECEPTION, v1::TOPIC_EVENT,
          v1::TOPIC_COMMAND_REPLY};
}

class Check {
 public:
  Check(const LoadedProfiles& profiles, std::vector<Diagnostic>& findings)
      : profiles_(profiles), findings_(findings) {}

  void participant() {
    rtps::ParticipantAttributes found;
    if (Profiles::fillParticipantAttributes(kParticipantProfile, found, false) !=
        rtps::xmlparser::XMLP_ret::XML_OK) {
      return missing("participant", kParticipantProfile);
    }
    transports(found.rtps);
  }

  void writer(const std::string& topic, bool of_gateway) {
    rtps::PublisherAttributes found;
    if (Profiles::fillPublisherAttributes(topic, found, false) !=
        rtps::xmlparser::XMLP_ret::XML_OK) {
      return missing("data_writer", topic);
    }
    limits("data_writer", topic, found.topic);
    if (of_gateway && found.qos.m_durability.kind == rtps::VOLATILE_DURABILITY_QOS &&
        found.qos.m_reliability.kind == rtps::RELIABLE_RELIABILITY_QOS) {
      add(Severity::warning, line_of_profile(profiles_.text, "data_writer", topic),
          "data_writer profile \"" + topic +
              "\" is RELIABLE and VOLATILE: Fast DDS 2.9 may deadlock when a reader leaves; "
              "make it TRANSIENT_LOCAL");
    }
  }

  void reader(const std::string& topic) {
    rtps::SubscriberAttributes found;
    if (Profiles::fillSubscriberAttributes(topic, found, false) !=
        rtps::xmlparser::XMLP_ret::XML_OK) {
      return missing("data_reader", topic);
    }
    limits("data_reader", topic, found.topic);
    if (found.qos.m_ownership.kind == rtps::EXCLUSIVE_OWNERSHIP_QOS &&
        found.topic.historyQos.kind == rtps::KEEP_LAST_HISTORY_QOS &&
        found.topic.historyQos.depth == 1) {
      add(Severity::warning, line_of_profile(profiles_.text, "data_reader", topic),
          "data_reader profile \"" + topic +
              "\" has EXCLUSIVE ownership and depth 1: in Fast DDS 2.9 samples of a weaker writer "
              "replace unread samples of the owner; set depth and max_samples_per_instance to 4, "
              "and max_samples to 4 x max_instances");
    }
    if (found.qos.m_lifespan.duration != rtps::c_TimeInfinite) {
      add(Severity::error, line_of_profile(profiles_.text, "data_reader", topic),
          "data_reader profile \"" + topic +
              "\" has a lifespan: source timestamps are not those of the sender (SECURITY.md), so "
              "new samples would expire; leave it out");
    }
  }

 private:
  // The library omits an unusable transport, and the participant continues without it.
  void transports(const rtps::rtps::RTPSParticipantAttributes& found) {
    const auto named = transports_of(profiles_.text, kParticipantProfile);
    if (found.userTransports.empty() && !found.useBuiltinTransports) {
      add(Severity::error, line_of_profile(profiles_.text, "participant", kParticipantProfile),
          "participant profile \"" + std::string(kParticipantProfile) +
              "\" has no transport: name one in userTransports, or set useBuiltinTransports to "
              "true");
    }
    for (std::size_t i = 0; i < found.userTransports.size(); ++i) {
      const std::string why = transport_problem(*found.userTransports[i]);
      if (why.empty())
        continue;
      const TransportText text = i < named.size() ? named[i] : TransportText{};
      add(Severity::error, text.line, "transport \"" + text.id + "\" is unusable: " + why);
    }
  }

  // The rules of Fast DDS (DataWriterImpl::check_qos_including_resource_limits). A value of 0 or
  // less means unlimited.
  void limits(const std::string& kind, const std::string& topic,
              const rtps::TopicAttributes& topic_qos) {
    const auto& limits = topic_qos.resourceLimitsQos;
    const auto& history = topic_qos.historyQos;
    const bool keep_last = history.kind == rtps::KEEP_LAST_HISTORY_QOS;
    const std::int64_t product =
        std::int64_t{limits.max_instances} * std::int64_t{limits.max_samples_per_instance};
    std::string why;
    if (keep_last && history.depth <= 0) {
      why = "its depth is not positive";
    } else if (keep_last && limits.max_samples_per_instance > 0 &&
               history.depth > limits.max_samples_per_instance) {
      why = "its depth is above max_samples_per_instance";
    } else if (limits.max_samples > 0 && limits.max_instances > 0 &&
               limits.max_samples_per_instance > 0 && limits.max_samples < product) {
      why = "max_samples is below max_instances x max_samples_per_instance";
    } else if (limits.max_samples > 0 && limits.allocated_samples > limits.max_samples) {
      why = "allocated_samples is above max_samples";
    }
    if (!why.empty()) {
      add(Severity::error, line_of_profile(profiles_.text, kind, topic),
          kind + " profile \"" + topic + "\" is contradictory: " + why);
    }
  }

  void missing(const std::string& kind, const std::string& name) {
    add(Severity::error, 0, "there is no " + kind + " profile \"" + name + "\"");
  }

  void add(Severity severity, std::uint32_t line, std::string text) {
    findings_.push_back({severity, profiles_.origin, line, 0, std::move(text)});
  }

  const LoadedProfiles& profiles_;
  std::vector<Diagnostic>& findings_;
};

}  // namespace

std::vector<Diagnostic> check_profiles(const std::string& file) {
  std::vector<Diagnostic> findings;
  const auto profiles = load_profiles(file, findings);
  if (!profiles)
    return findings;
  Check check(*profiles, findings);
  check.participant();
  for (const std::string& topic : topics_of_gateway()) {
    check.writer(topic, true);
    check.reader(topic);
  }
  for (const std::string& topic : {v1::TOPIC_OUTPUT_WRITE, v1::TOPIC_COMMAND_REQUEST}) {
    check.writer(topic, false);
    check.reader(topic);
  }
  return findings;
}

std::size_t participants_of_profile(const std::string& file) {
  std::vector<Diagnostic> ignored;
  rtps::ParticipantAttributes found;
  if (!load_profiles(file, ignored) ||
      Profiles::fillParticipantAttributes(kParticipantProfile, found, false) !=
          rtps::xmlparser::XMLP_ret::XML_OK) {
    return kMostParticipants;
  }
  const std::size_t most = found.rtps.allocation.participants.maximum;  // includes the own one
  return most == 0 || most == std::numeric_limits<std::size_t>::max() ? kMostParticipants
                                                                      : most - 1;
}

}  // namespace linegate::dds
