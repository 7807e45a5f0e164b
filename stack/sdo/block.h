// SPDX-License-Identifier: Apache-2.0
// The two ends of a block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.16), for client and server: the
// sender and the receiver of segments. Frames and time-outs are handled by the channel.
//
// A sub-block has up to 127 segments, which the receiver acknowledges together: ackseq is the last
// segment received in order. Segments after a gap are sent again in the next sub-block, which is
// numbered from 1 again and has as many segments as the acknowledgement requests.
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
  // block_size: segments in the first sub-block, 1..127. crc: whether both sides support the CRC;
  // without, it is sent as 0.
  void start(std::uint8_t block_size, bool crc);

  // Whether next_segment() has segments left in this sub-block.
  bool sending() const { return sent_ < block_size_ && !last_sent_ && !early_due(); }
  // Returns the next segment as eight bytes; it is not sent if the source has an error().
  // Precondition: sending().
  std::uint64_t next_segment(Source& source);

  // Processes the acknowledgement of the sub-block. Returns sequence_number if ackseq exceeds the
  // last segment sent; block_size for a next sub-block of 0 or more than 127 segments (unless
  // everything was sent). While a sub-block is repeated as a whole, ackseq may be of its first
  // transmission: with a CRC, which reveals it if the receiver took the repetition for new
  // segments, it has no effect until the repetition has come so far, see early_due().
  AbortCode acknowledge(std::uint8_t ackseq, std::uint8_t next_block_size, Source& source);
  // The segments of an early acknowledgement were repeated: call acknowledge_early() now.
  bool early_due() const { return early_.ackseq != 0 && early_.ackseq == sent_; }
  AbortCode acknowledge_early(Source& source);
  // All segments were acknowledged: end_request() comes next.
  bool complete() const { return complete_; }
  std::uint64_t end_request() const;

 private:
  struct Acknowledgement {
    std::uint8_t ackseq = 0;
    std::uint8_t next_block_size = 0;
  };

  std::size_t begin_ = 0;   // position of the sub-block's first byte
  std::size_t summed_ = 0;  // bytes in crc_
  std::uint16_t crc_ = 0;
  std::uint8_t block_size_ = 0;
  std::uint8_t sent_ = 0;       // segments sent in this sub-block
  std::uint8_t last_size_ = 0;  // bytes of the last segment sent
  std::uint8_t repeated_ = 0;   // segments of this sub-block that were sent before
  Acknowledgement early_;
  bool with_crc_ = false;
  bool last_sent_ = false;  // the last segment of the transfer is in this sub-block
  bool complete_ = false;
};

// Collects segments in a Sink.
class BlockReceiver {
 public:
  // A sub-block shrinks to this many segments after losses. If it had fewer, all could be lost,
  // which looks like a lost acknowledgement.
  static constexpr std::uint8_t kFewest = 8;

  // announced: total size in bytes, if indicated. block_size: of the first sub-block, if it was
  // agreed before the start request, which may itself be lost, see unheard(). fewest: more than
  // kFewest where it takes long to detect a missing end of a sub-block.
  void start(std::optional<std::uint32_t> announced, bool crc,
             std::optional<std::uint8_t> block_size = std::nullopt, std::uint8_t fewest = kFewest);
  // Best number of segments of the next sub-block, at most `most`, with that many bytes left
  // (nothing: unknown).
  static std::uint8_t best_block_size(std::optional<std::size_t> bytes_left,
                                      std::uint8_t most = kMaxBlockSize);

  // Number of segments of the current sub-block: up to 127, but fewer if the last sub-block would
  // be so short that it might be lost completely, which looks like a lost acknowledgement.
  // Everything after a lost segment is sent again, so the best size is about the square root of 2 /
  // (share of lost segments). To approximate it, the size is halved after a sub-block with a loss,
  // not below the minimum of start(), and grows by one after each without.
  std::uint8_t block_size() const { return block_size_; }
  // A segment was lost.
  bool lossy() const { return lossy_; }

  // Processes a segment; one out of order, or that may be late, is ignored. Returns sequence_number
  // if the number exceeds the sub-block, if successive sub-blocks ended without their first
  // segment, or if there are more segments than announced after an unanswered acknowledgement; else
  // the result of the sink. od::kLater: the segment is stored, but the next sub-block has to wait
  // for the sink.
  AbortCode take(std::uint64_t segment, Sink& sink);
  // The sub-block has ended: acknowledge() is due.
  bool over() const { return over_; }
  // Returns the acknowledgement of the sub-block as eight bytes. Afterwards the next sub-block
  // begins, or complete() is true.
  std::uint64_t acknowledge();
  // Whether an acknowledgement may help after the segments stopped: some were received, or so few
  // were expected that all may have been lost. At most twice without a new segment.
  //
  // Such an unanswered acknowledgement has ackseq 0: repeat the whole sub-block. If in fact the
  // previous acknowledgement was lost, the sender applies ackseq 0 to the previous sub-block and
  // repeats that: these are more segments than are left, which ends the transfer with
  // sequence_number. Lost segments beside it may hide their number, so only a CRC permits it.
  bool may_acknowledge() const;
  // An acknowledgement was sent without a segment before it.
  bool in_doubt() const { return in_doubt_; }
  // Such an acknowledgement was sent for the first sub-block, whose start request may be lost.
  bool unheard() const { return in_doubt_ && !begun_; }
  // All segments were received and acknowledged: finish() comes next.
  bool complete() const { return complete_; }

  // Processes the sender's end request, which completes the last bytes. Returns crc if the CRC is
  // wrong, sequence_number as take(), or the result of the sink. Does not finish the sink.
  // od::kLater: the sink has the bytes but is busy.
  AbortCode finish(std::uint64_t end_request, Sink& sink);

  // What may still arrive if the transfer ends now, see LateSegments::expect(): the number of the
  // last segment received since the last acknowledgement (0: none), and the greatest that may
  // follow.
  std::uint8_t last_seen() const { return seen_; }
  std::uint8_t most_expected() const { return std::max(block_size_, late_.last); }
  // Whether the frame after the last segment is that segment again, as a repeated frame is, or one
  // of few segments that were requested twice although they were only late.
  bool is_repetition(std::uint64_t segment) const;

 private:
  static constexpr unsigned kMaxVain = 2;
  static constexpr unsigned kMaxFruitless = 8;
  static constexpr std::size_t kFewBytes = 8 * kSegmentSize;

  // Of a sub-block that was acknowledged before its end: its segments after `newest`, up to `last`,
  // may still arrive.
  struct Late {
    std::uint8_t newest = 0;
    std::uint8_t last = 0;
  };

  // Whether the segment may be one of late_: no segment that cannot be has come since, or the
  // current sub-block has no such number.
  bool may_be_late(unsigned number) const;
  std::uint64_t word_of(std::uint8_t ackseq) const;
  AbortCode release(std::size_t size, Sink& sink);
  std::optional<std::size_t> bytes_left() const;
  void follow_losses();
  void begin_sub_block();

  std::optional<std::uint32_t> announced_;
  std::size_t taken_ = 0;   // bytes in order, each segment counted as 7
  std::uint64_t held_ = 0;  // the last segment in order: its length is unknown before finish()
  std::uint16_t crc_ = 0;
  std::uint8_t fewest_ = kFewest;
  std::uint8_t most_ = kMaxBlockSize;  // segments of a sub-block, see block_size()
  std::uint8_t block_size_ = 0;
  Late late_;
  std::uint64_t acknowledgement_ = 0;  // the previous one
  std::uint8_t in_order_ = 0;
  std::uint8_t newest_ = 0;  // of those that are not late
  std::uint8_t seen_ = 0;
  unsigned vain_ = 0;       // acknowledgements since the last segment
  unsigned fruitless_ = 0;  // sub-blocks since the last segment in order
  bool in_doubt_ = false;   // see in_doubt(): the sender may be one sub-block behind
  bool begun_ = false;      // the sender has started for certain, or needs no start request
  bool with_crc_ = false;
  bool lossy_ = false;
  bool holds_ = false;
  bool last_taken_ = false;
  bool over_ = false;
  bool complete_ = false;
};

// Measures the interval of segments, to detect a missing end of a sub-block early on a lossy bus.
class SegmentPace {
 public:
  // Call it with each received segment.
  void came(Instant now) {
    if (last_ != Instant{}) {
      longest_ = std::max(now - last_, longest_ - longest_ / kMemory);
    }
    last_ = now;
  }
  // Call it when the sub-block was acknowledged: the gap to the next segment does not count.
  void pause() { last_ = {}; }
  // After this time without a segment, no more segments are under way; at most `longest`.
  Duration stall(Duration longest) const {
    const bool known = longest_ > Duration::zero();
    return known ? std::min(longest, std::max(kShortest, kGaps * longest_)) : longest;
  }

 private:
  static constexpr int kMemory = 64;  // segments
  static constexpr int kGaps = 32;
  static constexpr Duration kShortest = std::chrono::milliseconds(10);

  Duration longest_{};  // longest of the last intervals
  Instant last_{};
};

// Recognizes the remaining segments of an aborted sub-block, which look like requests.
class LateSegments {
 public:
  static constexpr Duration kQuiet = std::chrono::milliseconds(250);

  // newest: the last segment received.
  void expect(std::uint8_t newest, std::uint8_t block_size, Instant now);
  // Whether the command byte continues their numbers (a few may be lost). If not, no more are
  // expected.
  bool take(std::uint8_t command, Instant now);
  bool expected() const { return block_size_ != 0; }

 private:
  static constexpr unsigned kMaxGap = 4;

  std::uint8_t newest_ = 0;
  std::uint8_t block_size_ = 0;  // 0: none are expected
  Instant until_{};
};

// The CRC of block transfer (CiA 301, 7.2.4.3.16): polynomial x^16 + x^12 + x^5 + 1, initial value
// 0000h, most significant bit first, no final inversion. "123456789" yields 31C3h.
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

// Continues the CRC of the preceding bytes.
inline std::uint16_t crc_of(std::span<const std::byte> bytes, std::uint16_t crc = 0) {
  for (const std::byte byte : bytes) {
    const unsigned place = (static_cast<unsigned>(crc) >> 8U) ^ std::to_integer<unsigned>(byte);
    crc = static_cast<std::uint16_t>(static_cast<unsigned>(crc) << 8U ^ kCrcTable[place & 0xFFU]);
  }
  return crc;
}

}  // namespace linegate::sdo
