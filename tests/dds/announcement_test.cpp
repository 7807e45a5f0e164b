// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/announcement.h"

#include <random>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

Announcement example() {
  Announcement out{.prefix = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, .name = "linegate hall"};
  out.unicast = {{"192.168.7.10", 9160}};
  return out;
}

TEST(AnnouncementTest, ComesBackAsItWent) {
  const auto read = read_announcement(write_announcement(example(), 5));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->prefix, example().prefix);
  EXPECT_EQ(read->name, "linegate hall");
  EXPECT_EQ(read->unicast, example().unicast);
  EXPECT_FALSE(read->leaving);
  EXPECT_FALSE(read->secured);
}

TEST(AnnouncementTest, TheEndOfAParticipant) {
  Announcement leaving = example();
  leaving.leaving = true;
  const auto read = read_announcement(write_announcement(leaving, 5));
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->leaving);
  EXPECT_EQ(read->prefix, example().prefix);
}

TEST(AnnouncementTest, PortsOfTheSpecification) {
  EXPECT_EQ(multicast_port(0), 7400);
  EXPECT_EQ(unicast_port(0, 0), 7410);
  EXPECT_EQ(unicast_port(1, 2), 7664);
  EXPECT_EQ(multicast_port(232), 65'400);
}

TEST(AnnouncementTest, EachPrefixOfADatagramIsHarmless) {
  const auto whole = write_announcement(example(), 5);
  for (std::size_t size = 0; size < whole.size(); ++size)
    (void)read_announcement(std::span(whole).first(size));
}

TEST(AnnouncementTest, MutatedDatagramsAreHarmless) {
  const auto seed = std::random_device{}();
  RecordProperty("seed", static_cast<int>(seed));
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  const auto whole = write_announcement(example(), 5);
  for (int i = 0; i < 20'000; ++i) {
    auto mutated = whole;
    for (unsigned changes = 1 + random() % 4; changes > 0; --changes)
      mutated[random() % mutated.size()] = static_cast<std::uint8_t>(random());
    const auto read = read_announcement(mutated);
    EXPECT_LE(read ? read->name.size() : 0U, 256U);
  }
}

}  // namespace
}  // namespace linegate::dds
