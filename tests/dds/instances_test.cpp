// SPDX-License-Identifier: Apache-2.0
// The instances of the gateway's readers, whatever a writer does with them: in Fast DDS 2.9.1 some
// sequences of samples end the process of the reader.
#include <limits>
#include <thread>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

using eprosima::fastdds::dds::DataWriter;
using eprosima::fastrtps::rtps::c_InstanceHandle_Unknown;

class Instances : public testing::Test {
 protected:
  void SetUp() override { ASSERT_FALSE(gateway.expect("ready").empty()); }

  DataWriter* writer(std::uint32_t strength) {
    return endpoints.writer<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE, strength);
  }
  static v1::OutputWrite output(const char* client) {
    v1::OutputWrite sample;
    sample.gateway(known::kGateway);
    sample.line(known::kLine);
    sample.client(client);
    return sample;
  }
  // Writes until the gateway receives a sample of that client.
  bool arrives(DataWriter* from, const std::string& client) {
    v1::OutputWrite sample = output(client.c_str());
    return eventually([&] {
      from->write(&sample);
      return !gateway.expect("output line=line1 client=" + client, std::chrono::milliseconds(100))
                  .empty();
    });
  }

  Peer gateway{"gateway"};
  std::vector<Diagnostic> diagnostics;
  dds::Endpoints endpoints{"stranger", domain(), paths::kLoopbackProfiles, diagnostics};
};

// A program that pauses longer than its deadline, and disposes its outputs before it continues.
TEST_F(Instances, MayBeDisposedByAWriterThatMissedItsDeadline) {
  constexpr std::chrono::milliseconds kLongPause{1'500};  // of the profile's deadline, 1 s
  DataWriter* const outputs = writer(1);
  ASSERT_NE(outputs, nullptr);
  ASSERT_TRUE(arrives(outputs, "first"));
  std::this_thread::sleep_for(kLongPause);
  v1::OutputWrite sample = output("first");
  ASSERT_EQ(outputs->dispose(&sample, c_InstanceHandle_Unknown), ReturnCode_t::RETCODE_OK);
  EXPECT_TRUE(arrives(outputs, "second"));
}

TEST_F(Instances, MayHaveTwoWritersOfTheGreatestStrength) {
  constexpr std::uint32_t kGreatest = std::numeric_limits<std::uint32_t>::max();
  DataWriter* const weak = writer(1);
  DataWriter* const strong = writer(kGreatest);
  DataWriter* const second = writer(kGreatest);  // its GUID is greater
  ASSERT_TRUE(weak != nullptr && strong != nullptr && second != nullptr);
  ASSERT_TRUE(arrives(weak, "weak"));
  ASSERT_TRUE(arrives(strong, "strong"));
  v1::OutputWrite sample = output("second");
  for (int i = 0; i < 10; ++i) {
    second->write(&sample);
    ASSERT_TRUE(arrives(strong, "strong"));
  }
}

}  // namespace
}  // namespace linegate::test
