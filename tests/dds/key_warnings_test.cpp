// SPDX-License-Identifier: Apache-2.0
// What the library logs while secured participants exchange samples.
#include "bridges/dds/guard/key_warnings.h"

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>
#include <unistd.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/library_log.h"
#include "gateway/security/authority.h"
#include "gateway/security/files.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

using eprosima::fastdds::dds::DataReader;
using eprosima::fastdds::dds::DataWriter;
using security::Role;

class KeyWarnings : public testing::Test {
 protected:
  KeyWarnings() {
    EXPECT_EQ(security::init(plant_.string()), "");
    EXPECT_EQ(security::issue(plant_.string(), {{"plant", Role::gateway, {"*/*"}}, 60}), "");
    EXPECT_EQ(security::issue(plant_.string(), {{"victor", Role::viewer, {"*/*"}}, 60}), "");
    dds::set_library_log([this](Severity, std::string_view text) {
      warnings_ += text == dds::guard::kKeyWarning ? 1 : 0;
    });
  }
  ~KeyWarnings() override {
    dds::set_library_log({});
    std::filesystem::remove_all(top_);
  }

  std::unique_ptr<dds::Endpoints> join(const char* identity) {
    return std::make_unique<dds::Endpoints>(
        identity, domain(), paths::kLoopbackProfiles, diagnostics_, true, 0,
        dds::security_with(security::files_in((plant_ / identity).string())));
  }
  // Makes participants that read the topic until one of them receives and acknowledges `samples`
  // samples. Authentication may take several attempts.
  bool exchange(DataWriter& writer, int samples) {
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const auto viewer = join("victor");
      DataReader* const reader = viewer->reader<v1::NodeStatePubSubType>(v1::TOPIC_NODE_STATE);
      if (reader == nullptr || !reader->wait_for_unread_message({kOneAttempt.count(), 0}))
        continue;
      v1::NodeState sample;
      sample.gateway("plant");
      for (int i = 0; i < samples; ++i) {
        if (!writer.write(&sample) || writer.wait_for_acknowledgments({kOneAttempt.count(), 0}) !=
                                          eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
          return false;
      }
      return true;
    }
    return false;
  }

  const std::filesystem::path top_ =
      std::filesystem::path(testing::TempDir()) / ("key-warnings-" + std::to_string(::getpid()));
  const std::filesystem::path plant_ = top_ / "plant";
  std::vector<Diagnostic> diagnostics_;
  std::atomic<int> warnings_{0};
};

// The library logs one for each submessage and each endpoint without a peer, here that of
// LineState: 116 in this test.
TEST_F(KeyWarnings, AreNotLogged) {
  const auto gateway = join("plant");
  ASSERT_TRUE(gateway->ok());
  DataWriter* const writer = gateway->writer<v1::NodeStatePubSubType>(v1::TOPIC_NODE_STATE);
  ASSERT_NE(writer, nullptr);
  ASSERT_NE(gateway->writer<v1::LineStatePubSubType>(v1::TOPIC_LINE_STATE), nullptr);
  v1::NodeState first;
  first.gateway("plant");
  ASSERT_TRUE(writer->write(&first));
  ASSERT_TRUE(exchange(*writer, 20));
  dds::set_library_log({});  // after what was logged until now
  EXPECT_EQ(warnings_, 0);
}

}  // namespace
}  // namespace linegate::test
