// SPDX-License-Identifier: Apache-2.0
// Client and server together.
#include <optional>

#include "stack/usdo/client.h"
#include "stack/usdo/server.h"

#include "tests/stack/usdo/support.h"

namespace linegate::usdo::test {
namespace {

class UsdoPair : public testing::Test {
 protected:
  static constexpr od::Address kDomain{0x2100, 0};

  // Runs until the transfer has ended. The frame with that number, from 0, is lost.
  sdo::Outcome run(std::optional<unsigned> lost = {}) {
    frames = 0;
    for (unsigned step = 0; step < 100'000; ++step) {
      if (std::optional<sdo::Outcome> outcome = client.take()) {
        return std::move(*outcome);
      }
      if (!pass(lost)) {
        now = earlier(client.next_wake(), server.next_wake());
        client.advance(now, to_server);
        server.advance(now, to_client);
      }
    }
    ADD_FAILURE() << "the transfer does not end";
    return {};
  }

  bool pass(std::optional<unsigned> lost) {
    can::Frame next;
    if (to_server.pop_rest(next)) {
      next.time = now;
      if (frames++ != lost) {
        server.receive(next, to_client);
      }
      return true;
    }
    if (to_client.pop_rest(next)) {
      next.time = now;
      if (frames++ != lost) {
        client.receive(next, to_server);
      }
      return true;
    }
    return false;
  }

  void read(sdo::TransferOptions options = {}) {
    client.read(kDomain, 100ms, now, to_server, options);
  }
  void write(std::size_t size, sdo::TransferOptions options = {}) {
    client.write(kDomain, pattern(size), 100ms, now, to_server, options);
  }
  Bytes stored() { return numbers(dictionary.find(kDomain)->bytes()); }

  od::Dictionary dictionary{sdo::test::device()};
  EventLog events;
  can::TransmitQueue to_server{4};
  can::TransmitQueue to_client{4};
  Client client{kClient, kServer};
  Server server{dictionary, kServer, events};
  unsigned frames = 0;
  Instant now = at(1s);
};

TEST_F(UsdoPair, EverySizeThereAndBack) {
  for (std::size_t size = 0; size <= 200; ++size) {
    write(size);
    EXPECT_EQ(run().abort, AbortCode::none) << size;
    EXPECT_EQ(stored(), numbers_from(0, size));
    read();
    const sdo::Outcome outcome = run();
    EXPECT_EQ(outcome.abort, AbortCode::none) << size;
    EXPECT_EQ(numbers(outcome.data), numbers_from(0, size));
    EXPECT_EQ(server.sessions(), 0U);
  }
}

TEST_F(UsdoPair, LongValues) {
  write(100'000);
  EXPECT_EQ(run().abort, AbortCode::none);
  EXPECT_EQ(frames, 2U * (1 + 1667));
  read();
  EXPECT_EQ(numbers(run().data), numbers_from(0, 100'000));
}

TEST_F(UsdoPair, AnyLostFrameOfAnUploadIsRepeated) {
  ASSERT_TRUE(dictionary.set(kDomain, pattern(200)));
  for (unsigned lost = 0; lost < 10; ++lost) {
    read({.repeats = 1});
    EXPECT_EQ(numbers(run(lost).data), numbers_from(0, 200)) << lost;
  }
}

TEST_F(UsdoPair, AnyLostFrameOfADownloadIsRepeatedButItsEnd) {
  for (unsigned lost = 0; lost < 10; ++lost) {
    write(200, {.repeats = 1});
    const AbortCode abort = run(lost).abort;
    EXPECT_EQ(abort, lost < 8 ? AbortCode::none : AbortCode::timeout) << lost;
    if (lost < 8) {
      EXPECT_EQ(stored(), numbers_from(0, 200));
    }
    now += 2s;
    server.advance(now, to_client);
    to_client.clear();
  }
}

TEST_F(UsdoPair, StreamsOfTheClient) {
  sdo::test::AcknowledgedSource source(150);
  client.write(kDomain, source, 100ms, now, to_server, {});
  EXPECT_EQ(run().abort, AbortCode::none);
  EXPECT_EQ(stored(), numbers_from(0, 150));
  EXPECT_EQ(source.counts, (std::vector<std::size_t>{60, 120, 150}));
}

}  // namespace
}  // namespace linegate::usdo::test
