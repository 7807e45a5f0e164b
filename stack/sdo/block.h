// SPDX-License-Identifier: Apache-2.0
// The two ends of a block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.16), the same for client and
// server: who sends the segments, and who takes them. Frames and times are the business of the
// channel that uses them.
//
// Up to 127 segments make a sub-block, which the taking side acknowledges as a whole: ackseq is the
// last segment that came in order. What came after a gap is sent again in the next sub-block, which
// is numbered from 1 again and has as many segments as the acknowledgement asks for.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/sdo/protocol.h"
#include "stack/sdo/transfer.h"

namespace linegate::sdo {

// Sends the segments of a Source.
class BlockSender {
 public:
  // block_size: segments in the first sub-block, 1..127. crc: whether both sides want the check
  // sum; it is 0 otherwise.
  void start(std::uint8_t block_size, bool crc);

  // Whether the sub-block has segments that next_segment() did not give yet.
  bool sending() const { return sent_ < block_size_ && !last_sent_; }
  // The next segment as eight bytes; it does not count if the source has an error(). Precondition:
  // sending().
  std::uint64_t next_segment(Source& source);

  // The sub-block was acknowledged. sequence_number if ackseq is more than was sent, block_size for
  // a next sub-block of 0 or more than 127 segments (unless nothing is left to be sent).
  AbortCode acknowledge(std::uint8_t ackseq, std::uint8_t next_block_size, Source& source);
  // Everything was acknowledged: end_request() comes next.
  bool complete() const { return complete_; }
  std::uint64_t end_request() const;

 private:
  std::size_t begin_ = 0;   // position of the sub-block's first byte
  std::size_t summed_ = 0;  // bytes in crc_
  std::uint16_t crc_ = 0;
  std::uint8_t block_size_ = 0;
  std::uint8_t sent_ = 0;       // segments of the sub-block
  std::uint8_t last_size_ = 0;  // bytes of the segment sent last
  bool with_crc_ = false;
  bool last_sent_ = false;  // the sub-block has the last segment of all
  bool complete_ = false;
};

// Collects segments in a Sink.
class BlockReceiver {
 public:
  // Segments to which a sub-block shrinks when some are lost: of fewer, all may be lost, which
  // looks like a lost acknowledgement.
  static constexpr std::uint8_t kFewest = 8;

  // announced: the bytes in all, if told. block_size: of the first sub-block, if that was agreed on
  // before the other side was told to start; this may be what is lost then, see unheard(). fewest:
  // more than kFewest where a missing end of a sub-block takes long to be noticed.
  void start(std::optional<std::uint32_t> announced, bool crc,
             std::optional<std::uint8_t> block_size = std::nullopt, std::uint8_t fewest = kFewest);
  // Segments the next sub-block should have if so many bytes are left (nothing: unknown) and it may
  // have `most`.
  static std::uint8_t best_block_size(std::optional<std::size_t> bytes_left,
                                      std::uint8_t most = kMaxBlockSize);

  // Segments the present sub-block shall have. 127, but fewer than can be had if otherwise the last
  // sub-block would be short: one of which nothing arrives looks like a lost acknowledgement.
  // What follows a lost segment has to be sent again, so that the best size is about the square
  // root of 2 / (share of lost segments). Half the segments after a sub-block with a loss, not
  // fewer than start() says, and one more after each without loss come close to it.
  std::uint8_t block_size() const { return block_size_; }
  // A segment was lost.
  bool lossy() const { return lossy_; }

  // Takes a segment. One that is not in order is ignored. sequence_number if there is no such
  // segment in the sub-block, or one sub-block after the other ended without its first segment, or
  // there are more segments than announced after an acknowledgement in vain; what the sink says.
  // od::kLater: it is taken, but the next sub-block has to wait for the sink.
  AbortCode take(std::uint64_t segment, Sink& sink);
  // The sub-block is over: acknowledge() is due.
  bool over() const { return over_; }
  // The acknowledgement of the sub-block as eight bytes; the next sub-block begins, or complete().
  std::uint64_t acknowledge();
  // Whether an acknowledgement may help if no more segments come: some came, or so few were
  // expected that all may have been lost. Not for ever: at most twice without a segment.
  //
  // The one in vain says ackseq 0: all of the sub-block again. If it was the acknowledgement before
  // that is lost, the sender takes it for that one, and repeats the sub-block before: these are
  // more segments than are left, which ends the transfer with sequence_number.
  bool may_acknowledge() const;
  // An acknowledgement was in vain.
  bool in_doubt() const { return in_doubt_; }
  // So was that of a sub-block which the other side may not know that it is to begin.
  bool unheard() const { return in_doubt_ && !begun_; }
  // Everything came and was acknowledged: finish() comes next.
  bool complete() const { return complete_; }

  // The sender's end request: takes the last bytes. crc if the check sum is wrong, sequence_number
  // as take(), what the sink says. The sink is not finished. od::kLater: the sink has taken them,
  // but has to be waited for.
  AbortCode finish(std::uint64_t end_request, Sink& sink);

  std::uint8_t newest() const { return newest_; }  // segment heard last in this sub-block, 0 = none
  std::uint64_t last_segment() const { return held_; }

 private:
  static constexpr unsigned kMaxVain = 2;
  static constexpr unsigned kMaxFruitless = 8;
  static constexpr std::size_t kFewBytes = 8 * kSegmentSize;

  AbortCode release(std::size_t size, Sink& sink);
  std::optional<std::size_t> bytes_left() const;
  void follow_losses();
  void begin_sub_block();

  std::optional<std::uint32_t> announced_;
  std::size_t taken_ = 0;   // bytes in order, all segments counted as full
  std::uint64_t held_ = 0;  // the newest segment in order: its end is not known before finish()
  std::uint16_t crc_ = 0;
  std::uint8_t fewest_ = kFewest;
  std::uint8_t most_ = kMaxBlockSize;  // segments of a sub-block, see block_size()
  std::uint8_t block_size_ = 0;
  std::uint8_t late_ = 0;  // segments of the sub-block before, if it was not over: may still come
  std::uint8_t in_order_ = 0;
  std::uint8_t newest_ = 0;
  unsigned vain_ = 0;       // acknowledgements since a segment came
  unsigned fruitless_ = 0;  // sub-blocks that ended since a segment came in order
  bool in_doubt_ = false;   // one was in vain: the sender may be a sub-block behind
  bool begun_ = false;      // the sender has begun for certain, or need not be told to
  bool with_crc_ = false;
  bool lossy_ = false;
  bool holds_ = false;
  bool last_taken_ = false;
  bool over_ = false;
  bool complete_ = false;
};

// How fast segments come: where some are lost, the last one of a sub-block is missed soon.
class SegmentPace {
 public:
  // A segment came.
  void came(Instant now) {
    if (last_ != Instant{}) {
      longest_ = std::max(now - last_, longest_ - longest_ / kMemory);
    }
    last_ = now;
  }
  // The next one does not follow the last: the sub-block was acknowledged.
  void pause() { last_ = {}; }
  // After so long without a segment none is under way; at most `longest`.
  Duration stall(Duration longest) const {
    const bool known = longest_ > Duration::zero();
    return known ? std::min(longest, std::max(kShortest, kGaps * longest_)) : longest;
  }

 private:
  static constexpr int kMemory = 64;  // segments
  static constexpr int kGaps = 32;
  static constexpr Duration kShortest = std::chrono::milliseconds(10);

  Duration longest_{};  // between two of the last segments
  Instant last_{};
};

// Segments of a sub-block that was given up: they are under way still, and look like requests.
class LateSegments {
 public:
  static constexpr Duration kQuiet = std::chrono::milliseconds(250);

  // newest: the segment heard last.
  void expect(std::uint8_t newest, std::uint8_t block_size, Instant now);
  // Whether this is the next of them (a few may be lost). If not, none is expected any more.
  bool take(std::uint8_t command, Instant now);
  bool expected() const { return block_size_ != 0; }

 private:
  static constexpr unsigned kMaxGap = 4;

  std::uint8_t newest_ = 0;
  std::uint8_t block_size_ = 0;  // 0: none are expected
  Instant until_{};
};

// The check sum of block transfer (CiA 301, 7.2.4.3.16): polynomial x^16 + x^12 + x^5 + 1, begun
// with 0000h, most significant bit first, no final inversion. "123456789" gives 31C3h.
inline constexpr std::array<std::uint16_t, 256> kCrcTable = [] {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < table.size(); ++byte) {
    unsigned rest = byte << 8U;
    for (int bit = 0; bit < 8; ++bit) {
      rest = (rest & 0x8000U) != 0 ? (rest << 1U) ^ 0x1021U : rest << 1U;
    }
    table[byte] = static_cast<std::uint16_t>(rest);
  }
  return table;
}();

// The check sum of what gave `crc` so far, followed by bytes.
inline std::uint16_t crc_of(std::span<const std::byte> bytes, std::uint16_t crc = 0) {
  for (const std::byte byte : bytes) {
    const unsigned place = (static_cast<unsigned>(crc) >> 8U) ^ std::to_integer<unsigned>(byte);
    crc = static_cast<std::uint16_t>(static_cast<unsigned>(crc) << 8U ^ kCrcTable[place & 0xFFU]);
  }
  return crc;
}

}  // namespace linegate::sdo
