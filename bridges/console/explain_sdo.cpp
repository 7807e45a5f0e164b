// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/explain_sdo.h"

#include <algorithm>
#include <cstdio>
#include <span>

#include "bridges/console/explain.h"
#include "stack/base/abort_code.h"
#include "stack/sdo/protocol.h"

namespace linegate::console {
namespace {

using sdo::ClientCommand;
using sdo::ServerCommand;

// Longer values are described by their size alone.
constexpr std::size_t kMostKept = 80;

std::string bytes_text(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " byte" : " bytes");
}

std::string code_text(std::uint32_t code) {
  char digits[9];
  std::snprintf(digits, sizeof digits, "%08X", code);
  return std::string(code == 0 ? "no abort code" : describe(static_cast<AbortCode>(code))) + " (" +
         digits + ")";
}

od::Address address_of(const can::Frame& frame) {
  return sdo::multiplexer(sdo::word_of(frame));
}

std::uint32_t long_of(const can::Frame& frame) {
  return sdo::long_word(sdo::word_of(frame));
}

std::string size_text(const can::Frame& frame, bool has_size) {
  return has_size ? ", " + bytes_text(long_of(frame)) : std::string();
}

}  // namespace

std::string SdoConversation::explain(const can::Frame& frame, const od::DeviceDescription* device,
                                     bool request) {
  device_ = device;
  if (!sdo::well_formed(frame)) {
    return "no SDO frame: it does not have 8 bytes";
  }
  const std::uint8_t command = sdo::command_of(frame);
  const bool sends = block_ == (request ? Block::client_sends : Block::server_sends);
  if (sends && command != sdo::command_byte(ClientCommand::abort)) {
    return block_segment(frame);
  }
  return request ? this->request(frame) : answer(frame);
}

std::string SdoConversation::object() const {
  return known_ ? object_text(device_, address_) : "an object of an earlier request";
}

void SdoConversation::collect(const can::Frame& frame, std::size_t count) {
  total_ += count;
  for (std::size_t i = 0; i < count && data_.size() < kMostKept; ++i) {
    data_.push_back(frame.data[1 + i]);
  }
}

// The collected data, or its size if it was too long.
std::string SdoConversation::collected() const {
  return total_ == data_.size() && known_ ? value_of(device_, address_, data_)
                                          : bytes_text(total_) + " in all";
}

std::string SdoConversation::request(const can::Frame& frame) {
  const std::uint8_t command = sdo::command_of(frame);
  switch (static_cast<ClientCommand>(sdo::specifier(command))) {
    case ClientCommand::download_initiate:
      return begin(frame, true);
    case ClientCommand::upload_initiate:
      end_write(false);
      begin(frame, false);
      return "read " + object();
    case ClientCommand::download_segment:
      all_sent_ = write_ && (command & sdo::kLastSegment) != 0;
      return "write " + object() + ": " + segment(frame);
    case ClientCommand::upload_segment:
      return "read on in " + object();
    case ClientCommand::abort:
      return abort(frame, true);
    case ClientCommand::block_upload:
    case ClientCommand::block_download:
      return block_frame(frame, true);
  }
  return "a request that there is not";
}

std::string SdoConversation::answer(const can::Frame& frame) {
  const std::uint8_t command = sdo::command_of(frame);
  switch (static_cast<ServerCommand>(sdo::specifier(command))) {
    case ServerCommand::download_initiate:
      if (all_sent_ && write_ == address_of(frame)) {
        end_write(true);
      }
      return "written: " + object_text(device_, address_of(frame));
    case ServerCommand::upload_initiate:
      if ((command & sdo::kExpedited) != 0) {
        return object_text(device_, address_of(frame)) + " = " + expedited(frame);
      }
      begin(frame, false);
      return object() + " is uploaded in segments" +
             size_text(frame, (command & sdo::kSizeIndicated) != 0);
    case ServerCommand::download_segment:
      if (all_sent_) {
        end_write(true);
      }
      return "taken: part of " + object();
    case ServerCommand::upload_segment:
      return object() + ": " + segment(frame);
    case ServerCommand::abort:
      return abort(frame, false);
    case ServerCommand::block_download:
    case ServerCommand::block_upload:
      return block_frame(frame, false);
  }
  return "an answer that there is not";
}

void SdoConversation::begin_write(bool all_sent) {
  write_ = address_;
  all_sent_ = all_sent;
}

void SdoConversation::end_write(bool answered) {
  if (write_ && all_sent_ && !answered) {
    unanswered_ = write_;
  }
  write_.reset();
  all_sent_ = false;
}

// Starts a transfer, or continues the one under way.
std::string SdoConversation::begin(const can::Frame& frame, bool writes) {
  const std::uint8_t command = sdo::command_of(frame);
  address_ = address_of(frame);
  known_ = true;
  data_.clear();
  total_ = before_block_ = 0;
  last_number_ = 0;
  block_ = Block::none;
  if (!writes) {
    return {};
  }
  end_write(false);
  begin_write((command & sdo::kExpedited) != 0);
  if ((command & sdo::kExpedited) != 0) {
    return "write " + object() + " = " + expedited(frame);
  }
  return "write " + object() + " in parts" + size_text(frame, (command & sdo::kSizeIndicated) != 0);
}

// If the frame indicates no size, the value has the size of the object, or four bytes if that is
// unknown.
std::string SdoConversation::expedited(const can::Frame& frame) const {
  const std::uint8_t command = sdo::command_of(frame);
  const od::Address address = address_of(frame);
  std::size_t size = sdo::expedited_size(command);
  const auto* variable = device_ == nullptr ? nullptr : device_->find(address);
  if ((command & sdo::kSizeIndicated) == 0 && variable != nullptr) {
    const std::size_t of_type = od::byte_size(variable->type);
    size = of_type != 0 && of_type <= size ? of_type : size;
  }
  return value_of(device_, address, std::span(frame.data).subspan(4, size));
}

std::string SdoConversation::segment(const can::Frame& frame) {
  const std::uint8_t command = sdo::command_of(frame);
  const std::size_t count = sdo::segment_size(command);
  collect(frame, count);
  if ((command & sdo::kLastSegment) == 0) {
    return bytes_text(count) + " more, " + std::to_string(total_) + " so far";
  }
  return "the last " + bytes_text(count) + "; = " + collected();
}

std::string SdoConversation::abort(const can::Frame& frame, bool client) {
  block_ = Block::none;
  if (write_ == address_of(frame) || address_of(frame) == od::Address{}) {
    end_write(!client);
  }
  return std::string(client ? "client gives up " : "refused: ") +
         object_text(device_, address_of(frame)) + ": " + code_text(long_of(frame));
}

// --- block transfer -----------------------------------------------------------------------------

std::string SdoConversation::block_segment(const can::Frame& frame) {
  const std::uint8_t command = sdo::command_of(frame);
  const unsigned number = command & 0x7FU;
  // The last segment may be shorter; the end of the transfer shows by how much
  collect(frame, sdo::kSegmentSize);
  last_number_ = (command & sdo::kBlockLastSegment) != 0 ? number : 0;
  return object() + ": segment " + std::to_string(number) +
         (last_number_ != 0 ? " of a block, the last" : " of a block");
}

// Segments that the receiver missed are repeated in the next block.
void SdoConversation::keep_segments(unsigned count) {
  total_ = std::min(total_, before_block_ + sdo::kSegmentSize * count);
  data_.resize(std::min(data_.size(), total_));
  before_block_ = total_;
}

std::string SdoConversation::block_frame(const can::Frame& frame, bool request) {
  const std::uint8_t command = sdo::command_of(frame);
  if (sdo::is_block_send(command)) {
    return block_send(frame, request);
  }
  if (sdo::is_block_send_end(command)) {
    return block_end(frame);
  }
  return block_answer(frame, request);
}

// The sender of the data starts: the client of a download, the server of an upload.
std::string SdoConversation::block_send(const can::Frame& frame, bool request) {
  begin(frame, false);
  if (request) {
    end_write(false);
    begin_write(false);
  }
  block_ = Block::agreed;
  return (request ? "write " + object() + " in blocks" : object() + " is uploaded in blocks") +
         size_text(frame, (sdo::command_of(frame) & sdo::kBlockSize) != 0);
}

std::string SdoConversation::block_end(const can::Frame& frame) {
  const std::size_t unused = sdo::command_of(frame) >> 2U & 7U;
  block_ = Block::none;
  all_sent_ = write_.has_value();
  const std::size_t less = std::min(unused, total_);
  if (total_ == data_.size()) {
    data_.resize(data_.size() - less);
  }
  total_ -= less;
  return object() + ": end of the blocks; = " + collected();
}

std::string SdoConversation::block_answer(const can::Frame& frame, bool request) {
  const std::uint8_t command = sdo::command_of(frame);
  const auto sender = request ? Block::server_sends : Block::client_sends;
  if (sdo::is_block_take(command)) {
    const bool reads = request;
    if (reads) {
      end_write(false);
      begin(frame, false);
    }
    block_ = reads ? Block::agreed : sender;
    return (reads ? "read " + object() + " in blocks of " : "ready for blocks of ") +
           std::to_string(std::to_integer<unsigned>(frame.data[4])) + " segments";
  }
  switch (command) {
    case sdo::kBlockStart:
      block_ = sender;
      return "let the blocks of " + object() + " come";
    case sdo::kBlockAck:
      keep_segments(std::to_integer<unsigned>(frame.data[1]));
      block_ = last_number_ != 0 && last_number_ == std::to_integer<unsigned>(frame.data[1])
                   ? Block::all_sent
                   : sender;
      return "segments up to " + std::to_string(std::to_integer<unsigned>(frame.data[1])) +
             " have come, the next block has " +
             std::to_string(std::to_integer<unsigned>(frame.data[2]));
    case sdo::kBlockTakeEnd:
      block_ = Block::none;
      end_write(true);
      return "all of " + object() + " has come";
    default:
      return "a block transfer command that there is not";
  }
}

}  // namespace linegate::console
