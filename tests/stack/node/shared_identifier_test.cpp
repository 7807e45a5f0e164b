// SPDX-License-Identifier: Apache-2.0
// Several services have the same identifier, and the first one changes the receivers while it
// processes a frame. Each service that was a receiver when the frame arrived, and still is one,
// receives it once; no other service does.
#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

constexpr std::uint32_t kShared = 0x205;
constexpr std::uint8_t kDownload = 0x23;  // first byte of a request that writes 4 bytes

// The server of 1201h and both RPDOs have the same identifier: a request is also process data.
class SharedIdentifierTest : public NodeTest {
 protected:
  SharedIdentifierTest() {
    using enum od::DataType;
    od::Dictionary dictionary = example_dictionary();
    (void)dictionary
        .add(testing::record(
            0x1201, {testing::sub(0, unsigned8, 2, od::Access::constant),
                     testing::sub(1, unsigned32, kShared), testing::sub(2, unsigned32, 0x285)}))
        .ok();
    dictionary.set(od::Address{0x1401, 1}, kShared);
    dictionary.set(od::Address{0x1401, 2}, std::uint8_t{255});
    node =
        std::make_unique<Node>(std::move(dictionary), Options{.node_id = kNodeId}, events, nullptr);
    boot_and_start();
  }

  // Requests a download of 4 bytes, or 1, from the server of 1201h.
  void request(std::uint8_t command, od::Address address, std::uint32_t value) {
    hear(1ms, kShared,
         {command, static_cast<std::uint8_t>(address.index),
          static_cast<std::uint8_t>(address.index >> 8), address.sub,
          static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
          static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 24)});
  }
  std::vector<std::uint64_t> values() { return {number(0x2000, 1), number(0x2000, 2)}; }
  std::uint64_t received() { return node->pdos().counters().received; }
};

using Values = std::vector<std::uint64_t>;

TEST_F(SharedIdentifierTest, AllGetTheFrame) {
  request(kDownload, {0x2001, 1}, 0);
  EXPECT_EQ(values(), (Values{0x0123, 0x0123}));
  EXPECT_EQ(received(), 2U);
}

TEST_F(SharedIdentifierTest, OneThatIsMadeAnewHidesNobody) {
  request(kDownload | 3 << 2, {0x1400, 2}, 254);
  EXPECT_EQ(number(0x1400, 2), 254U);
  EXPECT_EQ(values(), (Values{0x1111, 0x002F}));
  EXPECT_EQ(received(), 1U);
}

TEST_F(SharedIdentifierTest, OneThatIsTakenAwayGetsNothing) {
  request(kDownload, {0x1400, 1}, 0x8000'0205);
  EXPECT_EQ(values(), (Values{0x1111, 0x0023}));
  EXPECT_EQ(received(), 1U);
}

TEST_F(SharedIdentifierTest, OneThatIsAddedGetsNothingYet) {
  request(kDownload, {0x1028, 7}, kShared);
  EXPECT_EQ(received(), 2U);
  const auto is_emcy = [](const Event& event) { return event.kind() == EventKind::emcy; };
  EXPECT_EQ(std::ranges::count_if(testing::pop_events(events), is_emcy), 0);
  hear(2ms, kShared, {0, 0x10, 1, 0, 0, 0, 0, 0});
  EXPECT_EQ(std::ranges::count_if(testing::pop_events(events), is_emcy), 1);
}

}  // namespace
}  // namespace linegate::node
