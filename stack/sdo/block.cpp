// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/block.h"

#include <algorithm>
#include <span>

#include "stack/base/assert.h"
#include "stack/od/hook.h"

namespace linegate::sdo {
namespace {

constexpr unsigned kSequenceBits = 0x7F;

std::size_t segments_of(std::size_t bytes) {
  return (bytes + kSegmentSize - 1) / kSegmentSize;
}

}  // namespace

// --- sender -------------------------------------------------------------------------------------

void BlockSender::start(std::uint8_t block_size, bool crc) {
  LINEGATE_ASSERT(block_size >= 1 && block_size <= kMaxBlockSize,
                  "a sub-block has 1..127 segments");
  *this = {};
  block_size_ = block_size;
  with_crc_ = crc;
}

std::uint64_t BlockSender::next_segment(Source& source) {
  LINEGATE_ASSERT_HOT(sending(), "the sub-block has another segment");
  Payload segment;
  const std::size_t position = begin_ + sent_ * kSegmentSize;
  const auto bytes = std::span(segment).subspan(1);
  const std::size_t size = source.next(bytes);
  if (source.error() != AbortCode::none) {
    return 0;
  }
  last_size_ = static_cast<std::uint8_t>(size);
  last_sent_ = source.at_end();
  ++sent_;
  segment[0] = std::byte{block_segment_byte(sent_, last_sent_)};
  if (position >= summed_) {  // a repeated segment enters the CRC once
    crc_ = crc_of(bytes.first(last_size_), crc_);
    summed_ = position + last_size_;
  }
  return load_le<std::uint64_t>(segment.data());
}

AbortCode BlockSender::acknowledge(std::uint8_t ackseq, std::uint8_t next_block_size,
                                   Source& source) {
  if (ackseq > sent_) {
    early_ = {ackseq, next_block_size};
    return with_crc_ && ackseq <= repeated_ ? AbortCode::none : AbortCode::sequence_number;
  }
  early_ = {};
  complete_ = last_sent_ && ackseq == sent_;
  if (complete_) {
    return AbortCode::none;
  }
  if (next_block_size == 0 || next_block_size > kMaxBlockSize) {
    return AbortCode::block_size;
  }
  begin_ += ackseq * kSegmentSize;
  source.rewind(begin_);
  source.release();
  block_size_ = next_block_size;
  repeated_ = ackseq == 0 ? std::min(std::max(sent_, repeated_), block_size_) : std::uint8_t{0};
  sent_ = 0;
  last_sent_ = false;
  return AbortCode::none;
}

AbortCode BlockSender::acknowledge_early(Source& source) {
  LINEGATE_ASSERT(early_due(), "its segments were repeated");
  return acknowledge(early_.ackseq, early_.next_block_size, source);
}

std::uint64_t BlockSender::end_request() const {
  LINEGATE_ASSERT(complete_, "every segment was acknowledged");
  const auto unused = static_cast<unsigned>(kSegmentSize - last_size_);
  return std::uint64_t{kBlockSendEnd | unused << 2U} |
         std::uint64_t{with_crc_ ? crc_ : std::uint16_t{0}} << 8U;
}

// --- receiver -----------------------------------------------------------------------------------

void BlockReceiver::start(std::optional<std::uint32_t> announced, bool crc,
                          std::optional<std::uint8_t> block_size, std::uint8_t fewest) {
  *this = {};
  fewest_ = fewest;
  announced_ = announced;
  with_crc_ = crc;
  begin_sub_block();
  block_size_ = block_size.value_or(block_size_);
  begun_ = !block_size;
}

std::uint8_t BlockReceiver::best_block_size(std::optional<std::size_t> bytes_left,
                                            std::uint8_t most) {
  const std::size_t left = segments_of(bytes_left.value_or(0));
  const bool two = left > most && left < std::size_t{2} * most;
  return two ? static_cast<std::uint8_t>((left + 1) / 2) : most;
}

AbortCode BlockReceiver::take(std::uint64_t segment, Sink& sink) {
  const auto command = static_cast<std::uint8_t>(segment);
  const auto number = static_cast<std::uint8_t>(command & kSequenceBits);
  if (may_be_late(number)) {
    seen_ = number;
    return AbortCode::none;
  }
  if (number == 0 || number > block_size_) {
    return AbortCode::sequence_number;
  }
  seen_ = number;
  // A repetition of the last segment of the previous sub-block; segment 1 may have the same bytes.
  if (newest_ == 0 && holds_ && segment == held_ && number != 1) {
    return AbortCode::none;
  }
  newest_ = number;
  vain_ = 0;
  begun_ = true;
  AbortCode why = AbortCode::none;
  const bool last = (command & kBlockLastSegment) != 0;
  if (number == in_order_ + 1 && !last_taken_) {
    why = release(kSegmentSize, sink);
    if (why != AbortCode::none && why != od::kLater) {
      return why;
    }
    held_ = segment;
    holds_ = true;
    ++in_order_;
    fruitless_ = 0;
    taken_ += kSegmentSize;
    last_taken_ = last;
  }
  over_ = over_ || last || number == block_size_;
  // If both sides are receivers, they would acknowledge each other for ever: A2h is also a valid
  // last segment.
  fruitless_ += over_ && in_order_ == 0 ? 1U : 0U;
  return fruitless_ > kMaxFruitless ? AbortCode::sequence_number : why;
}

std::uint64_t BlockReceiver::acknowledge() {
  LINEGATE_ASSERT(over_ || may_acknowledge(), "the sub-block has ended or stalls");
  const std::uint8_t ackseq = in_order_;
  vain_ += newest_ == 0 ? 1U : 0U;
  in_doubt_ = in_doubt_ || newest_ == 0;
  complete_ = last_taken_;
  follow_losses();
  const bool stalls = !over_ && newest_ != 0;
  if (over_) {
    late_ = {};
  } else if (stalls) {
    late_ = {newest_, block_size_};
  }
  begin_sub_block();
  // A sender ignores an equal acknowledgement within a sub-block: it may be a repeated frame.
  if (stalls && word_of(ackseq) == acknowledgement_ && block_size_ > 1) {
    --block_size_;
  }
  acknowledgement_ = word_of(ackseq);
  return acknowledgement_;
}

std::uint64_t BlockReceiver::word_of(std::uint8_t ackseq) const {
  return std::uint64_t{kBlockAck} | std::uint64_t{ackseq} << 8U | std::uint64_t{block_size_} << 16U;
}

bool BlockReceiver::may_be_late(unsigned number) const {
  const std::uint8_t before = newest_ == 0 ? std::min(late_.newest, block_size_) : block_size_;
  return number > before && number <= late_.last;
}

bool BlockReceiver::may_acknowledge() const {
  if (newest_ != 0) {
    return true;
  }
  const std::optional<std::size_t> left = bytes_left();
  return with_crc_ && left && *left <= kFewBytes && vain_ < kMaxVain;
}

bool BlockReceiver::is_repetition(std::uint64_t segment) const {
  const std::uint64_t number = segment & kSequenceBits;
  return segment == held_ || (in_doubt_ && number >= 1 && number <= kFewBytes / kSegmentSize);
}

AbortCode BlockReceiver::finish(std::uint64_t end_request, Sink& sink) {
  LINEGATE_ASSERT(complete_, "every segment was acknowledged");
  const std::size_t unused = end_request >> 2U & 7U;
  const AbortCode why = release(kSegmentSize - unused, sink);
  if (why != AbortCode::none && why != od::kLater) {
    return why;
  }
  const auto received = static_cast<std::uint16_t>(end_request >> 8U);
  return with_crc_ && received != crc_ ? AbortCode::crc : why;
}

AbortCode BlockReceiver::release(std::size_t size, Sink& sink) {
  if (!holds_) {
    return AbortCode::none;
  }
  Payload segment;
  store_le(segment.data(), held_);
  const auto bytes = std::span<const std::byte>(segment).subspan(1, size);
  if (with_crc_) {
    crc_ = crc_of(bytes, crc_);
  }
  const AbortCode why = sink.append(bytes);
  return in_doubt_ && why == AbortCode::length_too_high ? AbortCode::sequence_number : why;
}

std::optional<std::size_t> BlockReceiver::bytes_left() const {
  if (!announced_) {
    return std::nullopt;
  }
  return std::max<std::size_t>(*announced_, taken_) - taken_;
}

// Call it at the end of a sub-block. A sub-block without any segment is no evidence of a lost
// segment.
void BlockReceiver::follow_losses() {
  if (newest_ == 0) {
    return;
  }
  if (!over_ || in_order_ < newest_) {
    lossy_ = true;
    most_ = std::max(fewest_, static_cast<std::uint8_t>(most_ / 2));
  } else if (most_ < kMaxBlockSize) {
    ++most_;
  }
}

void BlockReceiver::begin_sub_block() {
  block_size_ = best_block_size(bytes_left(), most_);
  in_order_ = 0;
  newest_ = 0;
  seen_ = 0;
  over_ = false;
}

// --- segments of an aborted sub-block -----------------------------------------------------------

void LateSegments::expect(std::uint8_t newest, std::uint8_t block_size, Instant now) {
  newest_ = newest;
  block_size_ = newest < block_size ? block_size : std::uint8_t{0};
  until_ = now + kQuiet;
}

bool LateSegments::take(std::uint8_t command, Instant now) {
  const unsigned number = command & kSequenceBits;
  const bool late =
      now < until_ && number > newest_ && number <= newest_ + kMaxGap && number <= block_size_;
  const bool over = !late || number == block_size_ || (command & kBlockLastSegment) != 0;
  newest_ = static_cast<std::uint8_t>(number);
  block_size_ = over ? std::uint8_t{0} : block_size_;
  until_ = now + kQuiet;
  return late;
}

}  // namespace linegate::sdo
