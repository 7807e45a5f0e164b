// SPDX-License-Identifier: Apache-2.0
// QoS comes from a file, and a diagnostic names an invalid file.
#include "bridges/dds/profiles.h"

#include <map>
#include <mutex>
#include <ostream>
#include <string>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <gtest/gtest.h>
#include <linegate.h>

#include "bridges/dds/exposure.h"
#include "bridges/dds/publisher.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

namespace fast = eprosima::fastdds::dds;

// The output of a gateway process that is started with that file, until it ends.
std::string complaint(const std::string& path) {
  Peer gateway("gateway", path);
  return gateway.expect(path);
}

TEST(Profiles, AMissingFileIsNamed) {
  const std::string said = complaint("/nonexistent/profiles.xml");
  EXPECT_EQ(said, "/nonexistent/profiles.xml: error: cannot read the file of DDS profiles");
}

TEST(Profiles, AFileThatIsNotXmlIsNamedWithTheReason) {
  const File file("<dds><profiles>");
  const std::string said = complaint(file.path);
  EXPECT_NE(said.find("not a usable file of DDS profiles: "), std::string::npos) << said;
  EXPECT_EQ(said.find("no reason given"), std::string::npos) << said;
}

TEST(Profiles, AMissingProfileIsNamed) {
  std::string text(dds::built_in_profiles());
  const std::string name = "<data_writer profile_name=\"linegate/v1/Event\">";
  ASSERT_NE(text.find(name), std::string::npos);
  text.replace(text.find(name), name.size(), "<data_writer profile_name=\"other\">");
  const File file(text);
  const std::string said = complaint(file.path);
  EXPECT_NE(said.find("there is no data_writer profile \"linegate/v1/Event\""), std::string::npos)
      << said;
}

TEST(Profiles, ContradictoryLimitsAreNamed) {
  std::string text(dds::built_in_profiles());
  const std::string limit = "<max_samples>256000</max_samples>";
  ASSERT_NE(text.find(limit), std::string::npos);
  text.replace(text.find(limit), limit.size(), "<max_samples>5</max_samples>");
  const File file(text);
  const std::string said = complaint(file.path);
  EXPECT_NE(said.find("data_writer profile \"linegate/v1/Event\" is contradictory"),
            std::string::npos)
      << said;
}

TEST(Profiles, MulticastIsRefused) {
  std::string text(dds::built_in_profiles());
  const std::string limit = "<max_multicast_locators>0";
  ASSERT_NE(text.find(limit), std::string::npos);
  text.replace(text.find(limit), limit.size(), "<max_multicast_locators>1");
  const File file(text);
  const std::string said = complaint(file.path);
  EXPECT_NE(said.find("error: max_multicast_locators is not 0"), std::string::npos) << said;
}

TEST(Profiles, ABadDomainIsTold) {
  auto made = dds::GatewayBridge::make({"g", 1, 233, paths::kLoopbackProfiles, {}});
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.diagnostics.at(0).text.find("domain 233 is above 232"), std::string::npos);
}

TEST(Profiles, AnotherFileInTheSameProcessIsRefused) {
  ASSERT_NE(make_client(client_options()), nullptr);
  auto made = dds::GatewayBridge::make({"g", 1, domain(), "/another.xml", {}});
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.diagnostics.at(0).file, "/another.xml");
}

// The durability of each writer in the domain, as discovery reports it.
class WritersInDomain : public fast::DomainParticipantListener {
 public:
  using Kind = eprosima::fastrtps::DurabilityQosPolicyKind;

  void on_publisher_discovery(fast::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& it) override {
    const std::lock_guard lock(mutex_);
    durability_[it.info.topicName().to_string()] = it.info.m_qos.m_durability.kind;
  }
  std::map<std::string, Kind> seen() const {
    const std::lock_guard lock(mutex_);
    return durability_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, Kind> durability_;
};

// Fast DDS 2.9 may deadlock when a reader of a reliable volatile writer leaves.
TEST(Profiles, NoWriterOfAGatewayIsVolatile) {
  auto gateway = dds::GatewayBridge::make({"g", 1, domain(), paths::kLoopbackProfiles, {"line"}});
  ASSERT_TRUE(gateway.ok());
  auto* factory = fast::DomainParticipantFactory::get_instance();
  fast::DomainParticipantQos qos;
  ASSERT_EQ(factory->get_participant_qos_from_profile(dds::kParticipantProfile, qos),
            ReturnCode_t::RETCODE_OK);
  WritersInDomain writers;
  auto* participant =
      factory->create_participant(domain(), qos, &writers, fast::StatusMask::none());
  ASSERT_NE(participant, nullptr);
  const auto all_seen = [&] {
    const auto seen = writers.seen();
    return seen.contains(v1::TOPIC_GATEWAY_STATE) && seen.contains(v1::TOPIC_LINE_STATE) &&
           seen.contains(v1::TOPIC_NODE_STATE) && seen.contains(v1::TOPIC_IMAGE_LAYOUT) &&
           seen.contains(v1::TOPIC_PROCESS_IMAGE) && seen.contains(v1::TOPIC_PDO_UPDATE) &&
           seen.contains(v1::TOPIC_EVENT) && seen.contains(v1::TOPIC_COMMAND_REPLY);
  };
  EXPECT_TRUE(eventually(all_seen));
  for (const auto& [topic, durability] : writers.seen())
    EXPECT_EQ(durability, eprosima::fastrtps::TRANSIENT_LOCAL_DURABILITY_QOS) << topic;
  EXPECT_EQ(factory->delete_participant(participant), ReturnCode_t::RETCODE_OK);
}

// The built-in profiles with one text replaced by another.
std::string profiles_with(const std::string& text, const std::string& replacement) {
  std::string out(dds::built_in_profiles());
  const std::size_t at = out.find(text);
  EXPECT_NE(at, std::string::npos) << text;
  return at == std::string::npos ? out : out.replace(at, text.size(), replacement);
}

// The findings in a file with that text, one per line, without the file name.
std::string findings(const std::string& text) {
  const File file(text);
  std::string out;
  for (const Diagnostic& diagnostic : dds::check_profiles(file.path)) {
    EXPECT_EQ(diagnostic.file, file.path);
    out += std::to_string(diagnostic.line) + ": " + diagnostic.text + "\n";
  }
  return out;
}

TEST(ProfileCheck, TheBuiltInProfilesHaveNoFindings) {
  EXPECT_EQ(findings(std::string(dds::built_in_profiles())), "");
}

TEST(ProfileCheck, AnElementThatIsNotXmlHasALine) {
  EXPECT_EQ(findings("<dds>\n<profiles>\n</dds>"),
            "3: not a usable file of DDS profiles: Start-end tags mismatch\n");
}

TEST(ProfileCheck, AnUnknownElementHasALine) {
  const std::string said = findings(profiles_with("<rtps>", "<rtps><transports/>"));
  EXPECT_NE(said.find("transports"), std::string::npos) << said;
  EXPECT_NE(said.substr(0, 2), "0:") << said;
}

TEST(ProfileCheck, ContradictoryLimitsHaveALine) {
  const std::string said =
      findings(profiles_with("<max_samples>256000</max_samples>", "<max_samples>5</max_samples>"));
  EXPECT_NE(said.find("data_writer profile \"linegate/v1/Event\" is contradictory: max_samples is "
                      "below max_instances x max_samples_per_instance"),
            std::string::npos)
      << said;
  EXPECT_NE(said.substr(0, 2), "0:") << said;
}

TEST(ProfileCheck, AMissingProfileIsNamed) {
  EXPECT_EQ(findings(profiles_with("<data_writer profile_name=\"linegate/v1/Event\">",
                                   "<data_writer profile_name=\"other\">")),
            "0: there is no data_writer profile \"linegate/v1/Event\"\n");
}

TEST(ProfileCheck, AVolatileWriterOfAGatewayIsAWarning) {
  const std::string name = "<data_writer profile_name=\"linegate/v1/PdoUpdate\">";
  std::string text(dds::built_in_profiles());
  const std::size_t at = text.find("TRANSIENT_LOCAL", text.find(name));
  text.replace(at, std::string("TRANSIENT_LOCAL").size(), "VOLATILE");
  const std::string said = findings(text);
  EXPECT_NE(said.find("\"linegate/v1/PdoUpdate\" is RELIABLE and VOLATILE"), std::string::npos)
      << said;
}

// With depth 1 a weaker writer silences the owner of a group.
TEST(ProfileCheck, AnExclusiveReaderOfDepthOneIsAWarning) {
  const std::string depth = "<depth>4</depth>";
  std::string text(dds::built_in_profiles());
  const std::size_t at = text.find("<data_reader profile_name=\"linegate/v1/OutputWrite\">");
  ASSERT_NE(at, std::string::npos);
  text.replace(text.find(depth, at), depth.size(), "<depth>1</depth>");
  const std::string said = findings(text);
  EXPECT_NE(said.find("data_reader profile \"linegate/v1/OutputWrite\" has EXCLUSIVE ownership and "
                      "depth 1"),
            std::string::npos)
      << said;
}

std::string findings_with_lifespan(const std::string& kind) {
  std::string text(dds::built_in_profiles());
  const std::string name = "<data_" + kind + " profile_name=\"linegate/v1/LineState\">";
  const std::string qos = "<qos>";
  text.insert(text.find(qos, text.find(name)) + qos.size(),
              "<lifespan><duration><sec>1</sec></duration></lifespan>");
  return findings(text);
}

// A lifespan counts from the source timestamp, which the guard replaces.
TEST(ProfileCheck, ALifespanOfAReaderIsRefused) {
  const std::string said = findings_with_lifespan("reader");
  EXPECT_NE(said.find("data_reader profile \"linegate/v1/LineState\" has a lifespan"),
            std::string::npos)
      << said;
  EXPECT_NE(said.substr(0, 2), "0:") << said;
}

TEST(ProfileCheck, ALifespanOfAWriterIsPermitted) {
  EXPECT_EQ(findings_with_lifespan("writer"), "");
}

TEST(ProfileCheck, MulticastIsRefusedWithItsLine) {
  const std::string said =
      findings(profiles_with("<max_multicast_locators>0", "<max_multicast_locators>1"));
  EXPECT_NE(said.find("max_multicast_locators is not 0: "), std::string::npos) << said;
  EXPECT_NE(said.substr(0, 2), "0:") << said;
}

// In the profile the limit includes the own participant.
TEST(ProfileCheck, TheLimitOfOtherParticipantsIsThatOfTheProfile) {
  const File file(profiles_with("<remote_locators>",
                                "<total_participants><initial>1</initial><maximum>31</maximum>"
                                "<increment>1</increment></total_participants><remote_locators>"));
  EXPECT_EQ(dds::participants_of_profile(file.path), 30U);
}

TEST(ProfileCheck, TheLimitOfOtherParticipantsHasADefault) {
  const File file{std::string(dds::built_in_profiles())};
  EXPECT_EQ(dds::participants_of_profile(file.path), 100U);
  EXPECT_EQ(dds::participants_of_profile("/no/such.xml"), 100U);
}

TEST(ProfileCheck, ALimitOfMulticastThatIsNotSetIsPermitted) {
  EXPECT_EQ(findings(profiles_with("<max_multicast_locators>0</max_multicast_locators>", "")), "");
}

// The built-in profiles with a transport "own" as the only transport of the participant.
std::string profiles_with_transport(const std::string& type, const std::string& rest) {
  std::string out =
      profiles_with("<transport_id>linegate_udp</transport_id>\n        </userTransports>",
                    "<transport_id>own</transport_id>\n        </userTransports>");
  const std::string descriptors = "<transport_descriptors>\n";
  const std::size_t at = out.find(descriptors);
  EXPECT_NE(at, std::string::npos);
  return out.insert(at + descriptors.size(),
                    "<transport_descriptor><transport_id>own</transport_id><type>" + type +
                        "</type>" + rest + "</transport_descriptor>\n");
}

struct TransportCase {
  std::string name;  // name of the test
  std::string type;
  std::string rest;  // further elements of the transport descriptor
  std::string why;   // why the transport is rejected; empty if it is accepted
};

void PrintTo(const TransportCase& it, std::ostream* out) {
  *out << it.name;
}

// A process loads only one profiles file: hence one test for each case.
class TransportCheck : public testing::TestWithParam<TransportCase> {};

TEST_P(TransportCheck, NamesWhatIsUnusable) {
  const TransportCase& it = GetParam();
  const std::string expected =
      it.why.empty() ? "" : "10: transport \"own\" is unusable: " + it.why + "\n";
  EXPECT_EQ(findings(profiles_with_transport(it.type, it.rest)), expected);
}

INSTANTIATE_TEST_SUITE_P(
    Profiles, TransportCheck,
    testing::Values(
        TransportCase{"UdpV4", "UDPv4", "", ""}, TransportCase{"UdpV6", "UDPv6", "", ""},
        TransportCase{"TcpV4", "TCPv4", "", ""}, TransportCase{"SharedMemory", "SHM", "", ""},
        // No participant received anything over it, with or without a guard.
        TransportCase{"TcpV6", "TCPv6", "",
                      "with TCPv6 nothing is received in Fast DDS 2.9.1: use UDPv6 or TCPv4"},
        TransportCase{"LargestMessage", "UDPv4", "<maxMessageSize>65501</maxMessageSize>",
                      "its maxMessageSize is above 65500"},
        TransportCase{"SendBuffer", "UDPv4", "<sendBufferSize>4096</sendBufferSize>",
                      "its maxMessageSize is above its sendBufferSize"},
        TransportCase{"ReceiveBuffer", "TCPv4", "<receiveBufferSize>4096</receiveBufferSize>",
                      "its maxMessageSize is above its receiveBufferSize"},
        TransportCase{"Segment", "SHM", "<segment_size>4096</segment_size>",
                      "its maxMessageSize is above its segment_size"},
        TransportCase{"SmallestMessage", "UDPv6", "<maxMessageSize>1000</maxMessageSize>",
                      "its maxMessageSize is below 1024: no announcement fits"},
        TransportCase{"FileOfTls", "TCPv4",
                      "<tls><private_key_file>/nonexistent.key</private_key_file></tls>",
                      "cannot read /nonexistent.key, which its <tls> names"}),
    [](const auto& each) { return each.param.name; });

struct ExposureCase {
  std::string name;  // of the test
  std::string type;
  std::string rest;
  std::vector<std::string> open;
};

void PrintTo(const ExposureCase& it, std::ostream* out) {
  *out << it.name;
}

class Exposure : public testing::TestWithParam<ExposureCase> {};

TEST_P(Exposure, NamesInterfacesOtherThanLoopback) {
  const ExposureCase& it = GetParam();
  const File file(profiles_with_transport(it.type, it.rest));
  EXPECT_EQ(dds::open_transports(file.path), it.open);
}

std::string white_list(const std::string& addresses) {
  return "<interfaceWhiteList>" + addresses + "</interfaceWhiteList>";
}

INSTANTIATE_TEST_SUITE_P(
    Profiles, Exposure,
    testing::Values(
        ExposureCase{"Udp", "UDPv4", "", {"UDPv4 on every interface"}},
        ExposureCase{"UdpV6", "UDPv6", "", {"UDPv6 on every interface"}},
        ExposureCase{"Tcp", "TCPv4", "", {"TCPv4 on every interface"}},
        ExposureCase{"SharedMemory", "SHM", "", {}},
        ExposureCase{"Loopback", "UDPv4", white_list("<address>127.0.0.1</address>"), {}},
        ExposureCase{"LoopbackV6", "UDPv6", white_list("<address>::1</address>"), {}},
        ExposureCase{"LoopbackAndAnother",
                     "UDPv4",
                     white_list("<address>127.0.0.1</address><address>192.0.2.7</address>"),
                     {"UDPv4 on 192.0.2.7"}},
        ExposureCase{"TlsWithoutPeers",
                     "TCPv4",
                     "<tls><verify_mode><verify>VERIFY_PEER</verify></verify_mode></tls>",
                     {"TCPv4 on every interface"}},
        ExposureCase{"TlsWithPeers",
                     "TCPv4",
                     "<tls><verify_mode><verify>VERIFY_PEER</verify>"
                     "<verify>VERIFY_FAIL_IF_NO_PEER_CERT</verify></verify_mode></tls>",
                     {}}),
    [](const auto& each) { return each.param.name; });

TEST(ExposureOfProfiles, TheBuiltInProfilesAreOpen) {
  const File file{std::string(dds::built_in_profiles())};
  EXPECT_EQ(dds::open_transports(file.path), std::vector<std::string>{"UDPv4 on every interface"});
}

TEST(ExposureOfProfiles, ChosenInterfacesReplaceThoseOfTheProfile) {
  const File file{std::string(dds::built_in_profiles())};
  EXPECT_TRUE(dds::open_transports(file.path, {"lo"}).empty());
  EXPECT_TRUE(dds::open_transports(file.path, {"127.0.0.1"}).empty());
}

TEST(ExposureOfProfiles, BuiltInTransportsAreOpen) {
  const File file(profiles_with("<useBuiltinTransports>false", "<useBuiltinTransports>true"));
  EXPECT_EQ(dds::open_transports(file.path).front(), "UDPv4 on every interface");
}

TEST(ExposureOfProfiles, ASecuredParticipantIsNotOpen) {
  const File file(
      profiles_with("<useBuiltinTransports>",
                    "<propertiesPolicy><properties><property><name>dds.sec.auth.plugin</name>"
                    "<value>builtin.PKI-DH</value></property></properties></propertiesPolicy>"
                    "<useBuiltinTransports>"));
  EXPECT_TRUE(dds::open_transports(file.path).empty());
}

TEST(ExposureOfProfiles, TheLoopbackProfilesOfTheTestsAreNotOpen) {
  EXPECT_TRUE(dds::open_transports(paths::kLoopbackProfiles).empty());
}

TEST(ProfileCheck, BuiltInTransportsHaveNoFindings) {
  EXPECT_EQ(findings(profiles_with("<useBuiltinTransports>false", "<useBuiltinTransports>true")),
            "");
}

TEST(ProfileCheck, ATransportOfUnknownTypeIsRefused) {
  const std::string said = findings(profiles_with_transport("UDPv5", ""));
  EXPECT_NE(said.find("not a usable file of DDS profiles: "), std::string::npos) << said;
}

TEST(ProfileCheck, ATransportThatIsNotDescribedIsRefused) {
  const std::string said =
      findings(profiles_with("<transport_id>linegate_udp</transport_id>\n        </userTransports>",
                             "<transport_id>other</transport_id>\n        </userTransports>"));
  EXPECT_NE(said.find("other"), std::string::npos) << said;
}

TEST(ProfileCheck, AParticipantWithoutTransportsIsRefused) {
  const std::string text = profiles_with(
      "<userTransports>\n          <transport_id>linegate_udp</transport_id>\n        "
      "</userTransports>",
      "");
  EXPECT_NE(findings(text).find("participant profile \"linegate\" has no transport"),
            std::string::npos);
}

}  // namespace
}  // namespace linegate::test
