// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/listener.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/dds/announcement.h"
#include "gateway/doctor/network.h"

namespace linegate::doctor {
namespace {

using std::chrono::seconds;

std::vector<std::uint8_t> announcement_of(std::uint8_t id, bool leaving = false) {
  dds::Announcement out{.prefix = {id}, .leaving = leaving, .name = "linegate hall"};
  out.unicast = {{"10.0.0.1", 9160}};
  return dds::write_announcement(out, 5);
}

TEST(Listener, CountsAnnouncementsAndTheirEnd) {
  Listener listener({});
  listener.take(7, {"10.0.0.1", announcement_of(1)}, seconds(1));
  listener.take(7, {"10.0.0.1", announcement_of(1)}, seconds(2));
  listener.take(8, {"10.0.0.2", announcement_of(2)}, seconds(3));
  listener.take(7, {"10.0.0.3", {1, 2, 3}}, seconds(3));
  ASSERT_EQ(listener.heard().size(), 2U);
  EXPECT_EQ(listener.heard()[0].count, 2U);
  EXPECT_EQ(listener.heard()[0].first, Duration(seconds(1)));
  EXPECT_EQ(listener.heard()[0].last, Duration(seconds(2)));
  EXPECT_EQ(listener.heard()[1].domain, 8U);
  listener.take(7, {"10.0.0.1", announcement_of(1, true)}, seconds(4));
  EXPECT_TRUE(listener.heard()[0].left);
  EXPECT_EQ(listener.heard()[0].announcement.name, "linegate hall");
  listener.take(7, {"10.0.0.1", announcement_of(9, true)}, seconds(4));
  EXPECT_EQ(listener.heard().size(), 2U);
}

TEST(Listener, IsBounded) {
  Listener listener({});
  for (std::uint32_t i = 0; i < 2 * Listener::kMostHeard; ++i) {
    dds::Announcement out{.name = "linegate hall"};
    out.prefix[0] = static_cast<std::uint8_t>(i);
    out.prefix[1] = static_cast<std::uint8_t>(i >> 8U);
    out.unicast = {{"10.0.0.1", 9160}};
    listener.take(7, {"10.0.0.1", dds::write_announcement(out, 5)}, seconds(1));
  }
  EXPECT_EQ(listener.heard().size(), Listener::kMostHeard);
}

TEST(Network, PortsOfParticipants) {
  const auto found = participants_in(
      "   sl  local_address rem_address   st tx_queue\n"
      "  12: 00000000:1CF2 00000000:0000 07 00000000\n"    // 7410: domain 0, first
      "  13: 00000000:1CF3 00000000:0000 07 00000000\n"    // 7411: data
      "  14: 0100007F:23CA 00000000:0000 07 00000000\n"    // 9162: domain 7, second
      "  15: 00000000:1CE8 00000000:0000 07 00000000\n"    // 7400: multicast
      "  16: 00000000:0035 00000000:0000 07 00000000\n");  // 53
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].domain, 0U);
  EXPECT_EQ(found[0].number, 0U);
  EXPECT_EQ(found[1].domain, 7U);
  EXPECT_EQ(found[1].number, 1U);
  EXPECT_TRUE(participants_in("nonsense:\n:\n 1: :ZZ\n").empty());
}

}  // namespace
}  // namespace linegate::doctor
