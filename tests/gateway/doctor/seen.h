// SPDX-License-Identifier: Apache-2.0
// Observations of a sound plant: gateway hall on another host, and this host.
#pragma once

#include <string>

#include "gateway/doctor/observations.h"

namespace linegate::doctor {

inline constexpr std::uint8_t kHall = 1;  // first octet of its GUIDs
inline constexpr std::uint8_t kViewer = 2;

inline Heard heard(const std::string& name, std::uint8_t id, std::uint32_t domain = 7) {
  Heard out;
  out.announcement.prefix[0] = id;
  out.announcement.name = name;
  out.announcement.unicast = {{"10.0.0.1", 9160}};
  out.domain = domain;
  out.from = "10.0.0.1";
  out.count = 5;
  out.last = std::chrono::milliseconds(4'500);
  return out;
}

inline dds::ObservedEndpoint endpoint(std::uint8_t participant, bool writer,
                                      const std::string& topic) {
  dds::ObservedEndpoint out;
  out.guid[0] = participant;
  out.writer = writer;
  out.topic = topic;
  out.type = "linegate::v1::" + topic.substr(topic.rfind('/') + 1);
  out.qos.reliable = true;
  out.qos.durability = dds::ObservedDurability::transient_local;
  out.own = participant == 0;
  return out;
}

inline Observations sound_plant() {
  Observations out;
  out.domain = 7;
  out.profile = "profiles.xml";
  out.network.uses_udp = true;
  out.interfaces = {
      {.name = "lo", .up = true, .running = true, .loopback = true, .addresses = {"127.0.0.1"}},
      {.name = "eth0",
       .up = true,
       .running = true,
       .multicast = true,
       .addresses = {"10.0.0.2"},
       .multicast_tested = true,
       .multicast_received = true}};
  out.watched = std::chrono::seconds(5);
  out.heard = {heard("linegate hall", kHall)};
  dds::ObservedParticipant hall;
  hall.prefix[0] = kHall;
  hall.name = "linegate hall";
  dds::ObservedParticipant viewer;
  viewer.prefix[0] = kViewer;
  viewer.name = "viewer";
  viewer.host = "desk";
  out.participants = {hall, viewer};
  out.endpoints = {endpoint(kHall, true, "linegate/v1/LineState"),
                   endpoint(0, false, "linegate/v1/LineState")};
  out.received = {
      {.name = "hall", .samples = 5, .participants = 1, .participants_most = 100, .lines = 1}};
  return out;
}

// No gateway is seen.
inline Observations silent_plant() {
  Observations out = sound_plant();
  out.heard.clear();
  out.participants.clear();
  out.endpoints = {endpoint(0, false, "linegate/v1/LineState")};
  out.received.clear();
  return out;
}

// The announcements of the gateway arrive, and nothing else.
inline Observations deaf_plant() {
  Observations out = silent_plant();
  out.heard = {heard("linegate hall", kHall)};
  return out;
}

}  // namespace linegate::doctor
