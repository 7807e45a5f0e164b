// SPDX-License-Identifier: Apache-2.0
#include "stack/usdo/server.h"

#include "stack/od/hook.h"

#include "tests/stack/usdo/support.h"

namespace linegate::usdo::test {
namespace {

class UsdoServerTest : public testing::Test {
 protected:
  // The answer to one request; empty if there is none.
  Bytes ask(const Bytes& request, std::uint32_t id = kRequestId) {
    server.receive(fd_frame(id, request, now), queue);
    const std::vector<Bytes> answers = drain_fd(queue, kResponseId);
    EXPECT_LE(answers.size(), 1U);
    return answers.empty() ? Bytes{} : answers.front();
  }
  std::vector<Bytes> wait(Duration time) {
    now += time;
    server.advance(now, queue);
    return drain_fd(queue, kResponseId);
  }
  Bytes value(od::Address address) { return numbers(dictionary.find(address)->bytes()); }
  // Uploads 2100h:00, which has that many bytes, up to its segments.
  Bytes begin_upload(std::size_t size, std::uint8_t session = 1) {
    EXPECT_TRUE(dictionary.set({0x2100, 0}, pattern(size)));
    return ask({5, 0x11, session, 0, 0, 0x21});
  }

  od::Dictionary dictionary{sdo::test::device()};
  EventLog events;
  can::TransmitQueue queue{4};
  Server server{dictionary, kServer, events};
  Instant now = at(1s);
};

TEST_F(UsdoServerTest, ThePublishedExample) {
  ASSERT_TRUE(dictionary.set({0x1000, 0}, std::uint32_t{0x000F'0191}));
  EXPECT_EQ(ask({0x05, 0x11, 0x01, 0x00, 0x00, 0x10}),
            (Bytes{0x01, 0x31, 0x01, 0x00, 0x00, 0x10, 0x07, 0x04, 0x91, 0x01, 0x0F, 0x00}));
  EXPECT_EQ(server.counters().uploads, 1U);
}

TEST_F(UsdoServerTest, ExpeditedDownload) {
  EXPECT_EQ(ask({5, 0x01, 3, 2, 0, 0x20, 6, 2, 0xAA, 0xBB}), (Bytes{1, 0x21, 3, 2, 0, 0x20}));
  EXPECT_EQ(value({0x2000, 2}), (Bytes{0xAA, 0xBB}));
  EXPECT_EQ(server.counters().downloads, 1U);
  EXPECT_EQ(server.next_wake(), kNever);
}

TEST_F(UsdoServerTest, EmptyValuesAreExpedited) {
  EXPECT_EQ(ask({5, 0x11, 3, 8, 0, 0x20}), (Bytes{1, 0x31, 3, 8, 0, 0x20, 9, 0}));
  EXPECT_EQ(begin_upload(0), (Bytes{1, 0x31, 1, 0, 0, 0x21, 0x0F, 0}));
  EXPECT_EQ(server.sessions(), 0U);
}

TEST_F(UsdoServerTest, SegmentedDownloadChangesTheObjectWithTheEnd) {
  EXPECT_EQ(ask({5, 0x02, 4, 0, 0, 0x21, 0x0F, 0, 122, 0, 0, 0}), (Bytes{1, 0x22, 4, 0, 0, 0x21}));
  EXPECT_EQ(ask(padded({5, 0x03, 4, 0}, numbers_from(0, 60))), (Bytes{1, 0x23, 4, 0}));
  EXPECT_EQ(ask(padded({5, 0x03, 4, 1}, numbers_from(60, 60))), (Bytes{1, 0x23, 4, 1}));
  EXPECT_EQ(value({0x2100, 0}), Bytes{});
  EXPECT_EQ(ask(padded({5, 0x04, 4, 2}, numbers_from(120, 2))), (Bytes{1, 0x24, 4}));
  EXPECT_EQ(value({0x2100, 0}), numbers_from(0, 122));
  EXPECT_EQ(server.sessions(), 0U);
}

TEST_F(UsdoServerTest, SegmentedUpload) {
  EXPECT_EQ(begin_upload(120, 2), (Bytes{1, 0x32, 2, 0, 0, 0x21, 0x0F, 0, 120, 0, 0, 0}));
  EXPECT_EQ(ask({5, 0x13, 2, 0}), padded({1, 0x33, 2, 0}, numbers_from(0, 60)));
  EXPECT_EQ(ask({5, 0x13, 2, 1}), padded({1, 0x34, 2, 60}, numbers_from(60, 60)));
  EXPECT_EQ(server.sessions(), 0U);
  EXPECT_EQ(server.counters().uploads, 1U);
}

TEST_F(UsdoServerTest, TheCounterOfSegmentsOverflowsToZero) {
  begin_upload(60 * 300);
  for (unsigned segment = 0; segment < 299; ++segment) {
    const Bytes answer = ask({5, 0x13, 1, static_cast<std::uint8_t>(segment)});
    ASSERT_EQ(answer.at(1), 0x33) << segment;
    ASSERT_EQ(answer.at(3), segment % 256) << segment;
  }
  EXPECT_EQ(ask({5, 0x13, 1, 299 % 256}).at(1), 0x34);
}

TEST_F(UsdoServerTest, TransfersOfSeveralClientsAndSessionsAtOnce) {
  ASSERT_TRUE(dictionary.set({0x1008, 0}, pattern(64)));
  begin_upload(100);
  server.receive(fd_frame(0x602, {5, 0x11, 1, 0, 8, 0x10}, now), queue);
  EXPECT_EQ(drain_fd(queue, kResponseId).front(),
            (Bytes{2, 0x32, 1, 0, 8, 0x10, 9, 0, 64, 0, 0, 0}));
  EXPECT_EQ(ask({5, 0x11, 2, 1, 0, 0x20}), padded({1, 0x31, 2, 1, 0, 0x20, 5, 1, 0x11}));
  EXPECT_EQ(server.sessions(), 2U);
  EXPECT_EQ(ask({5, 0x13, 1, 0}, 0x602), padded({2, 0x33, 1, 0}, numbers_from(0, 60)));
  EXPECT_EQ(ask({5, 0x13, 1, 0}), padded({1, 0x33, 1, 0}, numbers_from(0, 60)));
  EXPECT_EQ(ask({5, 0x13, 1, 1}, 0x602), padded({2, 0x34, 1, 4}, numbers_from(60, 4)));
  EXPECT_EQ(ask({5, 0x13, 1, 1}), padded({1, 0x34, 1, 40}, numbers_from(60, 40)));
}

TEST_F(UsdoServerTest, AnAccessOfAnotherClientToAnObjectIsRefused) {
  begin_upload(100);
  EXPECT_EQ(ask({5, 0x11, 2, 0, 0, 0x21}, 0x602), (Bytes{2, 0x7F, 2, 0, 0, 0x21, 0x62}));
  EXPECT_EQ(ask({5, 0x01, 2, 0, 0, 0x21, 0x0F, 1, 1}, 0x602),
            (Bytes{2, 0x7F, 2, 0, 0, 0x21, 0x62}));
  EXPECT_EQ(ask({5, 0x13, 1, 0}).at(1), 0x33);
  EXPECT_EQ(ask({5, 0x13, 1, 1}).at(1), 0x34);
  EXPECT_EQ(ask({5, 0x11, 2, 0, 0, 0x21}).at(1), 0x32);
}

TEST_F(UsdoServerTest, AnInitiateReplacesTheTransferOfItsSession) {
  begin_upload(100);
  EXPECT_EQ(ask({5, 0x11, 1, 1, 0, 0x20}).at(1), 0x31);
  EXPECT_EQ(server.sessions(), 0U);
  EXPECT_EQ(ask({5, 0x13, 1, 0}), (Bytes{1, 0x7F, 1, 0, 0, 0, 0x21}));
}

// A client that repeats a transfer has given the one before up; its abort may be lost.
TEST_F(UsdoServerTest, AnInitiateReplacesAnOlderTransferOfItsClientWithTheObject) {
  begin_upload(100);
  EXPECT_EQ(ask({5, 0x11, 2, 0, 0, 0x21}).at(1), 0x32);
  EXPECT_EQ(server.sessions(), 1U);
  EXPECT_EQ(ask({5, 0x13, 1, 0}), (Bytes{1, 0x7F, 1, 0, 0, 0, 0x21}));
  EXPECT_EQ(ask({5, 0x13, 2, 0}).at(1), 0x33);
  EXPECT_EQ(ask({5, 0x01, 3, 0, 0, 0x21, 0x0F, 1, 1}).at(1), 0x21);
  EXPECT_EQ(server.sessions(), 0U);
}

TEST_F(UsdoServerTest, RefusalsOfTheDictionary) {
  EXPECT_EQ(ask({5, 0x11, 1, 0, 0, 0x30}), (Bytes{1, 0x7F, 1, 0, 0, 0x30, 0x33}));
  EXPECT_EQ(ask({5, 0x11, 1, 0x0A, 0, 0x20}), (Bytes{1, 0x7F, 1, 0x0A, 0, 0x20, 0x34}));
  EXPECT_EQ(ask({5, 0x11, 1, 6, 0, 0x20}), (Bytes{1, 0x7F, 1, 6, 0, 0x20, 0x31}));
  EXPECT_EQ(ask({5, 0x01, 1, 0, 0, 0x10, 7, 4, 1, 2, 3, 4}), (Bytes{1, 0x7F, 1, 0, 0, 0x10, 0x32}));
  EXPECT_EQ(ask({5, 0x01, 1, 2, 0, 0x20, 6, 1, 1}), (Bytes{1, 0x7F, 1, 2, 0, 0x20, 0x38}));
  EXPECT_EQ(ask({5, 0x01, 1, 2, 0, 0x20, 6, 3, 1, 2, 3}), (Bytes{1, 0x7F, 1, 2, 0, 0x20, 0x37}));
  EXPECT_EQ(ask({5, 0x01, 1, 7, 0, 0x20, 3, 2, 0xFF, 0x7F}), (Bytes{1, 0x7F, 1, 7, 0, 0x20, 0x60}));
  EXPECT_EQ(ask({5, 0x02, 1, 2, 0, 0x20, 6, 0, 3, 0, 0, 0}), (Bytes{1, 0x7F, 1, 2, 0, 0x20, 0x37}));
  EXPECT_EQ(server.counters().aborts, 8U);
}

TEST_F(UsdoServerTest, AbortsOfFourBytesSayMore) {
  Server other{dictionary, kServer, events, {.abort_form = AbortForm::four_bytes}};
  other.receive(fd_frame(kRequestId, {5, 0x01, 1, 7, 0, 0x20, 3, 2, 0xFF, 0x7F}, now), queue);
  EXPECT_EQ(drain_fd(queue, kResponseId).front(),
            (Bytes{1, 0x80, 1, 7, 0, 0x20, 0x31, 0, 9, 6, 0, 0}));
}

TEST_F(UsdoServerTest, OtherReceiversAndAbortsAreNotAnswered) {
  EXPECT_EQ(ask({6, 0x11, 1, 0, 0, 0x10}), Bytes{});
  EXPECT_EQ(ask({0, 0x11, 1, 0, 0, 0x10}), Bytes{});  // to all
  EXPECT_EQ(ask({5, 0x7F, 1, 0, 0, 0x10, 0x60}), Bytes{});
  EXPECT_EQ(ask({5, 0x80, 1, 0, 0, 0x10, 0, 0, 0, 8}), Bytes{});
}

TEST_F(UsdoServerTest, AnAbortOfEitherFormEndsTheSession) {
  begin_upload(100);
  EXPECT_EQ(ask({5, 0x7F, 2, 0, 0, 0x21, 0x60}), Bytes{});
  EXPECT_EQ(server.sessions(), 1U);
  EXPECT_EQ(ask({5, 0x7F, 1, 0, 0, 0x21, 0x60}), Bytes{});
  EXPECT_EQ(server.sessions(), 0U);
  begin_upload(100);
  EXPECT_EQ(ask({5, 0x80, 1}), Bytes{});
  EXPECT_EQ(server.sessions(), 0U);
}

TEST_F(UsdoServerTest, WrongFramesEndTheTransfer) {
  begin_upload(100);
  EXPECT_EQ(ask({5, 0x13, 1, 1}), (Bytes{1, 0x7F, 1, 0, 0, 0x21, 0x14}));
  begin_upload(100);
  EXPECT_EQ(ask({5, 0x13, 1}), (Bytes{1, 0x7F, 1, 0, 0, 0x21, 0x15}));
  begin_upload(100);
  EXPECT_EQ(ask(padded({5, 0x03, 1, 0}, numbers_from(0, 60))),
            (Bytes{1, 0x7F, 1, 0, 0, 0x21, 0x13}));
  begin_upload(100);
  EXPECT_EQ(ask({5, 0x99, 1, 0}), (Bytes{1, 0x7F, 1, 0, 0, 0x21, 0x13}));
  EXPECT_EQ(server.sessions(), 0U);
}

TEST_F(UsdoServerTest, WrongFramesOfADownload) {
  const Bytes initiate{5, 0x02, 1, 0, 0, 0x21, 0x0F, 0, 61, 0, 0, 0};
  ask(initiate);
  EXPECT_EQ(ask(padded({5, 0x03, 1, 1}, numbers_from(0, 60))),
            (Bytes{1, 0x7F, 1, 0, 0, 0x21, 0x14}));
  ask(initiate);
  EXPECT_EQ(ask({5, 0x03, 1, 0, 1, 2, 3}), (Bytes{1, 0x7F, 1, 0, 0, 0x21, 0x15}));
  ask(initiate);
  EXPECT_EQ(ask({5, 0x04, 1, 10, 1, 2, 3}), (Bytes{1, 0x7F, 1, 0, 0, 0x21, 0x15}));
  ask(initiate);
  EXPECT_EQ(ask({5, 0x04, 1, 3, 1, 2, 3}), (Bytes{1, 0x7F, 1, 0, 0, 0x21, 0x38}));
  ask(initiate);
  ask(padded({5, 0x03, 1, 0}, numbers_from(0, 60)));
  EXPECT_EQ(ask({5, 0x04, 1, 2, 1, 2}), (Bytes{1, 0x7F, 1, 0, 0, 0x21, 0x37}));
  EXPECT_EQ(value({0x2100, 0}), Bytes{});
}

TEST_F(UsdoServerTest, SessionZeroAndSegmentsWithoutATransfer) {
  EXPECT_EQ(ask({5, 0x11, 0, 0, 0, 0x10}), (Bytes{1, 0x7F, 0, 0, 0, 0x10, 0x21}));
  EXPECT_EQ(ask({5, 0x13, 7, 0}), (Bytes{1, 0x7F, 7, 0, 0, 0, 0x21}));
  EXPECT_EQ(ask({5, 0x04, 7, 1, 1}), (Bytes{1, 0x7F, 7, 0, 0, 0, 0x21}));
}

TEST_F(UsdoServerTest, InitiatesWithoutTheirFields) {
  EXPECT_EQ(ask({5, 0x11, 1, 0, 0}), (Bytes{1, 0x7F, 1, 0, 0, 0, 0x15}));
  EXPECT_EQ(ask({5, 0x02, 1, 0, 0, 0x21, 0x0F}), (Bytes{1, 0x7F, 1, 0, 0, 0, 0x15}));
  EXPECT_EQ(ask({5, 0x01, 1, 2, 0, 0x20, 6, 9, 1, 2}), (Bytes{1, 0x7F, 1, 2, 0, 0x20, 0x15}));
}

TEST_F(UsdoServerTest, FramesThatAreNotUsdoAreCountedAndReported) {
  server.receive(can::make_frame(kRequestId, {5, 0x11, 1, 0, 0, 0x10}), queue);
  server.receive(fd_frame(kRequestId, {5, 0x11}), queue);
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(server.counters().malformed, 2U);
  EXPECT_EQ(sdo::test::drain(events).size(), 2U);
}

TEST_F(UsdoServerTest, ASilentClientTimesOut) {
  begin_upload(200);
  now += 900ms;
  EXPECT_EQ(ask({5, 0x13, 1, 0}).at(1), 0x33);
  EXPECT_EQ(wait(999ms), std::vector<Bytes>{});
  EXPECT_EQ(wait(1ms), (std::vector<Bytes>{{1, 0x7F, 1, 0, 0, 0x21, 0x60}}));
  EXPECT_EQ(server.next_wake(), kNever);
}

TEST_F(UsdoServerTest, AFloodOfSessionsIsRefusedAndEnds) {
  for (std::uint16_t index = 0x2200; index < 0x2200 + 200; ++index) {
    auto object = sdo::test::object(
        index, {sdo::test::variable(0, od::DataType::domain, od::Access::rw, {})});
    ASSERT_TRUE(dictionary.add(object).ok());
    ASSERT_TRUE(dictionary.set({index, 0}, pattern(100)));
    const auto low = static_cast<std::uint8_t>(index);
    const Bytes answer = ask({5, 0x11, static_cast<std::uint8_t>(low + 1U), 0, low, 0x22});
    EXPECT_EQ(answer.at(1), low < Server::kSessions ? 0x32 : 0x7F) << index;
    EXPECT_TRUE(low < Server::kSessions || answer.at(6) == 0x60);
  }
  EXPECT_EQ(server.sessions(), Server::kSessions);
  // What needs no session is served.
  EXPECT_EQ(ask({5, 0x11, 255, 0, 0, 0x10}).at(1), 0x31);
  (void)wait(1s);
  EXPECT_EQ(server.sessions(), 0U);
}

TEST_F(UsdoServerTest, AFullQueueDelaysAnswers) {
  const can::Frame request = fd_frame(kRequestId, {5, 0x11, 1, 0, 0, 0x10}, now);
  for (unsigned i = 0; i < 6; ++i) {
    server.receive(request, queue);
  }
  EXPECT_EQ(drain_fd(queue, kResponseId).size(), 4U);
  EXPECT_EQ(server.next_wake(), now + 1ms);
  EXPECT_EQ(wait(1ms).size(), 2U);
}

TEST_F(UsdoServerTest, ResetDropsEverything) {
  begin_upload(100);
  server.reset();
  EXPECT_EQ(server.sessions(), 0U);
  EXPECT_EQ(wait(10s), std::vector<Bytes>{});
}

// Resets the server in each call: an application may reset its node.
class ResettingHook final : public od::Hook, public od::ByteSink, public od::ByteSource {
 public:
  explicit ResettingHook(Server& server) : server_(server) {}
  void written(od::Address /*address*/) override { server_.reset(); }
  Result<od::ByteSource*> open_source(od::Address /*address*/) override {
    reset_if(at_open);
    return streams ? static_cast<od::ByteSource*>(this) : nullptr;
  }
  Result<od::ByteSink*> open_sink(od::Address /*address*/,
                                  std::optional<std::uint32_t> /*size*/) override {
    reset_if(at_open);
    return streams ? static_cast<od::ByteSink*>(this) : nullptr;
  }
  AbortCode write(std::span<const std::byte> /*piece*/) override {
    server_.reset();
    return AbortCode::none;
  }
  AbortCode finish() override { return AbortCode::none; }
  void cancelled(AbortCode /*why*/) override { ++ends; }
  void cancelled(od::Ticket /*ticket*/) override {}
  std::optional<std::uint32_t> size() const override { return std::nullopt; }
  Result<std::size_t> read(std::span<std::byte> out) override {
    server_.reset();
    return out.size();
  }
  void closed(AbortCode /*why*/) override { ++ends; }

  bool streams = true;
  bool at_open = false;
  unsigned ends = 0;

 private:
  void reset_if(bool wanted) {
    if (wanted) {
      server_.reset();
    }
  }
  Server& server_;
};

TEST_F(UsdoServerTest, AHookOrStreamMayResetTheServer) {
  ResettingHook hook(server);
  ASSERT_TRUE(dictionary.set_hook(0x2100, &hook).ok());
  // An upload and a download into streams, a download of a value in the dictionary.
  EXPECT_EQ(ask({5, 0x11, 1, 0, 0, 0x21}).at(1), 0x32);
  EXPECT_EQ(ask({5, 0x13, 1, 0}), Bytes{});
  EXPECT_EQ(hook.ends, 1U);
  EXPECT_EQ(ask({5, 0x02, 2, 0, 0, 0x21, 0x0F, 0, 10, 0, 0, 0}).at(1), 0x22);
  EXPECT_EQ(ask({5, 0x04, 2, 10, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}), Bytes{});
  EXPECT_EQ(hook.ends, 2U);
  hook.at_open = true;
  EXPECT_EQ(ask({5, 0x02, 3, 0, 0, 0x21, 0x0F, 0, 10, 0, 0, 0}), Bytes{});
  EXPECT_EQ(hook.ends, 3U);
  EXPECT_EQ(ask({5, 0x11, 4, 0, 0, 0x21}), Bytes{});
  EXPECT_EQ(hook.ends, 4U);
  hook.at_open = hook.streams = false;
  EXPECT_EQ(ask({5, 0x02, 5, 0, 0, 0x21, 0x0F, 0, 10, 0, 0, 0}).at(1), 0x22);
  EXPECT_EQ(ask({5, 0x04, 5, 10, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}), Bytes{});
  EXPECT_EQ(value({0x2100, 0}).size(), 10U);
  EXPECT_EQ(server.sessions(), 0U);
  ASSERT_TRUE(dictionary.set_hook(0x2100, nullptr).ok());
}

// Defers every access.
class LaterHook final : public od::Hook {
 public:
  AbortCode before_read(od::Address /*address*/, const od::Variable& /*variable*/) override {
    return od::kLater;
  }
  AbortCode check_write(od::Address /*address*/, std::span<const std::byte> /*value*/) override {
    return od::kLater;
  }
  void put_off(od::Address /*address*/, od::Ticket ticket) override { tickets.push_back(ticket); }
  void cancelled(od::Ticket ticket) override { cancels.push_back(ticket); }

  std::vector<od::Ticket> tickets;
  std::vector<od::Ticket> cancels;
};

class UsdoLaterTest : public UsdoServerTest {
 protected:
  UsdoLaterTest() { EXPECT_TRUE(dictionary.set_hook(0x2000, &hook).ok()); }
  LaterHook hook;
};

TEST_F(UsdoLaterTest, UploadsAreAnsweredWhenTheHookHasTheValue) {
  EXPECT_EQ(ask({5, 0x11, 1, 1, 0, 0x20}), Bytes{});
  EXPECT_EQ(ask({5, 0x11, 2, 0, 0, 0x10}).at(1), 0x31);  // others go on
  ASSERT_EQ(hook.tickets.size(), 1U);
  ASSERT_TRUE(dictionary.complete(hook.tickets[0], AbortCode::none));
  EXPECT_EQ(server.next_wake(), Instant{});
  EXPECT_EQ(wait(1ms), (std::vector<Bytes>{padded({1, 0x31, 1, 1, 0, 0x20, 5, 1, 0x11})}));
  EXPECT_EQ(server.sessions(), 0U);
}

TEST_F(UsdoLaterTest, DownloadsAreStoredThen) {
  EXPECT_EQ(ask({5, 0x01, 1, 1, 0, 0x20, 5, 1, 0x77}), Bytes{});
  EXPECT_EQ(ask({5, 0x02, 2, 5, 0, 0x20, 0x1B, 0, 8, 0, 0, 0}).at(1), 0x22);
  EXPECT_EQ(ask({5, 0x04, 2, 8, 9, 9, 9, 9, 9, 9, 9, 9}), Bytes{});
  ASSERT_EQ(hook.tickets.size(), 2U);
  ASSERT_TRUE(dictionary.complete(hook.tickets[0], AbortCode::none));
  ASSERT_TRUE(dictionary.complete(hook.tickets[1], AbortCode::local_control));
  EXPECT_THAT(wait(1ms), testing::UnorderedElementsAre(Bytes{1, 0x21, 1, 1, 0, 0x20},
                                                       Bytes{1, 0x7F, 2, 5, 0, 0x20, 0x60}));
  EXPECT_EQ(value({0x2000, 1}), Bytes{0x77});
  EXPECT_EQ(value({0x2000, 5}), (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST_F(UsdoLaterTest, ARequestThatTheBusDoublesTakesEffectOnce) {
  EXPECT_EQ(ask({5, 0x01, 1, 1, 0, 0x20, 5, 1, 0x77}), Bytes{});
  EXPECT_EQ(ask({5, 0x01, 1, 1, 0, 0x20, 5, 1, 0x77}), Bytes{});
  EXPECT_EQ(ask({5, 0x02, 2, 5, 0, 0x20, 0x1B, 0, 8, 0, 0, 0}).at(1), 0x22);
  EXPECT_EQ(ask({5, 0x04, 2, 8, 9, 9, 9, 9, 9, 9, 9, 9}), Bytes{});
  EXPECT_EQ(ask({5, 0x04, 2, 8, 9, 9, 9, 9, 9, 9, 9, 9}), Bytes{});
  EXPECT_TRUE(hook.cancels.empty());
  ASSERT_EQ(hook.tickets.size(), 2U);
  ASSERT_TRUE(dictionary.complete(hook.tickets[0], AbortCode::none));
  ASSERT_TRUE(dictionary.complete(hook.tickets[1], AbortCode::none));
  EXPECT_EQ(wait(1ms).size(), 2U);
}

TEST_F(UsdoLaterTest, AHookThatNeverAnswersIsGivenUp) {
  EXPECT_EQ(ask({5, 0x11, 1, 1, 0, 0x20}), Bytes{});
  EXPECT_EQ(wait(10s), (std::vector<Bytes>{{1, 0x7F, 1, 1, 0, 0x20, 0x60}}));
  EXPECT_EQ(hook.cancels, hook.tickets);
}

// 60h would state that the value is not stored. The time-out of the client states that it may be.
TEST_F(UsdoLaterTest, AWriteWithAnUnknownResultIsNotAborted) {
  EXPECT_EQ(ask({5, 0x01, 1, 1, 0, 0x20, 5, 1, 0x77}), Bytes{});
  EXPECT_EQ(ask({5, 0x02, 2, 5, 0, 0x20, 0x1B, 0, 8, 0, 0, 0}).at(1), 0x22);
  EXPECT_EQ(ask({5, 0x04, 2, 8, 9, 9, 9, 9, 9, 9, 9, 9}), Bytes{});
  EXPECT_EQ(wait(10s), std::vector<Bytes>{});
  EXPECT_EQ(hook.cancels.size(), 2U);
  EXPECT_EQ(server.sessions(), 0U);
  EXPECT_EQ(server.counters().aborts, 2U);
}

// It has a code for a time-out.
TEST_F(UsdoLaterTest, AWriteWithAnUnknownResultIsATimeOutInTheOtherForm) {
  Server other(dictionary, 5, events, {.abort_form = AbortForm::four_bytes});
  other.receive(fd_frame(kRequestId, {5, 0x01, 1, 1, 0, 0x20, 5, 1, 0x77}, now), queue);
  now += 10s;
  other.advance(now, queue);
  EXPECT_EQ(drain_fd(queue, kResponseId),
            (std::vector<Bytes>{padded({1, 0x80, 1, 1, 0, 0x20, 0, 0, 0x04, 0x05})}));
}

TEST_F(UsdoLaterTest, AnAbortOfTheClientAndASegmentEndTheWaiting) {
  EXPECT_EQ(ask({5, 0x11, 1, 1, 0, 0x20}), Bytes{});
  EXPECT_EQ(ask({5, 0x7F, 1, 1, 0, 0x20, 0x60}), Bytes{});
  EXPECT_EQ(ask({5, 0x11, 2, 1, 0, 0x20}), Bytes{});
  EXPECT_EQ(ask({5, 0x13, 2, 0}), (Bytes{1, 0x7F, 2, 1, 0, 0x20, 0x13}));
  EXPECT_EQ(hook.cancels, hook.tickets);
  EXPECT_EQ(server.sessions(), 0U);
}

}  // namespace
}  // namespace linegate::usdo::test
