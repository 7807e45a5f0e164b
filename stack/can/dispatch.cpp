// SPDX-License-Identifier: Apache-2.0
#include "stack/can/dispatch.h"

#include <utility>

#include "stack/base/assert.h"

namespace linegate::can {
namespace {

std::size_t hash(std::uint32_t id) {
  return (id * 0x9E37'79B1U) >> 7U;
}

}  // namespace

Dispatch::Dispatch() : extended_(16), targets_(1), added_(1) {
}

void Dispatch::add(std::uint32_t id, bool extended, Service service, std::uint16_t index) {
  LINEGATE_ASSERT(service != Service::none, "a frame belongs to a service");
  std::uint16_t last = 0;
  for (std::uint16_t at = head(id, extended); at != 0; at = targets_[at].next) {
    if (targets_[at].service == service && targets_[at].index == index) {
      return;
    }
    last = at;
  }
  std::uint16_t place = 0;
  if (free_.empty()) {
    place = static_cast<std::uint16_t>(targets_.size());
    targets_.emplace_back();
    added_.emplace_back();
  } else {
    place = free_.back();
    free_.pop_back();
  }
  targets_[place] = Target{service, index, 0};
  added_[place] = ++changes_;
  if (last != 0) {
    targets_[last].next = place;
  } else {
    head(id, extended) = place;
  }
}

void Dispatch::remove(std::uint32_t id, bool extended, Service service, std::uint16_t index) {
  std::uint16_t* link = &head(id, extended);
  while (*link != 0) {
    Target& target = targets_[*link];
    if (target.service == service && target.index == index) {
      free_.push_back(*link);
      *link = target.next;
      ++changes_;
      return;
    }
    link = &target.next;
  }
}

const Target* Dispatch::find_added(const Frame& frame, std::uint64_t after,
                                   std::uint64_t until) const {
  const Target* target = find(frame);
  while (target != nullptr && added(*target) <= after) {
    target = next(*target);
  }
  return target != nullptr && added(*target) <= until ? target : nullptr;
}

std::uint16_t Dispatch::find_extended(std::uint32_t id) const {
  const std::size_t mask = extended_.size() - 1;
  for (std::size_t i = hash(id) & mask;; i = (i + 1) & mask) {
    if (extended_[i].id == id) {
      return extended_[i].first;
    }
    if (extended_[i].id == kEmpty) {
      return 0;
    }
  }
}

std::uint16_t& Dispatch::head(std::uint32_t id, bool extended) {
  LINEGATE_ASSERT(id <= (extended ? 0x1FFF'FFFFU : 0x7FFU), "the identifier has 11 or 29 bits");
  if (!extended) {
    return standard_[id & 0x7FFU];
  }
  if ((extended_used_ + 1) * 2 > extended_.size()) {
    grow();
  }
  const std::size_t mask = extended_.size() - 1;
  std::size_t i = hash(id) & mask;
  while (extended_[i].id != id && extended_[i].id != kEmpty) {
    i = (i + 1) & mask;
  }
  if (extended_[i].id == kEmpty) {
    extended_[i].id = id;
    ++extended_used_;
  }
  return extended_[i].first;
}

void Dispatch::grow() {
  std::vector<Slot> old(extended_.size() * 2);
  std::swap(old, extended_);
  const std::size_t mask = extended_.size() - 1;
  extended_used_ = 0;
  for (const Slot& slot : old) {
    if (slot.id == kEmpty || slot.first == 0) {
      continue;
    }
    std::size_t i = hash(slot.id) & mask;
    while (extended_[i].id != kEmpty) {
      i = (i + 1) & mask;
    }
    extended_[i] = slot;
    ++extended_used_;
  }
}

}  // namespace linegate::can
