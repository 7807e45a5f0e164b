// SPDX-License-Identifier: Apache-2.0
// SDO frames in words (CiA 301, 7.2.4).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "stack/can/frame.h"
#include "stack/od/description.h"

namespace linegate::console {

// What client and server of one channel say to each other. Frames that fit nothing are told as such
// and change nothing.
class SdoConversation {
 public:
  // One frame. device: its object dictionary, nullptr if it is not known. request: from the client.
  std::string explain(const can::Frame& frame, const od::DeviceDescription* device, bool request);

 private:
  // In a block transfer one side sends segments without a command specifier.
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
  void keep_segments(unsigned count);
  void collect(const can::Frame& frame, std::size_t count);

  const od::DeviceDescription* device_ = nullptr;  // of the frame in hand
  od::Address address_;
  bool known_ = false;  // which object the transfer is about
  std::vector<std::byte> data_;
  std::size_t total_ = 0;  // bytes, also of those that are too many to be kept
  Block block_ = Block::none;
  std::size_t before_block_ = 0;  // total_ when the present block began
  unsigned last_number_ = 0;      // of the segments of the present block; 0 = the last is not there
};

}  // namespace linegate::console
