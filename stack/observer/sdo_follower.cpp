// SPDX-License-Identifier: Apache-2.0
#include "stack/observer/sdo_follower.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/sdo/protocol.h"

namespace linegate::observer {
namespace {

using sdo::ClientCommand;
using sdo::ServerCommand;

std::span<const std::byte> bytes_of(const can::Frame& frame, std::size_t from, std::size_t count) {
  return std::span<const std::byte>(frame.data).subspan(from, count);
}

}  // namespace

std::optional<Transfer> SdoFollower::request(const can::Frame& frame) {
  if (!sdo::well_formed(frame)) {
    return std::nullopt;
  }
  look_at_time(frame);
  const std::uint8_t command = sdo::command_of(frame);
  if (command == sdo::command_byte(ClientCommand::abort)) {
    return abort(frame);
  }
  if (phase_ == Phase::block_taking) {
    if (!last_ || !sdo::is_block_send_end(command)) {
      receive_block_segment(frame);
      return std::nullopt;
    }
    const std::uint64_t unused = command >> 2U & 7U;
    transfer_.size -= std::min(transfer_.size, unused);
    phase_ = Phase::block_taken;
    return std::nullopt;
  }
  if (phase_ == Phase::block_giving && command == sdo::kBlockAck) {
    acknowledge(std::to_integer<std::uint8_t>(frame.data[1]));
    return std::nullopt;
  }
  if (phase_ == Phase::block_given && command == sdo::kBlockTakeEnd) {
    return end();
  }
  if (phase_ == Phase::block_offered && command == sdo::kBlockStart) {
    phase_ = Phase::block_giving;
    return std::nullopt;
  }
  switch (static_cast<ClientCommand>(sdo::specifier(command))) {
    case ClientCommand::download_segment:
      if (phase_ == Phase::download_segments && sdo::toggle_of(command) == toggle_) {
        receive_segment(command, frame);
        phase_ = Phase::download_segment;
      }
      return std::nullopt;
    case ClientCommand::upload_segment:
      if (phase_ == Phase::upload_segments && sdo::toggle_of(command) == toggle_) {
        phase_ = Phase::upload_segment;
      }
      return std::nullopt;
    default:
      return begin(frame);
  }
}

// An initiate ends the transfer before it: a client may not begin one while another is in progress.
std::optional<Transfer> SdoFollower::begin(const can::Frame& frame) {
  const std::uint8_t command = sdo::command_of(frame);
  Phase phase = Phase::idle;
  switch (static_cast<ClientCommand>(sdo::specifier(command))) {
    case ClientCommand::download_initiate:
      phase = Phase::download;
      break;
    case ClientCommand::upload_initiate:
      phase = Phase::upload;
      break;
    case ClientCommand::block_download:
      phase = sdo::is_block_send(command) ? Phase::block_download : Phase::idle;
      break;
    case ClientCommand::block_upload:
      phase = sdo::is_block_take(command) ? Phase::block_upload : Phase::idle;
      break;
    default:
      break;
  }
  *this = SdoFollower{};
  phase_ = phase;
  heard_at_ = frame.time;
  transfer_.address = sdo::multiplexer(sdo::word_of(frame));
  transfer_.download = phase == Phase::download || phase == Phase::block_download;
  if (phase == Phase::download && (command & sdo::kExpedited) != 0) {
    expedited_ = true;
    transfer_.size = sdo::expedited_size(command);
    keep(0, bytes_of(frame, 4, sdo::expedited_size(command)));
  }
  return std::nullopt;
}

std::optional<Transfer> SdoFollower::answer(const can::Frame& frame) {
  if (!sdo::well_formed(frame) || phase_ == Phase::idle) {
    return std::nullopt;
  }
  look_at_time(frame);
  const std::uint8_t command = sdo::command_of(frame);
  if (command == sdo::command_byte(ServerCommand::abort)) {
    return abort(frame);
  }
  if (phase_ == Phase::block_giving) {
    if (last_ && sdo::is_block_send_end(command)) {
      const std::uint64_t unused = command >> 2U & 7U;
      transfer_.size -= std::min(transfer_.size, unused);
      phase_ = Phase::block_given;
    } else {
      receive_block_segment(frame);
    }
    return std::nullopt;
  }
  switch (static_cast<ServerCommand>(sdo::specifier(command))) {
    case ServerCommand::download_initiate:
      if (phase_ != Phase::download || !is_mine(frame)) {
        return lose();
      }
      phase_ = Phase::download_segments;
      return expedited_ ? end() : std::nullopt;
    case ServerCommand::download_segment:
      if (phase_ != Phase::download_segment || sdo::toggle_of(command) != toggle_) {
        return lose();
      }
      toggle_ = !toggle_;
      phase_ = Phase::download_segments;
      return last_ ? end() : std::nullopt;
    case ServerCommand::upload_initiate:
    case ServerCommand::upload_segment:
      return receive_upload(command, frame);
    default:
      return answer_block(command, frame);
  }
}

std::optional<Transfer> SdoFollower::receive_upload(std::uint8_t command, const can::Frame& frame) {
  if (sdo::specifier(command) == static_cast<std::uint8_t>(ServerCommand::upload_segment)) {
    if (phase_ != Phase::upload_segment || sdo::toggle_of(command) != toggle_) {
      return lose();
    }
    receive_segment(command, frame);
    toggle_ = !toggle_;
    phase_ = Phase::upload_segments;
    return last_ ? end() : std::nullopt;
  }
  // A server may also answer a block upload in this way, because of the client's protocol switch
  // threshold.
  if ((phase_ != Phase::upload && phase_ != Phase::block_upload) || !is_mine(frame)) {
    return lose();
  }
  phase_ = Phase::upload_segments;
  if ((command & sdo::kExpedited) == 0) {
    return std::nullopt;
  }
  transfer_.size = sdo::expedited_size(command);
  keep(0, bytes_of(frame, 4, sdo::expedited_size(command)));
  return end();
}

std::optional<Transfer> SdoFollower::answer_block(std::uint8_t command, const can::Frame& frame) {
  if (phase_ == Phase::block_download && sdo::is_block_take(command) && is_mine(frame)) {
    phase_ = Phase::block_taking;
    return std::nullopt;
  }
  if (phase_ == Phase::block_taking && command == sdo::kBlockAck) {
    acknowledge(std::to_integer<std::uint8_t>(frame.data[1]));
    return std::nullopt;
  }
  if (phase_ == Phase::block_taken && command == sdo::kBlockTakeEnd) {
    return end();
  }
  if (phase_ == Phase::block_upload && sdo::is_block_send(command) && is_mine(frame)) {
    phase_ = Phase::block_offered;
    return std::nullopt;
  }
  return lose();
}

std::optional<Transfer> SdoFollower::end() {
  LINEGATE_ASSERT_HOT(phase_ != Phase::idle, "a transfer that ends was in progress");
  phase_ = Phase::idle;
  return holes_ ? std::nullopt : std::optional(transfer_);
}

// Only an abort of the transfer in progress: the beginning of any other one was not received.
std::optional<Transfer> SdoFollower::abort(const can::Frame& frame) {
  if (std::exchange(phase_, Phase::idle) == Phase::idle) {
    return std::nullopt;
  }
  Transfer out = transfer_;
  out.size = 0;
  out.aborted = true;
  out.abort = static_cast<AbortCode>(sdo::long_word(sdo::word_of(frame)));
  return out;
}

std::optional<Transfer> SdoFollower::lose() {
  phase_ = Phase::idle;
  return std::nullopt;
}

void SdoFollower::receive_segment(std::uint8_t command, const can::Frame& frame) {
  const std::size_t count = sdo::segment_size(command);
  keep(transfer_.size, bytes_of(frame, 1, count));
  transfer_.size += count;
  last_ = (command & sdo::kLastSegment) != 0;
}

// A segment that the receiver lost is repeated with its old number.
void SdoFollower::receive_block_segment(const can::Frame& frame) {
  const std::uint8_t command = sdo::command_of(frame);
  const std::uint8_t number = command & sdo::kMaxBlockSize;
  if (number == 0) {
    return;
  }
  heard_.set(number);
  keep(transfer_.size + (number - 1U) * sdo::kSegmentSize, bytes_of(frame, 1, sdo::kSegmentSize));
  if ((command & sdo::kBlockLastSegment) != 0) {
    last_block_segment_ = number;
  }
}

// A number above the largest block is a lie: what the transfer has is not known.
void SdoFollower::acknowledge(std::uint8_t number) {
  holes_ = holes_ || number > sdo::kMaxBlockSize;
  for (std::uint8_t i = 1; i <= number && i < heard_.size(); ++i) {
    holes_ = holes_ || !heard_.test(i);
  }
  transfer_.size += number * std::uint64_t{sdo::kSegmentSize};
  last_ = last_block_segment_ != 0 && number == last_block_segment_;
  last_block_segment_ = 0;
  heard_.reset();
}

void SdoFollower::keep(std::uint64_t at, std::span<const std::byte> bytes) {
  for (const std::byte b : bytes) {
    if (at < transfer_.data.size()) {
      transfer_.data[static_cast<std::size_t>(at++)] = b;
    }
  }
}

bool SdoFollower::is_mine(const can::Frame& frame) const {
  return sdo::multiplexer(sdo::word_of(frame)) == transfer_.address;
}

void SdoFollower::look_at_time(const can::Frame& frame) {
  if (phase_ != Phase::idle && frame.time - heard_at_ > kPatience) {
    phase_ = Phase::idle;
  }
  heard_at_ = frame.time;
}

}  // namespace linegate::observer
