// SPDX-License-Identifier: Apache-2.0
// Which node or group of outputs each instance of a state topic stands for: a disposed instance is
// received with its handle alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "bridges/dds/line_publishers.h"

namespace linegate::dds {

// Handle: of the instance, of any type with an order.
template <class Handle>
class StateInstances {
 public:
  // Bounded: any host may publish any names. The readers of the profile have 32,512 instances. The
  // end of instances beyond it is not reported.
  static constexpr std::size_t kMost = 65'536;

  struct Place {
    std::string gateway;
    std::string line;
    std::uint16_t number = 0;  // of the node or group
  };

  // A sample of the instance was received from that writer.
  void note(const Handle& instance, Place place, const WriterGuid& writer) {
    const auto found = places_.find(instance);
    if (found != places_.end()) {
      found->second.second = writer;
    } else if (places_.size() < kMost) {
      places_.emplace(instance, std::pair(std::move(place), writer));
    }
  }

  // That writer disposed the instance. Nothing if another writer wrote its last sample: the end of
  // an earlier writer may arrive after the first sample of its successor.
  std::optional<Place> end(const Handle& instance, const WriterGuid& writer) {
    const auto found = places_.find(instance);
    if (found == places_.end() || found->second.second != writer)
      return std::nullopt;
    Place place = std::move(found->second.first);
    places_.erase(found);
    return place;
  }

 private:
  std::map<Handle, std::pair<Place, WriterGuid>> places_;
};

}  // namespace linegate::dds
