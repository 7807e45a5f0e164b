// SPDX-License-Identifier: Apache-2.0
// Storage of the objects of a Dictionary; private to stack/od.
//
// A look-up reads three places: the page of 256 slots for the index, the Variable, its value. The
// Variables of an object and their values lie in one block of cache lines. The exception is a short
// value of sub-index 0, which most objects have: it lies in the page, next to the data needed to
// read it, so that glance() needs neither slot nor Variable. Names, initial values and limits are
// kept elsewhere.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "stack/base/assert.h"
#include "stack/od/dictionary.h"
#include "stack/od/hook_chain.h"
#include "stack/od/slot_pages.h"

namespace linegate::od {

// Describes the object itself, and is not a sub-index of it (CiA 301).
inline constexpr std::uint8_t kStructureSub = 0xFF;

// Largest size in bytes of a DOMAIN, and of a string that the device itself sets.
inline constexpr std::size_t kLongestValue = std::size_t{16} * 1024 * 1024;

// The rarely used part of a Variable.
struct VariableDetails {
  std::string name;
  std::vector<std::byte> initial;
  std::vector<std::byte> low;
  std::vector<std::byte> high;
  std::vector<std::byte> domain;  // the value of a DOMAIN, or of a string beyond its capacity
  bool kept = false;              // resets leave the value unchanged
};

struct alignas(64) CacheLine {
  std::array<std::byte, 64> bytes;
};

// The rarely used part of an object.
struct ObjectDetails {
  std::string name;
  ObjectType type = ObjectType::variable;
  std::array<std::byte, 4> structure{};    // the value of sub-index FFh
  std::unique_ptr<CacheLine[]> block;      // Variables, then values
  std::unique_ptr<HookChain> hooks;        // set if there are hooks besides that of set_hook()
  std::vector<VariableDetails> variables;  // by sub-index, like Slot::variables
};

class ObjectTable {
 public:
  explicit ObjectTable(SlotPages& slots) : slots_(slots) {}

  // nullptr if the object does not exist.
  Slot* find(std::uint16_t index) const { return slots_.find(index); }

  // The variable if it has a Variable of its own, as all except elements of a window do; else
  // nullptr.
  const Variable* find_plain(Address address) const {
    const Slot* const slot = find(address.index);
    if (slot == nullptr || slot->kind != Slot::Kind::plain || address.sub > slot->highest) {
      return nullptr;
    }
    // Where the values of a record begin: found without waiting for the variable.
    __builtin_prefetch(slot->variables + slot->highest + 1);
    const Variable& variable = slot->variables[address.sub];
    return variable.type == DataType::none ? nullptr : &variable;
  }

  // The variable, or nullptr and the reason in why. element is filled in for a variable without a
  // Variable of its own (in a window).
  Variable* find(Address address, Variable& element, AbortCode& why) const {
    const Slot* slot = find(address.index);
    if (slot == nullptr) {
      why = AbortCode::no_object;
      return nullptr;
    }
    if (slot->kind == Slot::Kind::window) {
      return window_element(*slot, address.sub, element, why);
    }
    if (address.sub > slot->highest || slot->variables[address.sub].type == DataType::none) {
      why = AbortCode::no_sub_index;
      return nullptr;
    }
    return &slot->variables[address.sub];
  }

  ObjectDetails& details(const Slot& slot) const {
    LINEGATE_ASSERT(details_[slot.details] != nullptr, "an object has its details");
    return *details_[slot.details];
  }
  VariableDetails& details(Address address) const {
    const Slot* const slot = find(address.index);
    LINEGATE_ASSERT(slot != nullptr && address.sub < details(*slot).variables.size(),
                    "the variable exists");
    return details(*slot).variables[address.sub];
  }

  // The slot for a new object, to be filled in before the object is inserted. Precondition: the
  // index is free. The slot does not move.
  Slot& place(std::uint16_t index) {
    LINEGATE_ASSERT(find(index) == nullptr, "the index is free");
    return slots_.place(index);
  }
  // The place of the value of sub-index 0 of the object at that index, if it is a short one.
  // Initially zero.
  std::byte* short_value(std::uint16_t index) { return slots_.value(index).data(); }
  void insert(std::uint16_t index, ObjectDetails details);
  void erase(std::uint16_t index);
  std::vector<std::uint16_t> indices() const;
  // Determines whether glance() can read the object. Call it whenever hook, access or place of
  // sub-index 0 may have changed. Precondition: the object exists.
  void look_at(std::uint16_t index);

 private:
  static Variable* window_element(const Slot& slot, std::uint8_t sub, Variable& element,
                                  AbortCode& why);

  SlotPages& slots_;
  std::vector<std::unique_ptr<ObjectDetails>> details_;
  std::vector<std::uint32_t> free_details_;
};

}  // namespace linegate::od
