// SPDX-License-Identifier: Apache-2.0
// The client side of block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.16), and when it is used.
#include "stack/base/assert.h"
#include "stack/sdo/client.h"

namespace linegate::sdo {
namespace {

// The server refuses the access independently of the protocol: 0601 0001h to 0609 xxxxh and 0800
// 002xh.
bool is_about_object(AbortCode code) {
  const auto number = static_cast<std::uint32_t>(code);
  return (number >= 0x0601'0001 && number <= 0x0609'FFFF) || number >> 4U == 0x0800'002;
}

}  // namespace

// A value of unknown size counts as long.
bool Client::worth_a_block(std::optional<std::uint32_t> size) const {
  const std::uint32_t from = options_.block_from;
  return options_.transfer == Transfer::automatic && from != kNoBlocks &&
         size.value_or(from) >= from && !blocks_refused_;
}

bool Client::initiates_block() const {
  return state_ == State::block_download_initiate || state_ == State::block_upload_initiate;
}

void Client::initiate_block(Instant now, can::TransmitQueue& queue) {
  tried_block_ = true;
  if (writing_) {
    const std::optional<std::uint32_t> size = source_.size();
    const auto command =
        static_cast<std::uint8_t>(kBlockSend | kBlockCrc | (size ? kBlockSize : 0));
    request(State::block_download_initiate, initiate_word(command, address_, size.value_or(0)), now,
            queue);
    return;
  }
  const unsigned threshold = announced_size_ ? 0U : kSwitchThreshold;
  request(State::block_upload_initiate,
          initiate_word(kBlockTake | kBlockCrc, address_,
                        BlockReceiver::best_block_size(announced_size_) | threshold << 8U),
          now, queue);
}

// A server whose answer to the initiate was lost requests the segments again after a while.
bool Client::initiate_answer_lost(std::uint8_t command, Instant now) const {
  return state_ == State::block_download_initiate && command == kBlockAck &&
         now >= deadline_ - timeout_ + kAskedAgainFrom;
}

bool Client::fits_block_initiate(std::uint8_t command) const {
  constexpr unsigned kFlags = kBlockCrc | kBlockSize;
  return state_ == State::block_download_initiate
             ? (command & ~unsigned{kBlockCrc}) == kBlockTake
             : state_ == State::block_upload_initiate && (command & ~kFlags) == kBlockSend;
}

// Continues in segments if the server refuses block transfer; whatever the code, if the server has
// just indicated the size of the object.
bool Client::fall_back(AbortCode code, Instant now, can::TransmitQueue& queue) {
  if (!initiates_block() || (is_about_object(code) && !announced_size_)) {
    return false;
  }
  blocks_refused_ = blocks_refused_ || code == AbortCode::command_specifier;
  block_unanswered_ = false;
  initiate(now, queue);
  return true;
}

// One unanswered block initiate may be a lost frame; after the second one block transfer is not
// tried again.
bool Client::fall_back_unanswered(Instant now, can::TransmitQueue& queue) {
  if (!initiates_block() || held_) {
    return false;
  }
  note_unanswered(now, queue);
  blocks_refused_ = blocks_refused_ || block_unanswered_;
  block_unanswered_ = true;
  send_abort(AbortCode::timeout, now, queue);
  initiate(now, queue);
  return true;
}

AbortCode Client::block_initiated(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  const bool crc = (word & kBlockCrc) != 0;
  block_unanswered_ = false;
  if (writing_) {
    const std::uint8_t block_size = byte_of(word, 4);
    if (block_size == 0 || block_size > kMaxBlockSize) {
      return AbortCode::block_size;
    }
    sender_.start(block_size, crc);
    state_ = State::block_download;
    return send_segments(now, queue);
  }
  std::optional<std::uint32_t> announced;
  if ((word & kBlockSize) != 0) {
    announced = long_word(word);
  }
  const AbortCode why = start_sink(announced);
  if (why != AbortCode::none) {
    return why;
  }
  receiver_.start(announced, crc, BlockReceiver::best_block_size(announced_size_), kFewestSegments);
  request(State::block_upload, kBlockStart, now, queue);
  block_wake_ = now + stall();
  return AbortCode::none;
}

// A repeated frame: an acknowledgement that cannot be that of the current sub-block, of which
// segments were not handed out to the bus yet, the last segment, or one of the few that were
// requested again while they were under way.
bool Client::is_repetition(std::uint64_t word, const can::TransmitQueue& queue) const {
  switch (state_) {
    case State::block_download:
      return word == last_used_ && (sender_.sending() || outbox_.waits(queue));
    case State::block_download_end:
      return word == last_used_;
    case State::block_upload_end:
      return receiver_.is_repetition(word);
    default:
      return false;
  }
}

AbortCode Client::block_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  const auto command = static_cast<std::uint8_t>(word);
  switch (state_) {
    case State::block_download:
      return command == kBlockAck ? block_acknowledged(word, now, queue)
                                  : AbortCode::command_specifier;
    case State::block_download_end:
      if (command != kBlockTakeEnd) {
        return AbortCode::command_specifier;
      }
      finish(AbortCode::none);
      return AbortCode::none;
    case State::block_upload:
      return block_segment_came(word, now, queue);
    default:
      LINEGATE_ASSERT(state_ == State::block_upload_end, "the block transfer was initiated");
      return is_block_send_end(command) ? block_upload_ended(word, now, queue)
                                        : AbortCode::command_specifier;
  }
}

AbortCode Client::block_acknowledged(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  return proceed_with_block(sender_.acknowledge(byte_of(word, 1), byte_of(word, 2), source_), now,
                            queue);
}

// After an acknowledgement, and its result.
AbortCode Client::proceed_with_block(AbortCode why, Instant now, can::TransmitQueue& queue) {
  if (why != AbortCode::none) {
    return why;
  }
  source_.acknowledge();
  if (!sender_.complete()) {
    return send_segments(now, queue);
  }
  request(State::block_download_end, sender_.end_request(), now, queue);
  block_wake_ = kNever;
  return AbortCode::none;
}

AbortCode Client::block_segment_came(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  const AbortCode why = receiver_.take(word, sink_);
  if (why != AbortCode::none) {
    return why;
  }
  deadline_ = now + timeout_;
  block_wake_ = now + stall();
  if (receiver_.over()) {
    acknowledge_block(now, queue);
  }
  return AbortCode::none;
}

void Client::acknowledge_block(Instant now, can::TransmitQueue& queue) {
  const std::uint64_t word = receiver_.acknowledge();
  request(receiver_.complete() ? State::block_upload_end : State::block_upload, word, now, queue);
  block_wake_ = receiver_.complete() ? kNever : now + stall();
}

AbortCode Client::block_upload_ended(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  AbortCode why = receiver_.finish(word, sink_);
  if (why == AbortCode::none) {
    why = finish_upload();
  }
  if (why == AbortCode::none) {
    outbox_.send(kBlockTakeEnd, now, queue);
  }
  return why;
}

AbortCode Client::send_segments(Instant now, can::TransmitQueue& queue) {
  while (sender_.sending() && outbox_.has_room_for_many(queue)) {
    const std::uint64_t segment = sender_.next_segment(source_);
    if (source_.error() != AbortCode::none) {
      return source_.error();
    }
    request(State::block_download, segment, now, queue);
  }
  if (sender_.early_due()) {
    return proceed_with_block(sender_.acknowledge_early(source_), now, queue);
  }
  block_wake_ = sender_.sending() ? now + Outbox::kRetry : kNever;
  return AbortCode::none;
}

void Client::advance_block(Instant now, can::TransmitQueue& queue) {
  LINEGATE_ASSERT(state_ == State::block_download || state_ == State::block_upload,
                  "a sub-block is under way");
  if (state_ == State::block_download) {
    if (const AbortCode why = send_segments(now, queue); why != AbortCode::none) {
      give_up(why, now, queue);
    }
  } else if (state_ == State::block_upload && receiver_.may_acknowledge()) {
    acknowledge_block(now, queue);
  } else {
    block_wake_ = kNever;
  }
}

}  // namespace linegate::sdo
