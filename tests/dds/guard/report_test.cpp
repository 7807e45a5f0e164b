// SPDX-License-Identifier: Apache-2.0
// A flood of malformed datagrams does not flood the log.
#include "bridges/dds/guard/report.h"

#include <gtest/gtest.h>

namespace linegate::dds::guard {
namespace {

class GuardReportTest : public testing::Test {
 protected:
  void drop(Reason reason, std::uint64_t count) {
    counters.dropped[static_cast<std::size_t>(reason)] += count;
  }
  std::vector<std::string> update(Duration at) { return report.update(counters, Instant{at}); }

  Counters counters;
  Report report;
};

TEST_F(GuardReportTest, AReasonIsReportedAtOnceAndThenOnceAMinute) {
  EXPECT_TRUE(update(std::chrono::seconds(5)).empty());
  drop(Reason::rate, 1);
  EXPECT_EQ(update(std::chrono::seconds(5)),
            std::vector<std::string>{"1 datagram dropped by the DDS guard: sequence numbers "
                                     "advance faster than samples can (rate)"});
  drop(Reason::rate, 700);
  EXPECT_TRUE(update(std::chrono::seconds(6)).empty());
  EXPECT_TRUE(update(std::chrono::seconds(64)).empty());
  EXPECT_EQ(update(std::chrono::seconds(65)),
            std::vector<std::string>{"700 datagrams dropped by the DDS guard: sequence numbers "
                                     "advance faster than samples can (rate)"});
  EXPECT_TRUE(update(std::chrono::seconds(200)).empty());
}

TEST_F(GuardReportTest, EachReasonHasALimitOfItsOwn) {
  drop(Reason::rate, 1);
  EXPECT_EQ(update(std::chrono::seconds(1)).size(), 1U);
  drop(Reason::header, 2);
  drop(Reason::rate, 1);
  EXPECT_EQ(update(std::chrono::seconds(2)),
            std::vector<std::string>{"2 datagrams dropped by the DDS guard: no RTPS 2 header "
                                     "(header)"});
}

TEST_F(GuardReportTest, GapsAreLeftOutOfDatagramsThatPass) {
  drop(Reason::gap, 1);
  EXPECT_EQ(update(std::chrono::seconds(1)),
            std::vector<std::string>{"1 GAP left out by the DDS guard: more numbers above a "
                                     "missing one than a reader may keep (gap)"});
  drop(Reason::gap, 2);
  EXPECT_EQ(update(std::chrono::seconds(61)),
            std::vector<std::string>{"2 GAPs left out by the DDS guard: more numbers above a "
                                     "missing one than a reader may keep (gap)"});
}

TEST_F(GuardReportTest, ConnectionsAreEnded) {
  drop(Reason::stream, 1);
  drop(Reason::reader, 2);
  EXPECT_EQ(update(std::chrono::seconds(1)),
            (std::vector<std::string>{"1 TCP connection ended by the DDS guard: their octets are "
                                      "no RTCP messages (stream)",
                                      "2 TCP connections ended by the DDS guard: two threads of "
                                      "Fast DDS read from them; it opens them again (reader)"}));
}

}  // namespace
}  // namespace linegate::dds::guard
