// SPDX-License-Identifier: Apache-2.0
// The client with SDO servers of other manufacturers: those of CANopenNode and lely-core abort an
// open transfer on any command that is not its next one, block transfer may be missing, and some
// devices do not answer commands that they do not implement.
#include "stack/sdo/protocol.h"

#include "tests/stack/sdo/pair_fixture.h"

namespace linegate::sdo::test {
namespace {

constexpr od::Address kValue{0x2100, 0};

class ForeignServer : public TransferPair {
 protected:
  enum class Blocks : std::uint8_t { served, aborted, ignored };

  void store(std::size_t size) {
    ASSERT_TRUE(dictionary.set(kValue, std::span<const std::byte>(pattern(size))));
  }
  Bytes stored() { return numbers(dictionary.find(kValue)->bytes()); }

  void serve(const can::Frame& request) override {
    const auto command = std::to_integer<std::uint8_t>(request.data[0]);
    const unsigned specifier = command >> 5U;
    const bool abort = command == 0x80;
    const bool initiates_block = !within_block_ && !abort && specifier >= 5;
    ++requests;
    if (initiates_block && blocks != Blocks::served) {
      ++block_initiates;
      if (blocks == Blocks::aborted) {
        refuse(code);
      }
      return;
    }
    if (open_ && !abort && specifier != next_) {
      open_ = false;
      server.receive(frame(kRequestId, abort_bytes(0x2100, 0, 0x0800'0000), now), to_client);
      refuse(0x0504'0001);
      return;
    }
    server.receive(request, to_client);
    follow(initiates_block, specifier, abort);
  }

  Blocks blocks = Blocks::served;
  std::uint32_t code = 0x0504'0001;
  int requests = 0;
  int block_initiates = 0;

 private:
  void refuse(std::uint32_t why) {
    to_client.push(can::TransmitClass::sdo, frame(kResponseId, abort_bytes(0x2100, 0, why), now));
  }

  // Stores the command that the server expects next.
  void follow(bool initiates_block, unsigned specifier, bool abort) {
    if (abort || !server.busy()) {
      open_ = within_block_ = false;
    } else if (initiates_block) {
      within_block_ = true;
    } else if (!within_block_ && (specifier == 1 || specifier == 2)) {
      open_ = true;
      next_ = specifier == 1 ? 0 : 3;
    }
  }

  bool open_ = false;  // a transfer in segments
  bool within_block_ = false;
  unsigned next_ = 0;  // command specifier of its segments
};

TEST_F(ForeignServer, LongValuesAreReadInBlocks) {
  store(7000);
  read(kValue);
  const Outcome outcome = run();
  ASSERT_EQ(outcome.abort, AbortCode::none);
  EXPECT_EQ(numbers(outcome.data), numbers(pattern(7000)));
  EXPECT_LT(requests, 20) << "segments take one request for seven bytes";
  settle();
}

TEST_F(ForeignServer, LongValuesAreWrittenInBlocks) {
  write(kValue, pattern(7000));
  ASSERT_EQ(run().abort, AbortCode::none);
  EXPECT_EQ(stored(), numbers(pattern(7000)));
  settle();
}

TEST_F(ForeignServer, WithoutBlocksItGetsSegments) {
  for (const Blocks without : {Blocks::aborted, Blocks::ignored}) {
    for (const std::uint32_t why : {0x0504'0001U, 0x0800'0000U, 0x0504'0005U, 0x060A'0023U}) {
      for (const std::size_t size : {128U, 889U, 7000U}) {
        SCOPED_TRACE(testing::Message() << static_cast<int>(without) << ' ' << why << ' ' << size);
        blocks = without;
        code = why;
        store(0);
        write(kValue, pattern(size));
        ASSERT_EQ(run().abort, AbortCode::none);
        EXPECT_EQ(stored(), numbers(pattern(size)));
        settle();
        read(kValue);
        const Outcome outcome = run();
        ASSERT_EQ(outcome.abort, AbortCode::none);
        EXPECT_EQ(numbers(outcome.data), numbers(pattern(size)));
        settle();
      }
    }
  }
}

TEST_F(ForeignServer, ThatDoesNotAnswerBlocksIsNotSentThemForEver) {
  blocks = Blocks::ignored;
  for (int i = 0; i < 10; ++i) {
    write(kValue, pattern(200));
    ASSERT_EQ(run().abort, AbortCode::none);
  }
  EXPECT_EQ(block_initiates, 2);
}

TEST_F(ForeignServer, ThatIsToGetNoBlocksGetsNone) {
  blocks = Blocks::ignored;
  store(7000);
  read(kValue, {.block_from = kNoBlocks});
  ASSERT_EQ(run().abort, AbortCode::none);
  write(kValue, pattern(7000), {.block_from = kNoBlocks});
  ASSERT_EQ(run().abort, AbortCode::none);
  EXPECT_EQ(block_initiates, 0);
}

}  // namespace
}  // namespace linegate::sdo::test
