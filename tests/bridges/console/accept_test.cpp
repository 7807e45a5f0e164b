// SPDX-License-Identifier: Apache-2.0
// `linegate accept` against a simulated gateway.
#include "bridges/console/accept.h"

#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/manager/state.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using testing::HasSubstr;

const LineId kAcceptLine{"plant", "hall"};

// Node 5 of the line has the identity `device`. A boot process compares it with the expected one.
class AcceptingGateway : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView view{.interface_uri = "virtual:hall", .access = "all"};
    view.state.network_id = 3;
    listener.on_line(kAcceptLine, view);
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    Answer answer;
    if (const auto* const read = std::get_if<line::SdoRead>(&command.request)) {
      const auto known = device.find(read->address);
      if (known == device.end()) {
        answer.reply.error = {Domain::sdo, static_cast<std::uint32_t>(AbortCode::no_sub_index)};
        answer.text = "no such sub-index";
      } else {
        std::vector<std::byte> value(4);
        store_le(value.data(), known->second);
        answer.reply.data = std::move(value);
      }
    } else if (const auto* const write = std::get_if<line::LocalWrite>(&command.request)) {
      EXPECT_EQ(write->address.sub, 5);
      expected[write->address.index] = load_le<std::uint32_t>(write->data.data());
    } else {
      booted = std::get<line::Boot>(command.request).node;
      answer.reply.data =
          std::vector{manager::BootOutcome{.node = 5, .letter = manager::kBooted, .finding = {}}};
    }
    return answer;
  }

  std::map<od::Address, std::uint32_t> device{
      {{0x1000, 0}, 0x20192}, {{0x1018, 1}, 0x123}, {{0x1018, 2}, 0x42}, {{0x1018, 4}, 502}};
  std::map<std::uint16_t, std::uint32_t> expected;
  unsigned booted = 0;
};

using Accept = test::CommandTest<AcceptingGateway>;

TEST_F(Accept, TheIdentityOfTheDeviceIsExpectedAndTheNodeBooted) {
  EXPECT_EQ(accept(context_, "hall:5"), kDone) << err_.str();
  const std::map<std::uint16_t, std::uint32_t> wanted{
      {0x1F84, 0x20192}, {0x1F85, 0x123}, {0x1F86, 0x42}, {0x1F87, 0}, {0x1F88, 502}};
  EXPECT_EQ(gateway_.expected, wanted);
  EXPECT_EQ(gateway_.booted, 5U);
  EXPECT_THAT(err_.str(), HasSubstr("serial: 502"));
  EXPECT_THAT(out_.str(), HasSubstr("booted"));
}

TEST_F(Accept, ANodeThatDoesNotSayWhoItIsIsNot) {
  gateway_.device.erase({0x1018, 1});
  EXPECT_EQ(accept(context_, "hall:5"), kFailed);
  EXPECT_TRUE(gateway_.expected.empty());
  EXPECT_EQ(gateway_.booted, 0U);
  EXPECT_THAT(err_.str(), HasSubstr("vendor-ID of node 5: no such sub-index"));
}

TEST_F(Accept, IsForOneNode) {
  for (const char* what : {"hall", "hall:all", "hall:own", "hall:200"}) {
    EXPECT_EQ(accept(context_, what), kUsage) << what;
  }
}

}  // namespace
}  // namespace linegate::console
