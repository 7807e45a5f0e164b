// SPDX-License-Identifier: Apache-2.0
// Output values between two processes, and the ownership of a group.
#include <thread>

#include <gtest/gtest.h>

#include "tests/dds/fixtures.h"

namespace linegate::test {
namespace {

line::OutputWrite output(std::uint32_t entry) {
  line::OutputWrite write;
  write.group = 2;
  write.layout_id = 0xABC;
  write.arming = 3;
  write.watchdog = std::chrono::milliseconds(250);
  write.reactions = line::kZeroOutputs | line::kSendEmcy;
  write.values.push_back({entry, 2, {std::byte{0x12}, std::byte{0x34}}});
  write.bytes.push_back({64, std::vector<std::byte>(5'000)});
  return write;
}

std::unique_ptr<dds::Client> writer(const std::string& name, std::uint32_t strength) {
  dds::ClientOptions options = client_options(name);
  options.outputs = true;
  options.output_strength = strength;
  return make_client(options);
}

TEST(Outputs, AWriteArrivesWhole) {
  Peer gateway("gateway");
  ASSERT_FALSE(gateway.expect("ready").empty());
  const auto client = writer("plc", 1);
  ASSERT_NE(client, nullptr);
  std::string line;
  eventually([&] {
    EXPECT_TRUE(client->write_outputs(known_line(), output(7)));
    line = gateway.expect("output", std::chrono::milliseconds(100));
    return !line.empty();
  });
  EXPECT_EQ(line,
            "output line=line1 client=plc group=2 layout=abc arming=3 watchdog=250000000 "
            "reactions=21 value=7:1234 bytes=64:5000");
}

TEST(Outputs, TheStrongerWriterOwnsTheGroupUntilItIsGone) {
  Peer gateway("gateway");
  ASSERT_FALSE(gateway.expect("ready").empty());
  const auto weak = writer("weak", 1);
  auto strong = writer("strong", 10);
  ASSERT_TRUE(weak != nullptr && strong != nullptr);
  ASSERT_TRUE(eventually([&] {
    strong->write_outputs(known_line(), output(1));
    return !gateway.expect("output line=line1 client=strong", std::chrono::milliseconds(50))
                .empty();
  }));
  ASSERT_TRUE(eventually([&] { return weak->output_peers() == 1; }));
  // Each weak write is followed by a strong one: when the strong one arrives and no weak one
  // preceded it, the weak one was filtered.
  for (int i = 0; i < 10; ++i) {
    weak->write_outputs(known_line(), output(100));
    strong->write_outputs(known_line(), output(200 + static_cast<std::uint32_t>(i)));
    ASSERT_FALSE(gateway.expect("output line=line1 client=strong").empty());
  }
  strong.reset();
  EXPECT_TRUE(eventually([&] {
    weak->write_outputs(known_line(), output(300));
    return !gateway.expect("output line=line1 client=weak", std::chrono::milliseconds(50)).empty();
  }));
}

// The last samples of each round are weak ones, and the gateway reads after them: weaker samples
// must not replace the owner's newest unread one.
TEST(Outputs, AWeakWriterDoesNotSilenceTheOwner) {
  using std::chrono::milliseconds;
  constexpr std::uint32_t kRounds = 50;
  constexpr std::uint32_t kWrites = 20;  // of each writer in a round, at 1 kHz
  Peer gateway("slow_gateway");
  ASSERT_FALSE(gateway.expect("ready").empty());
  const auto strong = writer("strong", 10);
  const auto weak = writer("weak", 1);
  ASSERT_TRUE(weak != nullptr && strong != nullptr);
  ASSERT_TRUE(eventually([&] { return weak->output_peers() == 1; }));
  ASSERT_TRUE(eventually([&] {
    strong->write_outputs(known_line(), output(0));
    return !gateway.expect("output line=line1 client=strong", milliseconds(50)).empty();
  }));
  std::uint32_t arrived = 0;
  std::uint32_t number = 0;
  auto time = std::chrono::steady_clock::now();
  for (std::uint32_t round = 0; round < kRounds; ++round) {
    for (std::uint32_t i = 0; i < kWrites; ++i) {
      strong->write_outputs(known_line(), output(++number));
      weak->write_outputs(known_line(), output(0));
      std::this_thread::sleep_until(time += milliseconds(1));
    }
    for (int i = 0; i < 5; ++i)
      weak->write_outputs(known_line(), output(0));
    const std::string newest = " value=" + std::to_string(number) + ":";
    std::string line;
    do {
      line = gateway.expect("output ");
      EXPECT_EQ(line.find("client=weak"), std::string::npos);
    } while (!line.empty() && line.find(newest) == std::string::npos);
    arrived += line.empty() ? 0U : 1U;
    time = std::chrono::steady_clock::now();
  }
  EXPECT_EQ(arrived, kRounds) << "rounds after which the owner's newest sample arrived";
}

TEST(Outputs, BeyondTheBoundsIsNotSent) {
  const auto client = writer("plc", 1);
  ASSERT_NE(client, nullptr);
  line::OutputWrite write = output(1);
  write.values.resize(4'097);
  EXPECT_FALSE(client->write_outputs(known_line(), write));
}

}  // namespace
}  // namespace linegate::test
