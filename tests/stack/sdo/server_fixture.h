// SPDX-License-Identifier: Apache-2.0
// A server with the test dictionary; requests and responses are given byte by byte.
#pragma once

#include "stack/sdo/server.h"

#include "tests/stack/sdo/support.h"

namespace linegate::sdo::test {

class ServerTest : public testing::Test {
 protected:
  // The response to one request; empty if there is none.
  Bytes ask(const Bytes& request) {
    server.receive(frame(kRequestId, request, now), queue);
    const std::vector<Bytes> answers = drain(queue, kResponseId);
    EXPECT_LE(answers.size(), 1U);
    return answers.empty() ? Bytes{} : answers.front();
  }

  Bytes value(od::Address address) { return numbers(dictionary.find(address)->bytes()); }

  static constexpr Duration kTimeout = std::chrono::milliseconds(300);

  od::Dictionary dictionary{device()};
  EventLog events;
  can::TransmitQueue queue{4};
  Server server{dictionary,
                can::CobId{kRequestId},
                can::CobId{kResponseId},
                events,
                {.timeout = kTimeout, .max_transfer = 20'000}};
  Instant now = at(1s);
};

}  // namespace linegate::sdo::test
