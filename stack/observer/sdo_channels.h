// SPDX-License-Identifier: Apache-2.0
// The SDO channels of nodes besides the default ones: their servers 1201h to 127Fh (CiA 301,
// 7.5.2.33, SDO server parameter), with the COB-IDs that their files say or that were overheard,
// and the transfers of others on them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/can/dispatch.h"
#include "stack/observer/sdo_follower.h"
#include "stack/od/description.h"

namespace linegate::observer {

class SdoChannels {
 public:
  // Of can::Target::index, with Service::sdo_client: the frame is of a channel that is kept here.
  static constexpr std::uint16_t kFurther = 0x8000;

  // dispatch must outlive this.
  explicit SdoChannels(can::Dispatch& dispatch) : dispatch_(dispatch) {}

  // What the node has when it starts.
  void add(std::uint8_t node, const od::DeviceDescription& device);
  // The object of the node has this value now. Without effect unless it is a COB-ID of one of these
  // servers. May change the dispatch table.
  void learn(std::uint8_t node, od::Address address, std::uint32_t value);

  // A frame for this target (kFurther is in its index), and whose it is.
  std::uint8_t node_of(std::uint16_t index) const { return channel(index).node; }
  // The frame's identifier is one of a channel that is kept here, and perhaps a default one, too.
  bool hears(const can::Frame& frame) const;
  // The transfer that ends with it, if one does.
  std::optional<Transfer> receive(std::uint16_t index, const can::Frame& frame);

 private:
  struct Channel {
    std::uint8_t node = 0;
    std::uint16_t server = 0;  // its index
    can::CobId request{};      // client to server
    can::CobId response{};
    bool heard = false;  // is in the dispatch table
    SdoFollower follower{};
  };
  // For each channel two targets in a row.
  static constexpr std::uint16_t kRequest = 1;

  static constexpr std::size_t place(std::uint16_t index) { return (index & 0x7FFFU) / 2U; }

  const Channel& channel(std::uint16_t index) const { return channels_[place(index)]; }
  Channel& of(std::uint8_t node, std::uint16_t server);
  void listen(const Channel& channel, bool on);

  can::Dispatch& dispatch_;
  std::vector<Channel> channels_;  // never fewer: at most 127 of 127 nodes
};

}  // namespace linegate::observer
