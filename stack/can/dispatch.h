// SPDX-License-Identifier: Apache-2.0
// Maps CAN identifiers to services: constant-time look-up.
//
// 11-bit identifiers index a table of 2048 entries; 29-bit ones use an open-addressed hash table.
// Several services may be registered for the same identifier (two RPDOs on one COB-ID); they are
// called in the order in which they were added. Changing the table allocates and is for
// configuration time; look-up does not allocate.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/assert.h"
#include "stack/base/event.h"
#include "stack/can/frame.h"

namespace linegate::can {

enum class Service : std::uint16_t {
  none,
  nmt,  // node control, 000h
  sync,
  time,
  emcy,           // index: node-ID of the producer
  rpdo,           // index: slot in pdo::Engine
  tpdo_rtr,       // index: slot in pdo::Engine, remote frames only
  sdo_server,     // index: server number, 0 = default (1200h)
  sdo_client,     // index: client slot
  error_control,  // index: node-ID of the producer
  lss,
  srdo,   // index: see srdo::Consumer
  usdo,   // requests to the USDO server, index: node-ID of the client
  sleep,  // see nmt/sleep.h
};

struct Target {
  Service service = Service::none;
  std::uint16_t index = 0;
  std::uint16_t next = 0;    // position in Dispatch::targets() of the next target, 0 = last one
  std::uint16_t unused = 0;  // pads the target to one word, which is compared as a whole

  // Whether it belongs to this service and is the only target of its identifier.
  bool alone_of(Service wanted) const {
    constexpr auto kAllButIndex =
        std::bit_cast<std::uint64_t>(std::array<std::uint16_t, 4>{0xFFFF, 0, 0xFFFF, 0xFFFF});
    return (word() & kAllButIndex) == Target{wanted}.word();
  }
  // The same, and it has this index.
  bool alone_is(Service wanted, std::uint16_t wanted_index) const {
    return word() == Target{wanted, wanted_index}.word();
  }

 private:
  constexpr std::uint64_t word() const { return std::bit_cast<std::uint64_t>(*this); }
};

class Dispatch {
 public:
  Dispatch();

  // Registers service/index for frames with this identifier. Adding the same triple twice has no
  // effect.
  void add(std::uint32_t id, bool extended, Service service, std::uint16_t index);
  // No effect if it was not added.
  void remove(std::uint32_t id, bool extended, Service service, std::uint16_t index);

  // The first target for the frame's identifier, or nullptr. Precondition: a standard id is < 800h.
  const Target* find(const Frame& frame) const {
    LINEGATE_ASSERT_HOT(frame.extended() || frame.id < standard_.size(),
                        "a standard identifier has 11 bits");
    const std::uint16_t first =
        frame.extended() ? find_extended(frame.id) : standard_[frame.id & 0x7FFU];
    return first == 0 ? nullptr : &targets_[first];
  }
  // The same for an 11-bit identifier.
  const Target* find_standard(std::uint32_t id) const {
    const std::uint16_t first = standard_[id & 0x7FFU];
    return first == 0 ? nullptr : &targets_[first];
  }
  const Target* next(const Target& target) const {
    return target.next == 0 ? nullptr : &targets_[target.next];
  }

  // Increases with every addition and removal.
  std::uint64_t changes() const { return changes_; }
  // The value of changes() when the target was added. Precondition: target is an entry of this
  // table.
  std::uint64_t added(const Target& target) const {
    const auto place = static_cast<std::size_t>(&target - targets_.data());
    LINEGATE_ASSERT(place < added_.size(), "the target is of this table");
    return added_[place];
  }
  // The first target for the frame's identifier that was added after `after` and not after `until`,
  // both values of changes(), or nullptr. Lets a caller continue with the targets of an identifier
  // after one of them changed the table.
  const Target* find_added(const Frame& frame, std::uint64_t after, std::uint64_t until) const;

 private:
  struct Slot {
    std::uint32_t id = kEmpty;
    std::uint16_t first = 0;
  };
  static constexpr std::uint32_t kEmpty = 0xFFFF'FFFF;

  std::uint16_t find_extended(std::uint32_t id) const;
  std::uint16_t& head(std::uint32_t id, bool extended);
  void grow();

  std::array<std::uint16_t, 2048> standard_{};
  std::vector<Slot> extended_;  // power of two, at most half full
  std::size_t extended_used_ = 0;
  std::vector<Target> targets_;  // [0] unused
  std::vector<std::uint64_t>
      added_;  // by position in targets_; ascending for the targets of one identifier
  std::uint64_t changes_ = 0;
  std::vector<std::uint16_t> free_;
};

// The event for a frame that a service receives and cannot decode. node: the node concerned, 0 =
// the line.
inline Event malformed_event(const Frame& frame, std::uint8_t node = 0) {
  event::MalformedFrame data{.identifier = frame.id, .length = frame.length};
  std::copy_n(frame.data.begin(), std::min<std::size_t>(frame.length, data.data.size()),
              data.data.begin());
  return {.time = frame.time, .node = node, .data = data};
}

}  // namespace linegate::can
