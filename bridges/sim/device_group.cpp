// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/device_group.h"

#include <algorithm>
#include <utility>

namespace linegate::sim {

bool DeviceGroup::add(std::unique_ptr<Device> device) {
  if (find(device->options().node_id) != nullptr) {
    return false;
  }
  devices_.push_back(std::move(device));
  offered_.emplace_back();
  return true;
}

Device* DeviceGroup::find(std::uint8_t node_id) {
  const auto found = std::ranges::find_if(
      devices_, [node_id](const auto& device) { return device->options().node_id == node_id; });
  return found == devices_.end() ? nullptr : found->get();
}

void DeviceGroup::start(Instant now) {
  for (const auto& device : devices_) {
    device->start(now);
  }
}

void DeviceGroup::receive(std::span<const can::Frame> frames) {
  for (const auto& device : devices_) {
    device->receive(frames);
  }
}

void DeviceGroup::advance(Instant now) {
  for (const auto& device : devices_) {
    device->advance(now);
  }
}

Instant DeviceGroup::next_wake() const {
  Instant next = kNever;
  for (const auto& device : devices_) {
    next = earlier(next, device->next_wake());
  }
  return next;
}

// A frame that was pulled from a device is kept here until it wins arbitration. Frames of a device
// that was killed are discarded.
bool DeviceGroup::refresh_offer(std::size_t index, Instant now) {
  Offered& offer = offered_[index];
  offer.valid = offer.valid && devices_[index]->alive();
  if (!offer.valid) {
    offer.valid = devices_[index]->next_frame(offer.frame, now);
  }
  return offer.valid;
}

bool DeviceGroup::next_frame(can::Frame& out, Instant now) {
  std::size_t best = devices_.size();
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    if (refresh_offer(i, now) && (best == devices_.size() ||
                                  can::wins_arbitration(offered_[i].frame, offered_[best].frame))) {
      best = i;
    }
  }
  if (best == devices_.size()) {
    return false;
  }
  offered_[best].valid = false;
  out = offered_[best].frame;
  can::Frame heard = out;
  heard.time = now;
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    if (i != best) {
      devices_[i]->receive({&heard, 1});
    }
  }
  return true;
}

bool DeviceGroup::wants_to_send(Instant now) const {
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    if (devices_[i]->wants_to_send(now) || (offered_[i].valid && devices_[i]->alive())) {
      return true;
    }
  }
  return false;
}

}  // namespace linegate::sim
