// SPDX-License-Identifier: Apache-2.0
// Values that are not in memory: a generated pattern is transferred by client and server, and
// checked on arrival. A separate program, because it counts calls of operator new.
#include <random>

#include "tests/bench/allocations.h"
#include "tests/stack/sdo/pair_fixture.h"

namespace linegate::sdo::test {
namespace {

constexpr std::uint16_t kDomainIndex = 0x2100;
constexpr od::Address kDomain{kDomainIndex, 0};
constexpr std::uint32_t kFourMegabytes = 4 * 1024 * 1024;

std::byte pattern_byte(std::uint32_t position) {
  return static_cast<std::byte>((position * 2654435761U) >> 21U);
}

class PatternSource : public od::ByteSource {
 public:
  std::optional<std::uint32_t> size() const override {
    return tells_size ? std::optional(length) : std::nullopt;
  }
  Result<std::size_t> read(std::span<std::byte> out) override {
    if (position >= fails_from) {
      return to_error(AbortCode::hardware);
    }
    longest = std::max(longest, out.size());
    std::size_t count = 0;
    for (; count < out.size() && position < std::min(length, really); ++count) {
      out[count] = pattern_byte(position++);
    }
    return count;
  }
  bool rewind() override {
    position = 0;
    ++rewinds;
    return can_rewind;
  }
  void closed(AbortCode why) override { ends.push_back(why); }

  std::uint32_t length = 0;
  std::uint32_t really = 0xFFFF'FFFF;  // bytes there are, whatever size() says
  std::uint32_t fails_from = 0xFFFF'FFFF;
  bool tells_size = true;
  bool can_rewind = false;
  std::uint32_t position = 0;
  std::size_t longest = 0;
  int rewinds = 0;
  std::vector<AbortCode> ends;
};

class PatternSink : public od::ByteSink {
 public:
  AbortCode write(std::span<const std::byte> piece) override {
    longest = std::max(longest, piece.size());
    for (const std::byte b : piece) {
      right = right && b == pattern_byte(position++);
    }
    return position > fails_from ? AbortCode::cannot_transfer : AbortCode::none;
  }
  AbortCode finish() override {
    ends.push_back(AbortCode::none);
    return at_finish;
  }
  void cancelled(AbortCode why) override { ends.push_back(why); }
  bool rewind() override {
    position = 0;
    return can_rewind;
  }

  std::uint32_t position = 0;
  std::uint32_t fails_from = 0xFFFF'FFFF;
  AbortCode at_finish = AbortCode::none;
  bool can_rewind = false;
  bool right = true;
  std::size_t longest = 0;
  std::vector<AbortCode> ends;
};

class Streaming : public TransferPair, public od::Hook {
 protected:
  Streaming() { (void)dictionary.set_hook(kDomainIndex, this).ok(); }

  Result<od::ByteSource*> open_source(od::Address) override {
    if (refusal != AbortCode::none) {
      return to_error(refusal);
    }
    source.position = 0;
    return static_cast<od::ByteSource*>(&source);
  }
  Result<od::ByteSink*> open_sink(od::Address, std::optional<std::uint32_t> size) override {
    told = size;
    if (refusal != AbortCode::none) {
      return to_error(refusal);
    }
    sink.position = 0;
    return static_cast<od::ByteSink*>(&sink);
  }

  // Both ends use streams: one reads from source, the other writes to sink.
  void begin(bool writing, std::uint32_t size, TransferOptions options = {}) {
    source.length = size;
    source.position = 0;
    source.ends.clear();
    sink.position = 0;
    sink.ends.clear();
    if (writing) {
      client.write(kDomain, source, kTimeout, now, to_server, options);
    } else {
      client.read(kDomain, sink, kTimeout, now, to_server, options);
    }
  }
  // The other end of an upload is closed later.
  void expect_end(AbortCode why) {
    settle();
    EXPECT_EQ(source.ends, std::vector<AbortCode>{why});
    EXPECT_EQ(sink.ends, std::vector<AbortCode>{why});
  }

  PatternSource source;
  PatternSink sink;
  AbortCode refusal = AbortCode::none;
  std::optional<std::uint32_t> told;
};

TEST_F(Streaming, FourMegabytesThroughAFewKilobytes) {
  for (const Transfer transfer : {Transfer::block, Transfer::segmented}) {
    for (const bool writing : {true, false}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(transfer) << ' ' << writing);
      bench::forget_largest_allocation();
      begin(writing, kFourMegabytes, {.transfer = transfer});
      EXPECT_EQ(run().abort, AbortCode::none);
      EXPECT_LE(bench::largest_allocation(), 4096U);
      EXPECT_LE(source.longest, 4096U);
      EXPECT_LE(sink.longest, 4096U);
      EXPECT_EQ(sink.position, kFourMegabytes);
      EXPECT_TRUE(sink.right);
      expect_end(AbortCode::none);
    }
  }
  EXPECT_EQ(told, kFourMegabytes);
}

TEST_F(Streaming, OfUnknownSize) {
  source.tells_size = false;
  for (const Transfer transfer : {Transfer::automatic, Transfer::block, Transfer::segmented}) {
    for (const std::uint32_t size : {0U, 1U, 7U, 8U, 889U, 2047U, 2048U, 2049U, 20'000U}) {
      for (const bool writing : {true, false}) {
        SCOPED_TRACE(testing::Message() << static_cast<int>(transfer) << ' ' << size << writing);
        begin(writing, size, {.transfer = transfer});
        EXPECT_EQ(run().abort, AbortCode::none);
        EXPECT_EQ(sink.position, size);
        EXPECT_TRUE(sink.right);
        expect_end(AbortCode::none);
      }
    }
  }
  EXPECT_EQ(told, std::nullopt);
}

TEST_F(Streaming, OfEverySmallSize) {
  for (std::uint32_t size = 0; size < 30; ++size) {
    for (const bool writing : {true, false}) {
      SCOPED_TRACE(testing::Message() << size << ' ' << writing);
      begin(writing, size);
      EXPECT_EQ(run().abort, AbortCode::none);
      EXPECT_EQ(sink.position, size);
      EXPECT_TRUE(sink.right);
      expect_end(AbortCode::none);
    }
  }
}

TEST_F(Streaming, LostSegmentsAreRepeatedFromTheWindow) {
  std::mt19937 random(5);
  for (const bool writing : {true, false}) {
    begin(writing, 300'000, {.transfer = Transfer::block});
    bool begun = false;
    const Outcome outcome = run([&](const can::Frame& frame, int) {
      const bool sends = frame.id == (writing ? kRequestId : kResponseId);
      const bool first = sends && !std::exchange(begun, begun || sends);
      const auto command = std::to_integer<std::uint8_t>(frame.data[0]);
      const bool end = (command & 0xE3U) == 0xC1 && frame.data[4] == std::byte{0} &&
                       frame.data[5] == std::byte{0};
      return sends && !first && !end && random() % 50 == 0 ? Fault::lose : Fault::none;
    });
    EXPECT_EQ(outcome.abort, AbortCode::none);
    EXPECT_EQ(sink.position, 300'000U);
    EXPECT_TRUE(sink.right);
    expect_end(AbortCode::none);
  }
}

TEST_F(Streaming, AFailingSourceEndsTheTransfer) {
  source.fails_from = 5000;
  for (const Transfer transfer : {Transfer::block, Transfer::segmented}) {
    for (const bool writing : {true, false}) {
      begin(writing, 20'000, {.transfer = transfer});
      EXPECT_EQ(run().abort, AbortCode::hardware);
      settle();
      EXPECT_EQ(source.ends, std::vector<AbortCode>{AbortCode::hardware});
      EXPECT_EQ(sink.ends.size(), 1U);
      EXPECT_NE(sink.ends.at(0), AbortCode::none);
    }
  }
}

TEST_F(Streaming, ASourceWithFewerBytesThanItSaidHasNoData) {
  source.really = 5000;
  for (const Transfer transfer : {Transfer::block, Transfer::segmented}) {
    for (const bool writing : {true, false}) {
      begin(writing, 20'000, {.transfer = transfer});
      EXPECT_EQ(run().abort, AbortCode::no_data);
      settle();
    }
  }
}

TEST_F(Streaming, ASinkMayRefuseInTheMiddleAndAtTheEnd) {
  for (const Transfer transfer : {Transfer::block, Transfer::segmented}) {
    for (const bool writing : {true, false}) {
      sink.fails_from = 5000;
      begin(writing, 20'000, {.transfer = transfer});
      EXPECT_EQ(run().abort, AbortCode::cannot_transfer);
      settle();
      EXPECT_EQ(sink.ends, std::vector<AbortCode>{AbortCode::cannot_transfer});
      sink.fails_from = 0xFFFF'FFFF;
      sink.at_finish = AbortCode::invalid_value;
      begin(writing, 20'000, {.transfer = transfer});
      EXPECT_EQ(run().abort, AbortCode::invalid_value);
      settle();
      EXPECT_EQ(sink.ends, std::vector<AbortCode>{AbortCode::none});  // from finish() only
      sink.at_finish = AbortCode::none;
    }
  }
}

TEST_F(Streaming, AHookMayRefuseToOpen) {
  refusal = AbortCode::device_state;
  for (const std::uint32_t size : {3U, 20'000U}) {
    for (const bool writing : {true, false}) {
      begin(writing, size);
      EXPECT_EQ(run().abort, AbortCode::device_state);
      settle();
    }
  }
}

TEST_F(Streaming, ANewInitiateAndAnAbortCancel) {
  begin(true, 20'000);
  to_server.clear();
  client.abort(AbortCode::local_control, now, to_server);
  EXPECT_EQ(client.take()->abort, AbortCode::local_control);
  EXPECT_EQ(source.ends, std::vector<AbortCode>{AbortCode::local_control});
  begin(true, 20'000, {.transfer = Transfer::segmented});
  int seen = 0;
  run([&](const can::Frame&, int) { return seen++ > 9 ? Fault::lose : Fault::none; });
  server.receive(frame(kRequestId, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}, now), to_client);
  EXPECT_EQ(sink.ends, std::vector<AbortCode>{AbortCode::general});
}

TEST_F(Streaming, IsRepeatedIfTheStreamCanBeginAgain) {
  for (const bool writing : {true, false}) {
    for (const bool can : {true, false}) {
      SCOPED_TRACE(testing::Message() << writing << ' ' << can);
      source.can_rewind = can;
      sink.can_rewind = can;
      sink.right = true;
      begin(writing, 20'000, {.transfer = Transfer::block, .repeats = 1});
      bool lost = false;  // whether the first acknowledgement was lost
      const Outcome outcome = run([&](const can::Frame& frame, int) {
        const bool ack =
            frame.id == (writing ? kResponseId : kRequestId) && frame.data[0] == std::byte{0xA2};
        return ack && !std::exchange(lost, true) ? Fault::lose : Fault::none;
      });
      EXPECT_EQ(outcome.abort, can ? AbortCode::none : AbortCode::timeout);
      settle();
      // The server opened its stream twice; here both are the same object.
      if (can && writing) {
        EXPECT_EQ(sink.ends, (std::vector<AbortCode>{AbortCode::general, AbortCode::none}));
      }
    }
  }
}

}  // namespace
}  // namespace linegate::sdo::test
