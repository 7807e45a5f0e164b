// SPDX-License-Identifier: Apache-2.0
#include "stack/observer/sdo_channels.h"

#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::observer {
namespace {

constexpr std::uint16_t kFirstServer = od::objects::kSdoServer + 1;
constexpr std::uint8_t kRequestCobId = 1;
constexpr std::uint8_t kResponseCobId = 2;

// The default channel, which every node has (CiA 301, 7.3.5), is followed separately.
bool is_default(can::CobId request, can::CobId response) {
  const std::uint32_t node = request.id() - can::kSdoRequestBase;
  return !request.extended() && !response.extended() && node >= can::kMinNodeId &&
         node <= can::kMaxNodeId && response.id() == can::kSdoResponseBase + node;
}

bool exists(can::CobId request, can::CobId response) {
  return request.valid() && response.valid() && request.id() != 0 && response.id() != 0 &&
         !is_default(request, response);
}

}  // namespace

void SdoChannels::add(std::uint8_t node, const od::DeviceDescription& device) {
  for (const od::ObjectDescription& object : device.objects) {
    for (const od::VariableDescription& variable : object.variables) {
      if (variable.value.size() == sizeof(std::uint32_t)) {
        learn(node, {object.index, variable.sub}, load_le<std::uint32_t>(variable.value.data()));
      }
    }
  }
}

SdoChannels::Channel& SdoChannels::of(std::uint8_t node, std::uint16_t server) {
  const auto found = std::ranges::find_if(channels_, [&](const Channel& channel) {
    return channel.node == node && channel.server == server;
  });
  return found != channels_.end() ? *found
                                  : channels_.emplace_back(Channel{.node = node, .server = server});
}

void SdoChannels::learn(std::uint8_t node, od::Address address, std::uint32_t value) {
  if (address.index < kFirstServer || address.index > od::objects::kLastSdoServer ||
      (address.sub != kRequestCobId && address.sub != kResponseCobId)) {
    return;
  }
  Channel& channel = of(node, address.index);
  can::CobId& known = address.sub == kRequestCobId ? channel.request : channel.response;
  if (known.raw == value) {
    return;
  }
  if (channel.heard) {
    listen(channel, false);
  }
  known.raw = value;
  channel.follower = {};
  channel.heard = exists(channel.request, channel.response);
  if (channel.heard) {
    listen(channel, true);
  }
}

void SdoChannels::listen(const Channel& channel, bool on) {
  const auto place = static_cast<std::uint16_t>(&channel - channels_.data());
  const auto index = static_cast<std::uint16_t>(kFurther | place * 2U);
  const auto set = [&](can::CobId cob_id, std::uint16_t target) {
    if (on) {
      dispatch_.add(cob_id.id(), cob_id.extended(), can::Service::sdo_client, target);
    } else {
      dispatch_.remove(cob_id.id(), cob_id.extended(), can::Service::sdo_client, target);
    }
  };
  set(channel.request, static_cast<std::uint16_t>(index | kRequest));
  set(channel.response, index);
}

bool SdoChannels::hears(const can::Frame& frame) const {
  const auto is = [&](can::CobId cob_id) {
    return cob_id.id() == frame.id && cob_id.extended() == frame.extended();
  };
  return std::ranges::any_of(channels_, [&](const Channel& channel) {
    return channel.heard && (is(channel.request) || is(channel.response));
  });
}

std::optional<Transfer> SdoChannels::receive(std::uint16_t index, const can::Frame& frame) {
  SdoFollower& follower = channels_[place(index)].follower;
  return (index & kRequest) != 0 ? follower.request(frame) : follower.answer(frame);
}

}  // namespace linegate::observer
