// SPDX-License-Identifier: Apache-2.0
// The members of the data of an event, by their names: for a report that must not allocate, and for
// tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "stack/base/events.h"

namespace linegate {

class EventMemberVisitor {
 public:
  virtual ~EventMemberVisitor() = default;
  // An integer, an enumeration, or a duration in its unit.
  virtual void number(std::string_view name, std::uint64_t value) = 0;
  virtual void bytes(std::string_view name, std::span<const std::byte> value) = 0;
};

// In the order of the struct. Members whose meaning depends on another one are always visited.
// Never allocates.
void visit_members(const EventData& data, EventMemberVisitor& visitor);

}  // namespace linegate
