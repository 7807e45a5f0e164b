// SPDX-License-Identifier: Apache-2.0
// Streams that complete later, or whose hook does (split indication): at any point the transfer
// waits and then continues normally.
#include "tests/stack/sdo/block_frames.h"
#include "tests/stack/sdo/pair_fixture.h"

namespace linegate::sdo::test {
namespace {

constexpr std::uint16_t kDomainIndex = 0x2100;
constexpr od::Address kLateDomain{kDomainIndex, 0};
constexpr std::size_t kSize = 5000;  // several windows
constexpr Duration kDelay = std::chrono::milliseconds(50);

// The calls that may complete later.
enum class Place : std::uint8_t { open, piece, finish };

// A source that returns a pattern, and a sink that checks it. Each call at `place` is deferred
// once, and executed when it is repeated or completed.
class LaterStreaming : public TransferPair,
                       public od::Hook,
                       public od::ByteSource,
                       public od::ByteSink {
 protected:
  LaterStreaming() {
    EXPECT_TRUE(dictionary.set_hook(kDomainIndex, this));
    when_quiet = [this] { answer_after_a_while(); };
  }

  // --- od::Hook
  Result<od::ByteSource*> open_source(od::Address) override {
    if (later(Place::open)) {
      return to_error(od::kLater);
    }
    position = 0;
    return static_cast<od::ByteSource*>(this);
  }
  Result<od::ByteSink*> open_sink(od::Address, std::optional<std::uint32_t>) override {
    if (later(Place::open)) {
      return to_error(od::kLater);
    }
    got.clear();
    return static_cast<od::ByteSink*>(this);
  }
  void put_off(od::Address address, od::Ticket number) override {
    EXPECT_EQ(address, kLateDomain);
    EXPECT_EQ(ticket, 0U) << "one request at a time";
    ticket = number;
    ++tickets;
  }
  void cancelled(od::Ticket number) override {
    EXPECT_EQ(number, ticket);
    ticket = 0;
    ++given_up;
  }

  // --- od::ByteSource
  std::optional<std::uint32_t> size() const override {
    return tells_size ? std::optional(static_cast<std::uint32_t>(bytes_in_all)) : std::nullopt;
  }
  Result<std::size_t> read(std::span<std::byte> out) override {
    if (later(Place::piece)) {
      return to_error(od::kLater);
    }
    const std::vector<std::byte> all = pattern(bytes_in_all);
    const std::size_t count = std::min(out.size(), all.size() - position);
    std::copy_n(all.begin() + static_cast<std::ptrdiff_t>(position), count, out.begin());
    position += count;
    return count;
  }
  void closed(AbortCode why) override { ends.push_back(why); }

  // --- od::ByteSink
  AbortCode write(std::span<const std::byte> piece) override {
    EXPECT_EQ(ticket, 0U) << "called while it is busy";
    got.insert(got.end(), piece.begin(), piece.end());
    return put_off_at(Place::piece) ? od::kLater : AbortCode::none;
  }
  AbortCode finish() override {
    EXPECT_EQ(ticket, 0U) << "called while it is busy";
    ends.push_back(AbortCode::none);
    return put_off_at(Place::finish) ? od::kLater : AbortCode::none;
  }
  void cancelled(AbortCode why) override { ends.push_back(why); }

  bool put_off_at(Place here) const { return place == here; }
  // Every second call.
  bool later(Place here) {
    EXPECT_EQ(ticket, 0U) << "called while it is busy";
    return put_off_at(here) && (asked++ % 2 == 0);
  }

  void answer_after_a_while() {
    if (ticket == 0 || !answers) {
      return;
    }
    now += kDelay;
    client.advance(now, to_server);
    server.advance(now, to_client);
    EXPECT_TRUE(to_client.empty()) << "the server answered too early";
    EXPECT_TRUE(dictionary.complete(std::exchange(ticket, 0), refusal));
    EXPECT_LE(server.next_wake(), now);
  }

  void begin(bool writing, Transfer transfer) {
    asked = 0;
    tickets = 0;
    given_up = 0;
    ends.clear();
    const TransferOptions options{.transfer = transfer};
    if (writing) {
      TransferPair::write(kLateDomain, pattern(bytes_in_all), options);
    } else {
      TransferPair::read(kLateDomain, options);
    }
  }
  void expect_right(bool writing, const Outcome& outcome) {
    ASSERT_EQ(outcome.abort, AbortCode::none) << describe(outcome.abort);
    EXPECT_EQ(numbers(writing ? got : outcome.data), numbers(pattern(bytes_in_all)));
    settle();
    EXPECT_EQ(ends, std::vector<AbortCode>{AbortCode::none});
    EXPECT_EQ(given_up, 0);
  }

  Place place = Place::open;
  bool tells_size = true;
  bool answers = true;
  AbortCode refusal = AbortCode::none;
  std::size_t bytes_in_all = kSize;
  std::size_t position = 0;
  std::vector<std::byte> got;
  std::vector<AbortCode> ends;
  od::Ticket ticket = 0;
  int asked = 0;
  int tickets = 0;
  int given_up = 0;
};

struct Case {
  bool writing;
  Transfer transfer;
  Place place;
};

// finish() exists only for downloads.
std::vector<Case> all_cases() {
  std::vector<Case> out;
  for (const Transfer transfer : {Transfer::segmented, Transfer::block}) {
    for (const Place place : {Place::open, Place::piece}) {
      out.push_back({true, transfer, place});
      out.push_back({false, transfer, place});
    }
    out.push_back({true, transfer, Place::finish});
  }
  return out;
}

class Trace : public testing::ScopedTrace {
 public:
  explicit Trace(const Case& each)
      : ScopedTrace(__FILE__, __LINE__,
                    testing::Message() << (each.writing ? "download " : "upload ")
                                       << static_cast<int>(each.transfer) << ' '
                                       << static_cast<int>(each.place)) {}
};

TEST_F(LaterStreaming, GoesOnWhenTheHookOrTheStreamHasAnswered) {
  for (const bool told : {true, false}) {
    tells_size = told;
    for (const Case& each : all_cases()) {
      Trace trace(each);
      place = each.place;
      begin(each.writing, each.transfer);
      expect_right(each.writing, run());
      EXPECT_GE(tickets, place == Place::piece ? 2 : 1);
    }
  }
}

// The read then begins in segments: the source is opened twice.
TEST_F(LaterStreaming, TheClientMayChangeToBlocks) {
  for (const Place here : {Place::open, Place::piece}) {
    place = here;
    begin(false, Transfer::automatic);
    const Outcome outcome = run();
    EXPECT_EQ(outcome.abort, AbortCode::none);
    EXPECT_EQ(numbers(outcome.data), numbers(pattern(kSize)));
    settle();
    EXPECT_EQ(ends, (std::vector<AbortCode>{AbortCode::general, AbortCode::none}));
  }
}

TEST_F(LaterStreaming, OfAnySize) {
  for (const std::size_t size : {0U, 1U, 4U, 5U, 7U, 8U, 889U, 890U, 2047U, 2048U, 2049U, 4096U}) {
    bytes_in_all = size;
    for (const Case& each : all_cases()) {
      SCOPED_TRACE(size);
      Trace trace(each);
      place = each.place;
      begin(each.writing, each.transfer);
      expect_right(each.writing, run());
    }
  }
}

TEST_F(LaterStreaming, TheLateAnswerMayBeARefusal) {
  refusal = AbortCode::hardware;
  for (const Case& each : all_cases()) {
    Trace trace(each);
    place = each.place;
    begin(each.writing, each.transfer);
    EXPECT_EQ(run().abort, AbortCode::hardware);
    settle();
    EXPECT_EQ(tickets, 1);
    EXPECT_EQ(given_up, 0);
    // finish() is itself the end, and a stream that was never opened has no end.
    const bool ended = place == Place::piece;
    EXPECT_EQ(ends.size(), ended || place == Place::finish ? 1U : 0U);
    EXPECT_TRUE(!ended || ends.at(0) == AbortCode::hardware);
  }
}

TEST_F(LaterStreaming, TheClientMayGiveUpMeanwhile) {
  answers = false;
  for (const Case& each : all_cases()) {
    Trace trace(each);
    place = each.place;
    begin(each.writing, each.transfer);
    // A block transfer whose initiate request is not answered continues in segments: the second
    // time the hook answers at once.
    const bool falls_back = place == Place::open && each.transfer == Transfer::block;
    EXPECT_EQ(run().abort, falls_back ? AbortCode::none : AbortCode::timeout);
    settle();
    EXPECT_EQ(given_up, 1);
    EXPECT_EQ(ticket, 0U);
    EXPECT_EQ(ends.size(), place == Place::open && !falls_back ? 0U : 1U);
    EXPECT_TRUE(place != Place::piece || ends.at(0) != AbortCode::none);
    TransferPair::read({0x1000, 0});
    EXPECT_EQ(numbers(run().data), (Bytes{1, 2, 3, 4}));
  }
}

TEST_F(LaterStreaming, AHookThatNeverAnswersIsGivenUp) {
  answers = false;
  for (const Case& each : all_cases()) {
    Trace trace(each);
    place = each.place;
    begin(each.writing, each.transfer);
    // Like run(), but the client does not time out.
    can::Frame next;
    for (bool any = true; any;) {
      any = false;
      if (to_server.pop_rest(next)) {
        next.time = now;
        server.receive(next, to_client);
        any = true;
      }
      if (to_client.pop_rest(next)) {
        next.time = now;
        client.receive(next, to_server);
        any = true;
      }
      if (!any && ticket == 0) {
        now = earlier(client.next_wake(), server.next_wake());
        client.advance(now, to_server);
        server.advance(now, to_client);
        any = true;
      }
    }
    ASSERT_NE(ticket, 0U);
    now += ServerOptions{}.answer_timeout;
    server.advance(now, to_client);
    EXPECT_EQ(drain(to_client, kResponseId), (Frames{abort_bytes(kDomainIndex, 0, 0x0504'0000)}));
    EXPECT_EQ(given_up, 1);
    EXPECT_FALSE(server.busy());
    client.abort(AbortCode::general, now, to_server);
    client.take();
    settle();
  }
}

TEST_F(LaterStreaming, LostSegmentsMeanwhileAreRepeated) {
  place = Place::piece;
  for (const bool writing : {true, false}) {
    for (int faulty = 0; faulty < 60; ++faulty) {
      SCOPED_TRACE(testing::Message() << writing << ' ' << faulty);
      begin(writing, Transfer::block);
      int seen = 0;
      const Outcome outcome = run([&](const can::Frame& frame, int number) {
        const auto command = std::to_integer<std::uint8_t>(frame.data[0]);
        const bool sends = frame.id == (writing ? kRequestId : kResponseId) && number > 1;
        const bool segment = sends && (command & 0x7FU) >= 1 && (command & 0xE3U) != 0xC1;
        return segment && seen++ == faulty * 12 ? Fault::lose : Fault::none;
      });
      expect_right(writing, outcome);
    }
  }
}

// Few segments were requested again, and were only late: they come twice while the sink is busy.
TEST_F(LaterStreaming, SegmentsThatWereRequestedTwiceAreIgnoredMeanwhile) {
  place = Place::piece;
  const auto value = pattern(296 * 7);  // the sink gets 2 KiB at once
  const auto give = [&](const Frames& requests) {
    for (const Bytes& each : requests) {
      server.receive(frame(kRequestId, each, now), to_client);
    }
    return drain(to_client, kResponseId);
  };
  const auto stall = [&] {
    now += 200ms;
    server.advance(now, to_client);
    return drain(to_client, kResponseId);
  };
  Bytes initiate{0xC6, 0, 0, kLateDomain.sub, 0x18, 0x08, 0, 0};
  store_le(reinterpret_cast<std::byte*>(&initiate[1]), kLateDomain.index);
  give({initiate});
  give(segments(value, 0, 127));
  give(segments(value, 127, 85));
  EXPECT_EQ(give(segments(value, 212, 80)), Frames{});
  EXPECT_EQ(stall(), Frames{block_ack(80, 63)});
  EXPECT_EQ(stall(), Frames{block_ack(0, 63)});
  const Frames rest = segments(value, 292, 4);
  EXPECT_EQ(give(rest), Frames{});
  EXPECT_NE(ticket, 0U);
  EXPECT_EQ(give(rest), Frames{});
  dictionary.complete(std::exchange(ticket, 0), AbortCode::none);
  server.advance(now, to_client);
  EXPECT_EQ(drain(to_client, kResponseId), Frames{block_ack(4, 64)});
  give({end_request(value, crc_of(value))});
  EXPECT_EQ(numbers(got), numbers(value));
}

// A client cannot wait for a completion: kLater must not become an abort code on the bus.
TEST_F(LaterStreaming, AClientCannotWait) {
  place = Place::piece;
  for (const Transfer transfer : {Transfer::segmented, Transfer::block}) {
    asked = 0;
    client.write({0x1234, 0}, static_cast<od::ByteSource&>(*this), kTimeout, now, to_server,
                 {.transfer = transfer});
    to_server.clear();
    const bool block = transfer == Transfer::block;
    client.receive(
        frame(kResponseId,
              {static_cast<std::uint8_t>(block ? 0xA4 : 0x60), 0x34, 0x12, 0, 127, 0, 0, 0}, now),
        to_server);
    const std::optional<Outcome> outcome = client.take();
    ASSERT_TRUE(outcome);
    EXPECT_EQ(outcome->abort, AbortCode::device_state);
    EXPECT_EQ(drain(to_server, kRequestId), (Frames{abort_bytes(0x1234, 0, 0x0800'0022)}));
  }
}

// An object with several hooks: the ticket goes to the hook that returned the stream.
TEST_F(LaterStreaming, OfOneOfSeveralHooks) {
  class Bystander : public od::Hook {
   public:
    void put_off(od::Address, od::Ticket) override { ADD_FAILURE() << "called the wrong hook"; }
  };
  Bystander first;
  Bystander last;
  EXPECT_TRUE(dictionary.set_hook(kDomainIndex, &first));
  EXPECT_TRUE(dictionary.add_hook(kDomainIndex, *this));
  EXPECT_TRUE(dictionary.add_hook(kDomainIndex, last));
  for (const Case& each : all_cases()) {
    Trace trace(each);
    place = each.place;
    begin(each.writing, each.transfer);
    expect_right(each.writing, run());
  }
}

// A removed hook can no longer complete the request.
TEST_F(LaterStreaming, AHookThatIsTakenAwayRefuses) {
  for (const Case& each : all_cases()) {
    Trace trace(each);
    place = each.place;
    EXPECT_TRUE(dictionary.set_hook(kDomainIndex, this));
    begin(each.writing, each.transfer);
    when_quiet = [this] {
      if (std::exchange(ticket, 0) != 0) {
        EXPECT_TRUE(dictionary.set_hook(kDomainIndex, nullptr));
      }
    };
    EXPECT_EQ(run().abort, AbortCode::device_state);
    settle();
  }
}

}  // namespace
}  // namespace linegate::sdo::test
