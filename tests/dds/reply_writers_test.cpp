// SPDX-License-Identifier: Apache-2.0
// The number and the end of the writers of replies by partition, without DDS-Security: which
// partitions a participant may use is the subject of identities_test.cpp.
#include "bridges/dds/reply_writers.h"

#include <chrono>
#include <string>
#include <vector>

#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

using dds::ReplyWriters;

class ReplyWritersTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(gateway.ok());
    ASSERT_TRUE(client.ok());
  }
  static std::string partition(std::size_t number) {
    return "plant//operator/" + std::to_string(number);
  }
  bool write(const std::string& partition, Instant now) {
    v1::CommandReply reply;
    reply.gateway("plant");
    reply.client(partition);
    return writers.write(reply, partition, now);
  }
  // The client of the next reply in that partition; empty if none arrives in time.
  static std::string next(eprosima::fastdds::dds::DataReader& reader) {
    v1::CommandReply reply;
    eprosima::fastdds::dds::SampleInfo info;
    const bool arrived = eventually([&] {
      return reader.take_next_sample(&reply, &info) ==
             eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
    });
    return arrived ? reply.client().to_string() : std::string();
  }
  eprosima::fastdds::dds::DataReader* reader_in(const std::string& partition) {
    return client.reader_in<v1::CommandReplyPubSubType>(partition, v1::TOPIC_COMMAND_REPLY);
  }

  std::vector<Diagnostic> diagnostics;
  dds::Endpoints gateway{"gateway", domain(), paths::kLoopbackProfiles, diagnostics};
  dds::Endpoints client{"client", domain(), paths::kLoopbackProfiles, diagnostics};
  ReplyWriters writers{gateway, 8'000'000, true};
  const Instant start{std::chrono::seconds(1'000)};
};

TEST_F(ReplyWritersTest, AReplyIsReadInItsPartitionOnly) {
  auto* one = reader_in("*/*/operator/1");
  auto* two = reader_in("*/*/operator/2");
  ASSERT_NE(one, nullptr);
  ASSERT_NE(two, nullptr);
  EXPECT_TRUE(write(partition(1), start));
  EXPECT_TRUE(write(partition(2), start));
  EXPECT_EQ(next(*one), partition(1));
  EXPECT_EQ(next(*two), partition(2));
  EXPECT_EQ(one->get_unread_count(), 0U);
  EXPECT_EQ(two->get_unread_count(), 0U);
  EXPECT_FALSE(write("", start)) << "everyone would read it";
}

TEST_F(ReplyWritersTest, AWriterWithoutAReaderIsRemoved) {
  auto* reader = reader_in("*/*/operator/1");
  ASSERT_NE(reader, nullptr);
  EXPECT_TRUE(write(partition(1), start));
  EXPECT_TRUE(write(partition(2), start));
  EXPECT_EQ(next(*reader), partition(1));
  writers.remove_unread(start + ReplyWriters::kUnread - std::chrono::seconds(1));
  EXPECT_EQ(writers.size(), 2U);
  writers.remove_unread(start + ReplyWriters::kUnread);
  EXPECT_EQ(writers.size(), 1U);
  EXPECT_TRUE(write(partition(1), start + ReplyWriters::kUnread));
  EXPECT_EQ(next(*reader), partition(1)) << "the writer with a reader remains";
  EXPECT_TRUE(write(partition(2), start + ReplyWriters::kUnread)) << "made again";
  EXPECT_EQ(writers.size(), 2U);
}

TEST_F(ReplyWritersTest, AreBoundedAndThoseWithAReaderRemain) {
  auto* reader = reader_in("*/*/operator/0");
  ASSERT_NE(reader, nullptr);
  EXPECT_TRUE(write(partition(0), start));
  EXPECT_EQ(next(*reader), partition(0));
  for (std::size_t i = 1; i < ReplyWriters::kMost; ++i)
    EXPECT_TRUE(write(partition(i), start + std::chrono::milliseconds(i)));
  const Instant full = start + std::chrono::seconds(1);
  EXPECT_TRUE(write("plant//operator/more", full));
  EXPECT_EQ(writers.size(), ReplyWriters::kMost);
  EXPECT_TRUE(write(partition(0), full));
  EXPECT_EQ(next(*reader), partition(0));
}

}  // namespace
}  // namespace linegate::test
