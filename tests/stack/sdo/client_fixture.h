// SPDX-License-Identifier: Apache-2.0
// A client whose responses are given byte by byte.
#pragma once

#include "stack/sdo/client.h"

#include "tests/stack/sdo/support.h"

namespace linegate::sdo::test {

class ClientTest : public testing::Test {
 protected:
  Frames read(od::Address address, TransferOptions options = {}) {
    client.read(address, kTimeout, now, queue, options);
    return drain(queue, kRequestId);
  }
  Frames write(od::Address address, std::vector<std::byte> data, TransferOptions options = {}) {
    client.write(address, std::move(data), kTimeout, now, queue, options);
    return drain(queue, kRequestId);
  }
  // The requests that follow one response.
  Frames answer(const Bytes& data, Receipt expected = Receipt::used) {
    EXPECT_EQ(client.receive(frame(kResponseId, data, now), queue), expected);
    return drain(queue, kRequestId);
  }
  void expect_data(const Bytes& data) {
    const std::optional<Outcome> outcome = client.take();
    ASSERT_TRUE(outcome.has_value());
    EXPECT_EQ(outcome->abort, AbortCode::none);
    EXPECT_EQ(numbers(outcome->data), data);
    EXPECT_FALSE(client.busy());
    EXPECT_EQ(client.next_wake(), kNever);
  }
  void expect_abort(AbortCode code) {
    const std::optional<Outcome> outcome = client.take();
    ASSERT_TRUE(outcome.has_value());
    EXPECT_EQ(outcome->abort, code);
    EXPECT_TRUE(outcome->data.empty());
    EXPECT_FALSE(client.busy());
  }

  static constexpr Duration kTimeout = std::chrono::milliseconds(500);

  can::TransmitQueue queue{4};
  Client client{can::CobId{kRequestId}};
  Instant now = at(1s);
};

}  // namespace linegate::sdo::test
