// SPDX-License-Identifier: Apache-2.0
// A domain in which everything is encrypted: clients authenticate through the guard, and forged
// plain datagrams are dropped, whatever participant they claim to come from.
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/rtps/common/SerializedPayload.h>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"

#include "tests/dds/fixtures.h"
#include "tests/dds/guard/datagram.h"
#include "tests/dds/guard/forger.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

namespace entity = dds::guard::entity;
using dds::guard::Reason;

class Secured : public testing::Test {
 protected:
  void SetUp() override {
    const std::string make = std::string(paths::kMakeIdentities) + " '" + folder + "'";
    ASSERT_EQ(std::system(make.c_str()), 0);
    write_profiles("gateway");
    write_profiles("operator");
    // Fast DDS 2.9.1 does not authenticate every participant that joins late, with or without a
    // guard.
    for (int attempt = 0; attempt < 10 && !connected; ++attempt)
      connect();
    ASSERT_TRUE(connected);
  }

  // The loopback profiles with the identity of that name.
  void write_profiles(const std::string& name) const {
    std::ifstream in(paths::kLoopbackProfiles);
    std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    const std::string participant = "<participant profile_name=\"linegate\">";
    const std::size_t at = text.find("<rtps>", text.find(participant));
    ASSERT_NE(at, std::string::npos);
    text.insert(at + 6, properties(name));
    std::ofstream(profiles(name)) << text;
  }
  std::string profiles(const std::string& name) const { return folder + "/profiles-" + name; }
  std::string properties(const std::string& name) const {
    const auto property = [](const std::string& key, const std::string& value) {
      return "<property><name>dds.sec." + key + "</name><value>" + value + "</value></property>";
    };
    const std::string file = "file://" + folder + "/";
    const std::string identity = "auth.builtin.PKI-DH.";
    const std::string access = "access.builtin.Access-Permissions.";
    return "<propertiesPolicy><properties>" + property("auth.plugin", "builtin.PKI-DH") +
           property(identity + "identity_ca", file + "ca.crt") +
           property(identity + "identity_certificate", file + name + ".crt") +
           property(identity + "private_key", file + name + ".key") +
           property("access.plugin", "builtin.Access-Permissions") +
           property(access + "permissions_ca", file + "ca.crt") +
           property(access + "governance", file + "governance.smime") +
           property(access + "permissions", file + name + ".smime") +
           property("crypto.plugin", "builtin.AES-GCM-GMAC") + "</properties></propertiesPolicy>";
  }

  void connect() {
    gateway = std::make_unique<Peer>("gateway", profiles("gateway"));
    ASSERT_FALSE(gateway->expect("ready").empty());
    endpoints.emplace("operator", domain(), profiles("operator"), diagnostics);
    outputs = endpoints->writer<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE);
    ASSERT_NE(outputs, nullptr);
    connected = output_arrives("operator", std::chrono::seconds(8));
  }

  static v1::OutputWrite sample(const std::string& client) {
    v1::OutputWrite out;
    out.gateway(known::kGateway);
    out.line(known::kLine);
    out.client(client);
    out.values().resize(1);
    out.values()[0].data({1});
    return out;
  }
  bool output_arrives(const std::string& client, std::chrono::nanoseconds deadline = kDeadline) {
    v1::OutputWrite real = sample(client);
    return eventually(
        [&] {
          outputs->write(&real);
          return !gateway
                      ->expect("output line=line1 client=" + client, std::chrono::milliseconds(200))
                      .empty();
        },
        deadline);
  }
  // DATA of an output that the operator never wrote.
  static Fields forged_output(std::uint32_t writer, std::int64_t number) {
    v1::OutputWrite lie = sample("forged");
    v1::OutputWritePubSubType type;
    eprosima::fastrtps::rtps::SerializedPayload_t payload(type.m_typeSize);
    EXPECT_TRUE(type.serialize(&lie, &payload));
    return data(number, writer).octets({payload.data, payload.data + payload.length});
  }

  const std::string folder = testing::TempDir() + "identities-" + std::to_string(::getpid());
  std::unique_ptr<Peer> gateway;
  std::vector<Diagnostic> diagnostics;
  std::optional<dds::Endpoints> endpoints;
  eprosima::fastdds::dds::DataWriter* outputs = nullptr;
  bool connected = false;
  Forger forger;
};

TEST_F(Secured, WhatIsForgedInPlainIsDroppedAndRealDataFlows) {
  dds::guard::Guid writer{};
  std::copy_n(outputs->guid().guidPrefix.value, 12, writer.begin());
  std::copy_n(outputs->guid().entityId.value, 4, writer.begin() + 12);
  const std::uint32_t id = dds::guard::Wire(writer, false).u32(12);
  const Datagram from(dds::guard::prefix_of(writer));
  const Fields end = Fields().parameter(0x71, Fields().zeros(3).u8(3)).sentinel();
  const std::uint64_t before = endpoints->guard_counters().of(Reason::unprotected);
  for (std::int64_t i = 0; i < 40; ++i) {
    forger.unicast(Datagram(from).add(0x15, forged_output(id, 1'000 + i), kHasData).get());
    forger.unicast(Datagram(from).add(0x07, heartbeat(2'000 + i, 2'000 + i)).get());
    forger.unicast(Datagram(from).add(0x08, gap(1, 3'000 + i)).get());
    forger.unicast(
        Datagram(from)
            .add(0x15, data(90'000 + i, entity::kParticipants).octets(end.get()), kHasInlineQos)
            .get());
  }
  EXPECT_FALSE(gateway->expect("guard unprotected").empty());
  EXPECT_TRUE(eventually(
      [&] { return endpoints->guard_counters().of(Reason::unprotected) >= before + 160; }));
  EXPECT_TRUE(output_arrives("operator-again"));
  EXPECT_EQ(gateway->expect("output line=line1 client=forged", std::chrono::milliseconds(0)), "");
}

// The library reads its lengths before it authenticates anything.
TEST_F(Secured, ProtectedContentThatClaimsMoreThanItHas) {
  dds::guard::Prefix prefix{};
  std::copy_n(outputs->guid().guidPrefix.value, 12, prefix.begin());
  const Fields header = Fields().zeros(20);
  const Fields content = Fields(false).u32(0x7FFFFFFF).zeros(40);
  const Fields footer = Fields(false).zeros(20);
  EXPECT_TRUE(eventually([&] {
    forger.unicast(Datagram(prefix).add(0x33, header).add(0x30, content).add(0x34, footer).get());
    forger.unicast(Datagram(prefix).add(0x31, header).add(0x30, content).add(0x32, footer).get());
    return !gateway->expect("guard protection", std::chrono::milliseconds(200)).empty();
  }));
  EXPECT_TRUE(output_arrives("operator-again"));
}

}  // namespace
}  // namespace linegate::test
