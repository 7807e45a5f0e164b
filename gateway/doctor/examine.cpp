// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/examine.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>
#include <memory>
#include <thread>
#include <utility>

#include "bridges/dds/client.h"
#include "bridges/dds/network_profile.h"
#include "bridges/dds/profiles.h"
#include "gateway/client/identity.h"
#include "gateway/doctor/facts.h"
#include "gateway/doctor/listener.h"
#include "gateway/doctor/network.h"
#include "gateway/doctor/prober.h"

namespace linegate::doctor {
namespace {

constexpr Duration kRound = std::chrono::milliseconds(20);
constexpr std::size_t kMostGateways = 1024;

// Of a foreign time, which may be any number.
Duration difference(Instant time, Instant now) {
  constexpr Instant kEnd{std::chrono::hours(24 * 365 * 200)};
  return std::clamp(time, Instant{}, kEnd) - now;
}

Instant clock_time() {
  return Instant(
      std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()));
}

// Records the gateways whose states arrive.
class Received final : public dds::ClientListener {
 public:
  void on_gateway(const dds::Source& source, const dds::GatewayInfo& info) override {
    if (gateways_.size() >= kMostGateways && !gateways_.contains(source.gateway))
      return;
    ReceivedGateway& it = entry(source.gateway);
    ++it.samples;
    it.clock_difference = difference(source.time, clock_time());
    it.participants = info.participants;
    it.participants_most = info.participants_most;
    it.lines = info.lines.size();
  }
  void on_line(const dds::Source& source, const dds::LineInfo&, const line::LineState&,
               const std::vector<dds::Property>&) override {
    if (gateways_.size() < kMostGateways)
      (void)entry(source.gateway);
  }
  void on_layout(const dds::Source& source, const image::Layout& layout) override {
    if (gateways_.size() < kMostGateways && !layout.entries.empty())
      ++entry(source.gateway).layouts;
  }
  void on_image(const dds::Source& source, const image::Snapshot&) override {
    if (gateways_.size() < kMostGateways)
      ++entry(source.gateway).images;
  }

  std::vector<ReceivedGateway> gateways() const {
    std::vector<ReceivedGateway> out;
    for (const auto& [name, gateway] : gateways_)
      out.push_back(gateway);
    return out;
  }

 private:
  ReceivedGateway& entry(const std::string& name) {
    ReceivedGateway& out = gateways_[name];
    out.name = name;
    return out;
  }

  std::map<std::string, ReceivedGateway> gateways_;
};

// A participant without commands and outputs. nullptr: `out` has the reason.
std::unique_ptr<dds::Client> join(const Settings& settings,
                                  const std::shared_ptr<dds::DiscoveryRecord>& record,
                                  Observations& out) {
  dds::ClientOptions options{.domain = settings.domain,
                             .profile_file = settings.profile,
                             .network = {.interfaces = settings.interfaces,
                                         .peers = settings.peers,
                                         .servers = settings.servers,
                                         .multicast_images = settings.multicast},
                             .receptions = false,
                             .commands = false,
                             .record = record};
  if (!settings.identity.empty()) {
    out.identity_findings = gateway::use_identity(settings.identity, false, options.security);
    if (has_errors(out.identity_findings))
      return nullptr;
  }
  auto made = dds::Client::make(options);
  out.participant_findings = std::move(made.diagnostics);
  return made.value ? std::move(*made.value) : nullptr;
}

// The announcements of own participants are no observations, except the own authority.
void take_heard(const std::vector<Heard>& all, const std::vector<dds::ObservedPrefix>& own,
                Observations& out) {
  for (const Heard& heard : all) {
    if (std::ranges::count(own, heard.announcement.prefix) == 0) {
      out.heard.push_back(heard);
    } else if (!heard.announcement.authority.empty()) {
      out.own_authority = heard.announcement.authority;
    }
  }
}

void probe_announced(const Listener& listener, const Settings& settings,
                     const std::vector<dds::ObservedPrefix>& own, Prober& prober) {
  for (const Heard& heard : listener.heard()) {
    if (heard.domain != settings.domain || gateway_name(heard.announcement.name).empty() ||
        std::ranges::count(own, heard.announcement.prefix) != 0)
      continue;
    for (const dds::UdpLocator& place : heard.announcement.unicast)
      prober.add_place(place, heard.from);
  }
}

bool is_multicast(const std::string& address) {
  return address.size() > 3 && address >= "224" && address < "240" && address[3] == '.';
}

void observe(const Settings& settings, Observations& out) {
  const auto record = std::make_shared<dds::DiscoveryRecord>();
  Listener listener(out.interfaces);
  Prober prober(settings.domain);
  for (const std::string& host : settings.hosts)
    prober.add_host(host);
  for (const std::string& peer : settings.peers)
    prober.add_host(peer);
  for (const dds::UdpLocator& peer : out.network.peers) {
    if (!is_multicast(peer.address))
      prober.add_host(peer.address, peer.port);
  }
  const auto client = join(settings, record, out);
  std::vector<dds::ObservedPrefix> own{prober.prefix()};
  std::vector<dds::ObservedEndpoint> readers;
  if (client != nullptr) {
    readers = client->own_readers();
    for (const dds::ObservedEndpoint& reader : readers)
      own.push_back(prefix_of(reader));
  }
  prober.ignore(own);
  Received received;
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now() - start);
  };
  while (elapsed() < settings.time) {
    if (client != nullptr)
      client->poll(kRound, received);
    listener.poll(elapsed());
    probe_announced(listener, settings, own, prober);
    prober.poll(elapsed());
    std::this_thread::sleep_for(kRound);
  }
  listener.poll(elapsed());  // what came since, if this process did not run for a while
  out.watched = elapsed();
  take_heard(listener.heard(), own, out);
  out.probes = prober.results();
  out.participants = record->participants();
  std::erase_if(out.participants, [&](const dds::ObservedParticipant& it) {
    return std::ranges::count(own, it.prefix) != 0;
  });
  out.endpoints = record->endpoints();
  // The library reports own ones, too.
  std::erase_if(out.endpoints, [&](const dds::ObservedEndpoint& it) {
    return std::ranges::count(own, prefix_of(it)) != 0;
  });
  std::ranges::move(readers, std::back_inserter(out.endpoints));
  out.received = received.gateways();
}

}  // namespace

Observations examine(const Settings& settings) {
  Observations out;
  out.domain = settings.domain;
  out.profile = dds::profiles_in_use(settings.profile);
  out.identity = settings.identity;
  out.multicast = settings.multicast;
  out.profile_findings = dds::check_profiles(settings.profile);
  out.network = dds::network_profile(settings.profile,
                                     {.interfaces = {}, .peers = {}, .servers = settings.servers});
  if (!settings.interfaces.empty())
    out.network.white_list.clear();  // they replace it
  out.interfaces = examine_interfaces();
  out.local = local_participants();
  observe(settings, out);
  return out;
}

}  // namespace linegate::doctor
