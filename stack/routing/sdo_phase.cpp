// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/sdo_phase.h"

#include <algorithm>

#include "stack/sdo/protocol.h"

namespace linegate::routing {
namespace {

using sdo::ClientCommand;
using sdo::ServerCommand;

constexpr std::uint8_t kAbort = sdo::command_byte(ClientCommand::abort);

bool is(std::uint8_t command, ClientCommand wanted) {
  return sdo::specifier(command) == static_cast<std::uint8_t>(wanted);
}
bool is(std::uint8_t command, ServerCommand wanted) {
  return sdo::specifier(command) == static_cast<std::uint8_t>(wanted);
}

}  // namespace

bool SdoPhase::initiates(std::uint64_t request) {
  const auto command = static_cast<std::uint8_t>(request);
  return is(command, ClientCommand::upload_initiate) ||
         is(command, ClientCommand::download_initiate) || sdo::is_block_send(command) ||
         sdo::is_block_take(command);
}

bool SdoPhase::writes(std::uint64_t request) {
  const auto command = static_cast<std::uint8_t>(request);
  return is(command, ClientCommand::download_initiate) || sdo::is_block_send(command);
}

bool SdoPhase::begins(std::uint64_t request) const {
  const bool repeated = state_ == State::block_download_end && request == last_segment_;
  return !in_sub_block() && !repeated && initiates(request);
}

SdoPhase::End SdoPhase::request(std::uint64_t word) {
  const auto command = static_cast<std::uint8_t>(word);
  if (command == kAbort) {
    return end(End::aborted);
  }
  if (state_ == State::block_segments) {
    last_segment_ = (command & sdo::kBlockLastSegment) != 0 ? word : last_segment_;
    return End::none;
  }
  if (state_ == State::block_download_end && word == last_segment_) {
    return End::none;  // the frame was repeated on the bus
  }
  if (initiates(word)) {
    begin(word);
  } else if (state_ == State::download && is(command, ClientCommand::download_segment)) {
    last_ = (command & sdo::kLastSegment) != 0;
    bytes_ += static_cast<std::uint32_t>(sdo::segment_size(command));
  } else if (state_ == State::block_download_end) {
    last_ = last_ || sdo::is_block_send_end(command);
    block_ends(command);
  } else if (state_ == State::block_upload && command == sdo::kBlockAck) {
    acknowledged(sdo::byte_of(word, 1));
  } else if (state_ == State::block_upload && command == sdo::kBlockTakeEnd) {
    return end(End::finished);
  }
  return End::none;
}

void SdoPhase::begin(std::uint64_t word) {
  const auto command = static_cast<std::uint8_t>(word);
  address_ = sdo::multiplexer(word);
  service_ = writes(word) ? Service::download : Service::upload;
  bytes_ = 0;
  unused_ = 0;
  last_segment_ = 0;
  last_ = false;
  if (is(command, ClientCommand::upload_initiate)) {
    state_ = State::upload_initiate;
  } else if (is(command, ClientCommand::download_initiate)) {
    state_ = State::download_initiate;
    last_ = (command & sdo::kExpedited) != 0;
    bytes_ = last_ ? static_cast<std::uint32_t>(sdo::expedited_size(command)) : 0;
  } else {
    state_ =
        sdo::is_block_send(command) ? State::block_download_initiate : State::block_upload_initiate;
  }
}

SdoPhase::End SdoPhase::response(std::uint64_t word) {
  const auto command = static_cast<std::uint8_t>(word);
  if (command == kAbort) {
    return end(End::aborted);
  }
  switch (state_) {
    case State::upload:
      if (!is(command, ServerCommand::upload_segment)) {
        return End::none;
      }
      bytes_ += static_cast<std::uint32_t>(sdo::segment_size(command));
      return (command & sdo::kLastSegment) != 0 ? end(End::finished) : End::none;
    case State::block_upload:
      block_ends(command);  // or a segment that looks like the end, but is not the last frame
      return End::none;
    case State::download:
      return is(command, ServerCommand::download_segment) && last_ ? end(End::finished) : End::none;
    case State::block_segments:
      if (command == sdo::kBlockAck) {
        const unsigned number = sdo::byte_of(word, 1);
        const bool all =
            last_segment_ != 0 && number != 0 && number == (sdo::byte_of(last_segment_, 0) & 0x7FU);
        acknowledged(number);
        state_ = all ? State::block_download_end : state_;
        last_segment_ = all ? last_segment_ : 0;
      }
      [[fallthrough]];
    case State::block_download_end:
      return command == sdo::kBlockTakeEnd ? end(End::finished) : End::none;
    default:
      return answered_initiate(command);
  }
}

SdoPhase::End SdoPhase::answered_initiate(std::uint8_t command) {
  const bool upload = state_ == State::upload_initiate || state_ == State::block_upload_initiate;
  if (upload && is(command, ServerCommand::upload_initiate)) {
    if ((command & sdo::kExpedited) != 0) {
      bytes_ = static_cast<std::uint32_t>(sdo::expedited_size(command));
      return end(End::finished);
    }
    state_ = State::upload;
  } else if (state_ == State::block_upload_initiate && is(command, ServerCommand::block_upload)) {
    state_ = State::block_upload;
  } else if (state_ == State::download_initiate && is(command, ServerCommand::download_initiate)) {
    if (last_) {
      return end(End::finished);
    }
    state_ = State::download;
  } else if (state_ == State::block_download_initiate && sdo::is_block_take(command)) {
    state_ = State::block_segments;
  }
  return End::none;
}

bool SdoPhase::awaits_first_answer() const {
  return state_ == State::upload_initiate || state_ == State::download_initiate ||
         state_ == State::block_download_initiate || state_ == State::block_upload_initiate;
}

bool SdoPhase::is_first_answer(std::uint64_t word) const {
  const auto command = static_cast<std::uint8_t>(word);
  const od::Address address = sdo::multiplexer(word);
  if (command == kAbort) {
    return address == address_ || address == od::Address{};
  }
  const bool upload = state_ == State::upload_initiate || state_ == State::block_upload_initiate;
  const bool fits =
      (upload && is(command, ServerCommand::upload_initiate)) ||
      (state_ == State::block_upload_initiate && is(command, ServerCommand::block_upload)) ||
      (state_ == State::download_initiate && is(command, ServerCommand::download_initiate)) ||
      (state_ == State::block_download_initiate && sdo::is_block_take(command));
  return fits && address == address_;
}

void SdoPhase::acknowledged(unsigned segments) {
  bytes_ += static_cast<std::uint32_t>(segments * sdo::kSegmentSize);
}

// May be called more than once: unused_ is subtracted only when the transfer ends.
void SdoPhase::block_ends(std::uint8_t command) {
  if (sdo::is_block_send_end(command)) {
    unused_ = (command >> 2U) & 7U;
  }
}

SdoPhase::End SdoPhase::end(End how) {
  bytes_ -= how == End::finished ? std::min<std::uint32_t>(unused_, bytes_) : 0U;
  const End ended = state_ == State::idle && how == End::finished ? End::none : how;
  state_ = State::idle;
  return ended;
}

}  // namespace linegate::routing
