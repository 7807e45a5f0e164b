// SPDX-License-Identifier: Apache-2.0
// Messages of a secured participant that are as full as the library makes them: it resends the
// newest samples of a topic to a reader that joins late, as many in one message as there is room
// for, and encrypts the message afterwards.
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>
#include <unistd.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/publisher.h"
#include "gateway/security/authority.h"
#include "gateway/security/files.h"
#include "gateway/security/fingerprint.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

namespace folders = std::filesystem;
using eprosima::fastdds::dds::DataReader;
using security::Role;

constexpr std::uint8_t kNodes = 127;
constexpr std::size_t kReaders = 40;

class FullMessages : public testing::Test {
 protected:
  FullMessages() {
    EXPECT_EQ(security::init(plant_.string()), "");
    EXPECT_EQ(security::issue(plant_.string(), {{"plant", Role::gateway, {"*/*"}}, 60}), "");
    EXPECT_EQ(security::issue(plant_.string(), {{"victor", Role::viewer, {"*/*"}}, 60}), "");
  }
  ~FullMessages() override { folders::remove_all(top_); }

  dds::Security security_of(const char* identity) const {
    return dds::security_with(security::files_in((plant_ / identity).string()));
  }
  void start_gateway() {
    dds::GatewayOptions options{"plant", 1, domain(), paths::kLoopbackProfiles, {"press", "hall"}};
    options.last_words = std::chrono::milliseconds(0);
    options.security = security_of("plant");
    options.security.request_partition = security::requests_of_gateway("plant");
    options.security.is_holder = security::is_holder;
    auto made = dds::GatewayBridge::make(options);
    ASSERT_TRUE(made.ok());
    bridge_ = std::move(*made.value);
  }
  // Each sample has a name of that length.
  void publish_nodes(std::size_t length) {
    for (const char* line : {"press", "hall"}) {
      for (std::uint8_t node = 1; node <= kNodes; ++node) {
        line::NodeState state = known::node_state();
        state.node = node;
        ASSERT_TRUE(bridge_->publish(line, dds::NodeInfo{std::string(length, 'n'), known::at(5)},
                                     state, known::at(6)));
      }
    }
  }
  // Whether a new reader receives all nodes with names of that length.
  static bool receives_all(dds::Endpoints& viewer, std::size_t length,
                           std::chrono::nanoseconds deadline = kDeadline) {
    DataReader* const reader = viewer.reader<v1::NodeStatePubSubType>(v1::TOPIC_NODE_STATE);
    std::map<std::string, std::size_t> lengths;  // of the names, by line and node-ID
    const bool all = eventually(
        [&] {
          v1::NodeState sample;
          eprosima::fastdds::dds::SampleInfo info;
          while (reader->take_next_sample(&sample, &info) ==
                 eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
            if (info.valid_data)
              lengths[std::string(sample.line()) + std::to_string(sample.node())] =
                  sample.name().size();
          }
          std::size_t count = 0;
          for (const auto& [name, of] : lengths)
            count += of == length ? 1U : 0U;
          return count == std::size_t{2} * kNodes;
        },
        deadline);
    viewer.remove(reader);
    return all;
  }

  const folders::path top_ =
      folders::path(testing::TempDir()) / ("full-messages-" + std::to_string(::getpid()));
  const folders::path plant_ = top_ / "plant";
  std::unique_ptr<dds::GatewayBridge> bridge_;
};

// However much room the last sample of a message leaves: neither is a message lost, which the
// library would make again as long, nor does the library end the process.
TEST_F(FullMessages, ReachAReaderThatJoinsLate) {
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  std::unique_ptr<dds::Endpoints> viewer;
  bool connected = false;
  publish_nodes(0);
  for (int attempt = 0; attempt < kAttempts && !connected; ++attempt) {
    std::vector<Diagnostic> diagnostics;
    viewer = std::make_unique<dds::Endpoints>("viewer", domain(), paths::kLoopbackProfiles,
                                              diagnostics, true, 0, security_of("victor"));
    ASSERT_TRUE(viewer->ok());
    connected = receives_all(*viewer, 0, kOneAttempt);
  }
  ASSERT_TRUE(connected);
  for (std::size_t length = 1; length <= kReaders; ++length) {
    publish_nodes(length);
    ASSERT_TRUE(receives_all(*viewer, length)) << length;
  }
}

}  // namespace
}  // namespace linegate::test
