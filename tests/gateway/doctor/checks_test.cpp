// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/doctor/facts.h"

#include "tests/gateway/doctor/seen.h"

namespace linegate::doctor {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> causes(const Observations& seen) {
  std::vector<std::string> out;
  for (const Finding& it : run_checks(seen)) {
    EXPECT_THAT(it.seen, testing::Not(IsEmpty())) << it.cause;
    EXPECT_THAT(it.means, testing::Not(IsEmpty())) << it.cause;
    EXPECT_THAT(it.advice, testing::Not(IsEmpty())) << it.cause;
    out.push_back(it.cause);
  }
  return out;
}

std::string evidence(const Observations& seen) {
  const Findings found = run_checks(seen);
  std::string out;
  for (const std::string& it : found.empty() ? std::vector<std::string>{} : found.front().seen)
    out += it + "\n";
  return out;
}

TEST(Checks, NoFaultWhereAllIsWell) {
  EXPECT_THAT(causes(sound_plant()), IsEmpty());
}

TEST(Checks, AGatewayOfAnotherDomainIsNoFaultBesideOneOfThis) {
  Observations seen = sound_plant();
  seen.heard.push_back(heard("linegate yard", 9, 42));
  EXPECT_THAT(causes(seen), IsEmpty());
}

TEST(Checks, AnotherDomain) {
  Observations seen = silent_plant();
  seen.heard = {heard("linegate hall", kHall, 42)};
  EXPECT_THAT(causes(seen), ElementsAre("other-domain"));
  EXPECT_THAT(evidence(seen), HasSubstr("gateway 'hall' from 10.0.0.1 (5 announcements) in domain "
                                        "42"));
  seen.heard.front().left = true;
  EXPECT_THAT(causes(seen), ElementsAre("nothing-heard"));
  seen.heard = {heard("linegate client desk/1/1", kHall, 42)};
  EXPECT_THAT(causes(seen), ElementsAre("nothing-heard"));
}

TEST(Checks, Interfaces) {
  Observations seen = silent_plant();
  seen.interfaces[1].multicast = false;
  EXPECT_THAT(causes(seen), ElementsAre("multicast-off"));
  seen.interfaces[1].running = false;
  EXPECT_THAT(causes(seen), ElementsAre("interface-down", "no-interface", "multicast-off"));
  EXPECT_THAT(evidence(seen), HasSubstr("eth0 with address 10.0.0.2 has no carrier"));
  seen.interfaces[1].addresses.clear();
  seen.interfaces[0].multicast = true;
  EXPECT_THAT(causes(seen), ElementsAre("no-interface"));
  // Beside a gateway that is received they are no fault.
  seen = sound_plant();
  seen.interfaces[1].up = false;
  EXPECT_THAT(causes(seen), IsEmpty());
}

dds::ObservedServer server(std::uint8_t id) {
  dds::ObservedServer out{{"10.0.0.9", 11811}, id, {}};
  out.prefix[2] = id;
  return out;
}

TEST(Checks, DiscoveryServers) {
  Observations seen = silent_plant();
  seen.interfaces[1].multicast = false;  // not used
  seen.interfaces[1].multicast_received = false;
  seen.network.servers = {server(0), server(3)};
  EXPECT_THAT(causes(seen), ElementsAre("server-silent", "server-silent"));
  EXPECT_THAT(evidence(seen), HasSubstr("on 10.0.0.9, UDP port 11811, with ID 0 was not"));
  for (const dds::ObservedServer& it : seen.network.servers) {
    dds::ObservedParticipant participant;
    participant.prefix = it.prefix;
    seen.participants.push_back(participant);
  }
  EXPECT_THAT(causes(seen), ElementsAre("server-without-gateway", "server-without-gateway"));
  seen.participants.push_back(sound_plant().participants.front());
  EXPECT_THAT(causes(seen), ElementsAre("no-samples"));
}

TEST(Checks, AGatewayThatIsNotAtTheServer) {
  Observations seen = silent_plant();
  seen.network.servers = {server(0)};
  dds::ObservedParticipant participant;
  participant.prefix = seen.network.servers.front().prefix;
  seen.participants = {participant};
  seen.heard = {heard("linegate hall", kHall)};
  EXPECT_THAT(causes(seen), ElementsAre("not-at-server"));
  seen = sound_plant();
  seen.network.servers = {server(0)};
  EXPECT_THAT(causes(seen), IsEmpty()) << "the gateway is received";
}

TEST(Checks, BlockedMulticast) {
  Observations seen = silent_plant();
  seen.interfaces[1].multicast_received = false;
  EXPECT_THAT(causes(seen), ElementsAre("multicast-blocked"));
  EXPECT_THAT(evidence(seen), HasSubstr("did not receive it itself"));
  seen.interfaces[1].multicast_error = "Network is unreachable";
  EXPECT_THAT(evidence(seen), HasSubstr("could not be sent: Network is unreachable"));
  // On the host of the gateway: others do not hear it.
  seen = sound_plant();
  seen.interfaces[1].multicast_received = false;
  EXPECT_THAT(causes(seen), IsEmpty());
  seen.heard.front().from = "127.0.0.1";
  EXPECT_THAT(causes(seen), ElementsAre("multicast-blocked"));
}

ProbedHost probed(PortAnswer answer, bool given = true) {
  ProbedHost out{.name = "hall-pc", .address = "10.0.0.1", .given = given};
  out.ports = {{9160, answer, answer == PortAnswer::unreachable ? "No route to host" : "",
                answer == PortAnswer::answered ? "linegate hall" : ""}};
  return out;
}

TEST(Checks, Peers) {
  Observations seen = silent_plant();
  for (const auto& [answer, cause] : {std::pair{PortAnswer::silent, "peer-silent"},
                                      {PortAnswer::refused, "peer-without-dds"},
                                      {PortAnswer::unreachable, "peer-unreachable"},
                                      {PortAnswer::answered, "multicast-lost"}}) {
    seen.probes = {probed(answer)};
    EXPECT_THAT(causes(seen), ElementsAre(cause));
    EXPECT_THAT(evidence(seen), HasSubstr("hall-pc (10.0.0.1)"));
  }
  seen.probes = {probed(PortAnswer::answered)};
  seen.probes.front().ports.front().program = "viewer";
  EXPECT_THAT(causes(seen), ElementsAre("peer-without-gateway"));
  EXPECT_THAT(evidence(seen), HasSubstr("program 'viewer' on hall-pc"));
  seen.probes = {{.name = "nohost", .given = true}};
  EXPECT_THAT(causes(seen), ElementsAre("peer-unknown"));
  seen = sound_plant();
  seen.probes = {probed(PortAnswer::silent)};
  EXPECT_THAT(causes(seen), IsEmpty());
}

// Whoever names a host wants to know about that host.
TEST(Checks, AHostThatWasNamedIsReportedBesideAGatewayOfAnotherHost) {
  Observations seen = sound_plant();
  seen.heard.front().from = "10.0.0.7";
  for (const auto& [answer, cause] : {std::pair{PortAnswer::silent, "peer-silent"},
                                      {PortAnswer::refused, "peer-without-dds"},
                                      {PortAnswer::unreachable, "peer-unreachable"}}) {
    seen.probes = {probed(answer)};
    seen.probes.front().named = true;
    EXPECT_THAT(causes(seen), ElementsAre(cause));
    seen.probes.front().address = "10.0.0.7";
    EXPECT_THAT(causes(seen), IsEmpty()) << "a gateway of that host is heard";
  }
  seen.probes = {probed(PortAnswer::answered)};
  seen.probes.front().named = true;
  EXPECT_THAT(causes(seen), IsEmpty());
  seen.probes = {{.name = "nohost", .given = true, .named = true}};
  EXPECT_THAT(causes(seen), ElementsAre("peer-unknown"));
}

TEST(Checks, Firewall) {
  Observations seen = deaf_plant();
  EXPECT_THAT(causes(seen), ElementsAre("no-samples"));
  seen.probes = {probed(PortAnswer::silent, false)};
  EXPECT_THAT(causes(seen), ElementsAre("firewall"));
  EXPECT_THAT(evidence(seen), HasSubstr("its UDP ports 10.0.0.1:9160 give no answer"));
  seen.probes.front().closed.answer = PortAnswer::refused;
  EXPECT_THAT(causes(seen), ElementsAre("not-answered"));
  seen.probes = {probed(PortAnswer::unreachable, false)};
  EXPECT_THAT(causes(seen), ElementsAre("no-route"));
  EXPECT_THAT(evidence(seen), HasSubstr("10.0.0.1:9160 No route to host"));
  seen.probes = {probed(PortAnswer::refused, false)};
  EXPECT_THAT(causes(seen), ElementsAre("refused"));
  seen.probes = {probed(PortAnswer::answered, false)};
  EXPECT_THAT(causes(seen), ElementsAre("no-samples"));
}

// A gateway announces the address of a bridge for containers, too, which this host has as well.
TEST(Checks, AnAddressThatOthersDoNotReachHidesNoFirewall) {
  Observations seen = deaf_plant();
  seen.heard.front().announcement.unicast.push_back({"172.17.0.1", 9160});
  ProbedHost bridge = probed(PortAnswer::refused, false);
  bridge.address = "172.17.0.1";
  seen.probes = {bridge, probed(PortAnswer::silent, false)};
  EXPECT_THAT(causes(seen), ElementsAre("firewall"));
}

TEST(Checks, AnInterfaceWithoutCarrierDoesNotHideSilence) {
  Observations seen = silent_plant();
  seen.interfaces.push_back({.name = "docker0", .up = true, .addresses = {"172.17.0.1"}});
  EXPECT_THAT(causes(seen), ElementsAre("interface-down", "nothing-heard"));
}

// A stranger can have as many endpoints as the record takes.
TEST(Checks, FindingsAreBounded) {
  Observations seen = sound_plant();
  for (unsigned i = 0; i < 3'000; ++i) {
    dds::ObservedEndpoint other = endpoint(kViewer, false, "linegate/v1/LineState");
    other.type = "other" + std::to_string(i);
    seen.endpoints.push_back(other);
    other = endpoint(kViewer, false, "linegate/v1/LineState");
    other.qos.deadline = i * std::int64_t{1'000'000'000};
    seen.endpoints.push_back(other);
    other = endpoint(kViewer, false, "linegate/v1/LineState");
    other.qos.partitions = {std::to_string(i)};
    seen.endpoints.push_back(other);
  }
  EXPECT_EQ(run_checks(seen).size(), 3 * kMostFindings);
}

TEST(Checks, SecurityOnOneSide) {
  Observations seen = deaf_plant();
  seen.heard.front().announcement.secured = true;
  EXPECT_THAT(causes(seen), ElementsAre("gateway-secured"));
  seen.identity = "identities/desk";
  EXPECT_THAT(causes(seen), ElementsAre("no-samples"));
  seen.heard.front().announcement.secured = false;
  EXPECT_THAT(causes(seen), ElementsAre("gateway-not-secured"));
  EXPECT_THAT(evidence(seen), HasSubstr("identities/desk"));
}

TEST(Checks, ARefusedIdentity) {
  Observations seen = deaf_plant();
  seen.identity = "identities/desk";
  seen.heard.front().announcement.secured = true;
  dds::ObservedParticipant hall;
  hall.prefix[0] = kHall;
  hall.refused = true;
  seen.participants = {hall};
  EXPECT_THAT(causes(seen), ElementsAre("not-authenticated"));
  seen.identity_findings = {{Severity::error, "identity.crt", 0, 0, "is expired"}};
  EXPECT_THAT(causes(seen), ElementsAre("identity"));
  EXPECT_THAT(evidence(seen), HasSubstr("is expired"));
}

TEST(Checks, QosThatDoesNotFit) {
  using Change = void (*)(dds::ObservedQos & offered, dds::ObservedQos & requested);
  const std::pair<Change, const char*> cases[] = {
      {[](auto& offered, auto&) { offered.reliable = false; },
       "policy RELIABILITY: the writer of gateway 'hall' offers BEST_EFFORT, the reader of this "
       "program requests RELIABLE"},
      {[](auto& offered, auto&) { offered.durability = dds::ObservedDurability::volatile_; },
       "policy DURABILITY: the writer of gateway 'hall' offers VOLATILE, the reader of this "
       "program requests TRANSIENT_LOCAL"},
      {[](auto&, auto& requested) { requested.exclusive = true; },
       "policy OWNERSHIP: the writer of gateway 'hall' offers SHARED"},
      {[](auto&, auto& requested) { requested.deadline = 1'000'000'000; },
       "policy DEADLINE: the writer of gateway 'hall' offers infinite, the reader of this program "
       "requests 1.0 s"},
      {[](auto&, auto& requested) { requested.liveliness = dds::ObservedLiveliness::by_topic; },
       "policy LIVELINESS: the writer of gateway 'hall' offers AUTOMATIC"},
      {[](auto&, auto& requested) { requested.lease = 2'000'000'000; },
       "policy LIVELINESS lease: the writer of gateway 'hall' offers infinite"},
  };
  for (const auto& [change, words] : cases) {
    Observations seen = sound_plant();
    change(seen.endpoints[0].qos, seen.endpoints[1].qos);
    EXPECT_THAT(causes(seen), ElementsAre("qos-mismatch"));
    EXPECT_THAT(evidence(seen), HasSubstr("topic linegate/v1/LineState, " + std::string(words)));
    // The other way round all of these fit, except the ownership.
    std::swap(seen.endpoints[0].qos, seen.endpoints[1].qos);
    EXPECT_EQ(causes(seen).size(), std::string(words).find("OWNERSHIP") == 7 ? 1U : 0U) << words;
  }
}

TEST(Checks, QosOfTwoProgramsThatAreNoGatewaysIsTheirOwn) {
  Observations seen = sound_plant();
  seen.endpoints.push_back(endpoint(kViewer, true, "linegate/v1/LineState"));
  seen.endpoints.back().qos.reliable = false;
  EXPECT_THAT(causes(seen), IsEmpty());
}

TEST(Checks, AnotherType) {
  Observations seen = sound_plant();
  seen.endpoints.push_back(endpoint(kViewer, false, "linegate/v1/LineState"));
  seen.endpoints.back().type = "linegate::v0::LineState";
  EXPECT_THAT(causes(seen), ElementsAre("type-mismatch"));
  EXPECT_THAT(evidence(seen), HasSubstr("the reader of program 'viewer' on host desk has type "
                                        "linegate::v0::LineState, gateway 'hall' has type "
                                        "linegate::v1::LineState"));
  seen.endpoints.back().type = "linegate::v1::LineState";
  seen.endpoints.back().keyed = false;
  EXPECT_THAT(causes(seen), ElementsAre("type-mismatch"));
}

TEST(Checks, AChangedDeviceChangesTheTypeOfItsTopics) {
  Observations seen = sound_plant();
  seen.endpoints.push_back(endpoint(kHall, true, "plant/press/inlet/inputs"));
  seen.endpoints.back().type = "press_inlet_inputs_2b1c";
  seen.endpoints.push_back(endpoint(kViewer, false, "plant/press/inlet/inputs"));
  seen.endpoints.back().type = "press_inlet_inputs_77aa";
  EXPECT_THAT(causes(seen), ElementsAre("type-mismatch"));
  EXPECT_THAT(run_checks(seen).front().advice, HasSubstr("linegate idl"));
}

TEST(Checks, AnotherPartition) {
  Observations seen = sound_plant();
  seen.endpoints[0].qos.partitions = {"", "hall/press"};
  seen.endpoints.push_back(endpoint(kViewer, false, "linegate/v1/LineState"));
  seen.endpoints.back().qos.partitions = {"hall/pres"};
  EXPECT_THAT(causes(seen), ElementsAre("partition-mismatch"));
  EXPECT_THAT(evidence(seen), HasSubstr("is in 'hall/pres'"));
  for (const char* const fits : {"hall/press", "hall/*", "*", ""}) {
    seen.endpoints.back().qos.partitions = {fits};
    EXPECT_THAT(causes(seen), IsEmpty()) << fits;
  }
}

TEST(Checks, ImagesByMulticastThatTheGatewayDoesNotSend) {
  Observations seen = sound_plant();
  seen.endpoints.push_back(endpoint(kHall, true, "linegate/v1/ProcessImage"));
  EXPECT_THAT(causes(seen), IsEmpty());
  seen.multicast = true;
  EXPECT_THAT(causes(seen), ElementsAre("images-by-unicast"));
  EXPECT_THAT(evidence(seen), HasSubstr("gateway 'hall' does not send"));
  seen.endpoints.back().multicast = true;
  EXPECT_THAT(causes(seen), IsEmpty());
}

TEST(Checks, ImagesByMulticastThatTheNetworkDoesNotCarry) {
  Observations seen = sound_plant();
  seen.multicast = true;
  seen.endpoints.push_back(endpoint(kHall, true, "linegate/v1/ProcessImage"));
  seen.endpoints.back().multicast = true;
  seen.received.front().layouts = 1;
  EXPECT_THAT(causes(seen), ElementsAre("images-by-multicast-lost"));
  EXPECT_THAT(evidence(seen), HasSubstr("239.255.76.71, UDP port 9151"));
  seen.received.front().images = 1;
  EXPECT_THAT(causes(seen), IsEmpty());
  seen.received.front() = {.name = "hall", .samples = 5, .participants_most = 100};
  EXPECT_THAT(causes(seen), IsEmpty());  // it has no values
}

TEST(Checks, TwoGatewaysOfOneName) {
  Observations seen = sound_plant();
  seen.heard.push_back(heard("linegate hall", 9));
  EXPECT_THAT(causes(seen), ElementsAre("same-name"));
  // A restart: the earlier one has been silent since.
  seen.heard.front().last = std::chrono::seconds(2);
  EXPECT_THAT(causes(seen), IsEmpty());
  seen.heard.front().last = std::chrono::seconds(5);
  seen.heard.front().left = true;
  EXPECT_THAT(causes(seen), IsEmpty());
}

TEST(Checks, Clocks) {
  Observations seen = sound_plant();
  seen.received.front().clock_difference = std::chrono::milliseconds(-1'900);
  EXPECT_THAT(causes(seen), IsEmpty());
  seen.received.front().clock_difference = std::chrono::seconds(-90);
  EXPECT_THAT(causes(seen), ElementsAre("clocks-differ"));
  EXPECT_THAT(evidence(seen), HasSubstr("gateway 'hall' is 90.0 s behind"));
  seen.received.front().clock_difference = std::chrono::seconds(90);
  EXPECT_THAT(evidence(seen), HasSubstr("gateway 'hall' is 90.0 s ahead of"));
  // One sample may be old.
  seen.received.front().samples = 1;
  EXPECT_THAT(causes(seen), IsEmpty());
}

TEST(Checks, TheLimitOfParticipants) {
  Observations seen = sound_plant();
  seen.received.front().participants = 100;
  EXPECT_THAT(causes(seen), ElementsAre("participants-limit"));
}

TEST(Checks, TheProfile) {
  Observations seen = sound_plant();
  seen.profile_findings = {{Severity::warning, "profiles.xml", 12, 0, "is VOLATILE"}};
  EXPECT_THAT(causes(seen), ElementsAre("profile"));
  EXPECT_THAT(evidence(seen), HasSubstr("profiles.xml:12"));
  seen = sound_plant();
  seen.network.white_list = {"127.0.0.1", "192.168.7.3"};
  EXPECT_THAT(causes(seen), IsEmpty());
  seen.network.white_list = {"192.168.7.3"};
  EXPECT_THAT(causes(seen), ElementsAre("no-listed-interface"));
  seen.network.white_list = {"10.0.0.2"};
  EXPECT_THAT(causes(seen), IsEmpty());
}

TEST(Checks, AForeignTextIsHarmless) {
  EXPECT_EQ(safe("a\x1b[2J'b\n"), "a?[2J?b?");
  EXPECT_EQ(safe(std::string(1'000, 'x')).size(), 256U);
}

}  // namespace
}  // namespace linegate::doctor
