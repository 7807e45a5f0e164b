// SPDX-License-Identifier: Apache-2.0
// Explains SDO frames in words (CiA 301 7.2.4).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "stack/can/frame.h"
#include "stack/od/description.h"

namespace linegate::console {

// The state of one SDO channel. Frames that do not fit the state are described as such and leave it
// unchanged.
class SdoConversation {
 public:
  // Explains one frame. device: object dictionary of the server, nullptr if unknown. request: sent
  // by the client.
  std::string explain(const can::Frame& frame, const od::DeviceDescription* device, bool request);
  // The object of a write of which all data were sent, and which ended without an answer of the
  // server: the client aborted it, or began another transfer. It may have been carried out. Once.
  std::optional<od::Address> pop_unanswered() { return std::exchange(unanswered_, std::nullopt); }
  // The device is reset: it answers no request from before.
  void reset() { write_.reset(); }

 private:
  // Block transfer: segments have no command specifier, so the sender must be known.
  enum class Block : std::uint8_t { none, agreed, client_sends, server_sends, all_sent };

  std::string request(const can::Frame& frame);
  std::string answer(const can::Frame& frame);
  std::string begin(const can::Frame& frame, bool writes);
  std::string expedited(const can::Frame& frame) const;
  std::string segment(const can::Frame& frame);
  std::string abort(const can::Frame& frame, bool client);
  std::string block_segment(const can::Frame& frame);
  std::string block_frame(const can::Frame& frame, bool request);
  std::string block_send(const can::Frame& frame, bool request);
  std::string block_end(const can::Frame& frame);
  std::string block_answer(const can::Frame& frame, bool request);
  std::string object() const;
  std::string collected() const;
  void begin_write(bool all_sent);
  void end_write(bool answered);
  void keep_segments(unsigned count);
  void collect(const can::Frame& frame, std::size_t count);

  const od::DeviceDescription* device_ = nullptr;  // of the current frame
  od::Address address_;
  bool known_ = false;  // the object of the transfer is known
  std::vector<std::byte> data_;
  std::size_t total_ = 0;  // bytes transferred, including those that were not kept
  Block block_ = Block::none;
  std::size_t before_block_ = 0;  // total_ at the start of the current block
  // Sequence number of the last segment of the current block; 0 = not received yet
  unsigned last_number_ = 0;
  // The write that the server has not answered yet, and whether all its data were sent.
  std::optional<od::Address> write_;
  bool all_sent_ = false;
  std::optional<od::Address> unanswered_;
};

}  // namespace linegate::console
