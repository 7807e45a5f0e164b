// SPDX-License-Identifier: Apache-2.0
// Whose name counts: what Fast DDS reports about participants, without a network.
#include "bridges/dds/name_watch.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

namespace rtps = eprosima::fastrtps::rtps;

class NameWatchTest : public testing::Test {
 protected:
  static rtps::GUID_t guid_of(unsigned char number) {
    rtps::GUID_t out;
    out.guidPrefix.value[0] = number;
    out.entityId = rtps::c_EntityId_RTPSParticipant;
    return out;
  }
  void discover(unsigned char number, const char* name, bool gone = false) {
    rtps::RTPSParticipantAllocationAttributes allocation;
    rtps::ParticipantProxyData data(allocation);
    data.m_guid = guid_of(number);
    data.m_participantName = name;
    data.m_leaseDuration = {0, 0};
    rtps::ParticipantDiscoveryInfo info(data);
    info.status = gone ? rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT
                       : rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT;
    names_.on_participant_discovery(nullptr, std::move(info));
  }
  void authenticate(unsigned char number, bool authorized = true) {
    rtps::ParticipantAuthenticationInfo info;
    info.guid = guid_of(number);
    info.status = authorized ? rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT
                             : rtps::ParticipantAuthenticationInfo::UNAUTHORIZED_PARTICIPANT;
    names_.onParticipantAuthentication(nullptr, std::move(info));
  }
  using Names = std::vector<std::string>;

  NameWatch names_{"linegate plant"};
};

TEST_F(NameWatchTest, WithoutSecurityEachAnnouncementCounts) {
  discover(1, "linegate plant");
  discover(2, "linegate hall");
  EXPECT_EQ(names_.namesakes(), 1U);
  EXPECT_EQ(names_.peers().gateways, (Names{"hall", "plant"}));
  discover(1, "linegate plant", true);
  EXPECT_EQ(names_.namesakes(), 0U);
  EXPECT_EQ(names_.peers().gateways, Names{"hall"});
}

// Anybody can send a recorded announcement of an earlier start of the gateway again.
TEST_F(NameWatchTest, WithSecurityAnAnnouncementAloneDoesNotCount) {
  names_.expect_authentication();
  discover(1, "linegate plant");
  discover(2, "linegate hall");
  authenticate(1, false);
  EXPECT_EQ(names_.namesakes(), 0U);
  EXPECT_EQ(names_.peers().gateways, Names{});
  EXPECT_EQ(names_.discovery().participants, 2U) << "it uses a place all the same";
  authenticate(2);
  EXPECT_EQ(names_.peers().gateways, Names{"hall"});
  authenticate(1);
  EXPECT_EQ(names_.namesakes(), 1U) << "it has the certificate of this gateway";
  discover(1, "linegate plant");  // announced again
  EXPECT_EQ(names_.namesakes(), 1U);
  discover(1, "linegate plant", true);
  discover(1, "linegate plant");
  EXPECT_EQ(names_.namesakes(), 0U) << "it has to authenticate again";
}

TEST_F(NameWatchTest, AuthenticationMayBeReportedFirst) {
  names_.expect_authentication();
  authenticate(1);
  EXPECT_EQ(names_.peers().gateways, Names{});
  discover(1, "linegate hall");
  EXPECT_EQ(names_.peers().gateways, Names{"hall"});
}

}  // namespace
}  // namespace linegate::dds
