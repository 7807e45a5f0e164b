// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/pdo_to_image_floor.h"

#include <cstring>

namespace linegate::bench {

Floor::Floor(std::span<const std::uint32_t> ids)
    : plan_of_(0x800),
      plans_(1),
      image_(8 * ids.size() + 8),
      dirty_(image_.size()),
      generations_(image_.size() / 64 + 1),
      marks_(ids.size()),
      touched_(ids.size() / 64 + 1),
      held_(ids.size()),
      place_(ids.size()) {
  for (std::uint32_t pdo = 0; pdo < ids.size(); ++pdo) {
    plan_of_[ids[pdo]] = static_cast<std::uint16_t>(plans_.size());
    plans_.push_back({8 * pdo, pdo});
  }
}

inline void Floor::put(const Plan& plan, std::uint64_t after, std::int64_t time,
                       std::uint32_t count) {
  std::byte* const place = image_.data() + plan.offset;
  std::uint64_t before = 0;
  std::memcpy(&before, place, 8);
  std::memcpy(place, &after, 8);
  std::uint64_t dirty = 0;
  std::memcpy(&dirty, dirty_.data() + plan.offset, 8);
  dirty |= before ^ after;
  std::memcpy(dirty_.data() + plan.offset, &dirty, 8);
  generations_[plan.offset / 64] = generation_;
  Mark& mark = marks_[plan.pdo];
  mark.time = time;
  mark.count += count;
  mark.valid = 1;
  touched_[plan.pdo / 64] |= std::uint64_t{1} << (plan.pdo % 64);
}

std::uint64_t Floor::receive(std::span<const can::Frame> frames) {
  std::uint64_t taken = 0;
  for (const can::Frame& frame : frames) {
    const std::uint16_t at = plan_of_[frame.id & 0x7FFU];
    if (at == 0) {
      continue;
    }
    std::uint64_t word = 0;
    std::memcpy(&word, frame.data.data(), 8);
    put(plans_[at], word, frame.time.time_since_epoch().count(), 1);
    ++taken;
  }
  return taken;
}

std::uint64_t Floor::commit() {
  std::uint64_t taken = 0;
  for (std::size_t i = 0; i < held_count_; ++i) {
    const Held& held = held_[i];
    const Plan plan = plans_[held.plan];
    put(plan, held.word, held.time, held.count);
    place_[plan.pdo] = 0;
    taken += held.count;
  }
  held_count_ = 0;
  return taken;
}

std::uint64_t Floor::receive_synchronous(std::span<const can::Frame> frames) {
  std::uint64_t taken = 0;
  for (const can::Frame& frame : frames) {
    if (frame.id == 0x080) {
      taken += commit();
      continue;
    }
    const std::uint16_t at = plan_of_[frame.id & 0x7FFU];
    if (at == 0) {
      continue;
    }
    std::uint32_t& place = place_[plans_[at].pdo];
    if (place == 0) {
      place = static_cast<std::uint32_t>(++held_count_);
      held_[place - 1].count = 0;
    }
    Held& held = held_[place - 1];
    std::memcpy(&held.word, frame.data.data(), 8);
    held.time = frame.time.time_since_epoch().count();
    ++held.count;
    held.plan = at;
  }
  return taken;
}

std::uint64_t Floor::checksum() const {
  std::uint64_t sum = 0;
  for (const std::byte b : image_) {
    sum += std::to_integer<std::uint64_t>(b);
  }
  for (const std::byte b : dirty_) {
    sum += std::to_integer<std::uint64_t>(b);
  }
  for (const Mark& mark : marks_) {
    sum += mark.count + mark.valid + static_cast<std::uint64_t>(mark.time);
  }
  for (const std::uint64_t g : generations_) {
    sum += g;
  }
  for (const std::uint64_t t : touched_) {
    sum += t;
  }
  return sum;
}

}  // namespace linegate::bench
