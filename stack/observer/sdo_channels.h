// SPDX-License-Identifier: Apache-2.0
// The SDO channels of nodes besides the default ones: their servers 1201h to 127Fh (CiA
// 301, 7.5.2.33, SDO server parameter), with the COB-IDs of their device files or those seen on the
// bus, and the transfers of other clients on these channels.
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
  // In can::Target::index, with Service::sdo_client: marks a frame of a channel of this object.
  static constexpr std::uint16_t kFurther = 0x8000;

  // dispatch must outlive this.
  explicit SdoChannels(can::Dispatch& dispatch) : dispatch_(dispatch) {}

  // Adds the SDO servers that the node has after its start.
  void add(std::uint8_t node, const od::DeviceDescription& device);
  // Processes a value of an object of the node. No effect unless it is a COB-ID of one of these
  // servers. May change the dispatch table.
  void learn(std::uint8_t node, od::Address address, std::uint32_t value);

  // The node of the channel. index: of a target with kFurther.
  std::uint8_t node_of(std::uint16_t index) const { return channel(index).node; }
  // Whether the frame's identifier belongs to a channel of this object; it may belong to a default
  // channel too.
  bool hears(const can::Frame& frame) const;
  // Returns the transfer that ends with this frame, if any.
  std::optional<Transfer> receive(std::uint16_t index, const can::Frame& frame);

 private:
  struct Channel {
    std::uint8_t node = 0;
    std::uint16_t server = 0;  // index of its server object
    can::CobId request{};      // client to server
    can::CobId response{};
    bool heard = false;  // registered in the dispatch table
    SdoFollower follower{};
  };
  // Each channel has two consecutive targets.
  static constexpr std::uint16_t kRequest = 1;

  static constexpr std::size_t place(std::uint16_t index) { return (index & 0x7FFFU) / 2U; }

  const Channel& channel(std::uint16_t index) const { return channels_[place(index)]; }
  Channel& of(std::uint8_t node, std::uint16_t server);
  void listen(const Channel& channel, bool on);

  can::Dispatch& dispatch_;
  std::vector<Channel> channels_;  // never shrinks: at most 127 channels of each of 127 nodes
};

}  // namespace linegate::observer
