// SPDX-License-Identifier: Apache-2.0
// What a secured participant keeps of the participants that join and leave.
#include "bridges/dds/guard/sent_tokens.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>
#include <unistd.h>

#include "bridges/dds/endpoints.h"
#include "gateway/security/authority.h"
#include "gateway/security/files.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

using eprosima::fastdds::dds::DataReader;
using eprosima::fastdds::dds::DataWriter;
using security::Role;

class SentTokens : public testing::Test {
 protected:
  SentTokens() {
    EXPECT_EQ(security::init(plant_.string()), "");
    EXPECT_EQ(security::issue(plant_.string(), {{"plant", Role::gateway, {"*/*"}}, 60}), "");
    EXPECT_EQ(security::issue(plant_.string(), {{"victor", Role::viewer, {"*/*"}}, 60}), "");
  }
  ~SentTokens() override { std::filesystem::remove_all(top_); }

  std::unique_ptr<dds::Endpoints> join(const char* identity) {
    return std::make_unique<dds::Endpoints>(
        identity, domain(), paths::kLoopbackProfiles, diagnostics_, true, 0,
        dds::security_with(security::files_in((plant_ / identity).string())));
  }
  // Makes participants that read the topic until one receives the sample, and ends it.
  bool joins_and_leaves() {
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const auto viewer = join("victor");
      if (!viewer->ok())
        return false;
      DataReader* const reader = viewer->reader<v1::NodeStatePubSubType>(v1::TOPIC_NODE_STATE);
      if (reader != nullptr && reader->wait_for_unread_message({kOneAttempt.count(), 0}))
        return true;
    }
    return false;
  }

  const std::filesystem::path top_ =
      std::filesystem::path(testing::TempDir()) / ("sent-tokens-" + std::to_string(::getpid()));
  const std::filesystem::path plant_ = top_ / "plant";
  std::vector<Diagnostic> diagnostics_;
};

TEST_F(SentTokens, AreNotKeptForEver) {
  constexpr std::size_t kViewers = 6;
  constexpr std::chrono::seconds kLease{6};  // of the profile: 5 s
  constexpr std::size_t kWriters = 10;
  const auto gateway = join("plant");
  ASSERT_TRUE(gateway->ok());
  v1::NodeState sample;
  sample.gateway("plant");
  DataWriter* writer = nullptr;
  for (std::size_t i = 0; i < kWriters; ++i) {
    writer = gateway->writer<v1::NodeStatePubSubType>(v1::TOPIC_NODE_STATE);
    ASSERT_NE(writer, nullptr);
    ASSERT_TRUE(writer->write(&sample));
  }
  std::array<std::uint8_t, 12> prefix{};
  std::copy_n(writer->guid().guidPrefix.value, prefix.size(), prefix.begin());
  for (std::size_t viewer = 0; viewer < kViewers; ++viewer)
    ASSERT_TRUE(joins_and_leaves()) << viewer;
  // What a participant has not acknowledged is kept until its lease has expired.
  const std::size_t kept = dds::guard::kept_tokens(prefix);
  EXPECT_GE(kept, kWriters);
  EXPECT_TRUE(eventually([&] {
    std::this_thread::sleep_for(kLease);
    return joins_and_leaves() && dds::guard::kept_tokens(prefix) < kept;
  })) << "still more than "
      << kept;
}

}  // namespace
}  // namespace linegate::test
