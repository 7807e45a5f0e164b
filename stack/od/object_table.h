// How a Dictionary keeps its objects; private to stack/od.
//
// Look-up touches three places: the page of 256 slots for the index, the Variable, its value. The
// Variables of an object and their values lie in one block of cache lines, so that for an ordinary
// VAR the last two are the same line. Names, initial values and limits are kept elsewhere.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "stack/od/dictionary.h"
#include "stack/od/hook_chain.h"

namespace linegate::od {

// The cold part of a Variable.
struct VariableDetails {
  std::string name;
  std::vector<std::byte> initial;
  std::vector<std::byte> low;
  std::vector<std::byte> high;
  std::vector<std::byte> domain;  // the value of a DOMAIN, which may grow
};

struct alignas(64) CacheLine {
  std::array<std::byte, 64> bytes;
};

// The cold part of an object.
struct ObjectDetails {
  std::string name;
  ObjectType type = ObjectType::variable;
  std::array<std::byte, 4> structure{};    // what sub-index FFh reads
  std::unique_ptr<CacheLine[]> block;      // Variables, then values
  std::unique_ptr<HookChain> hooks;        // if there are others than set_hook()'s
  std::vector<VariableDetails> variables;  // by sub-index, as Slot::variables
};

struct Slot {
  enum class Kind : std::uint8_t { none, plain, window };

  // plain: by sub-index, highest + 1 of them; a gap has DataType::none. window: sub-index 0, and
  // the first element.
  Variable* variables = nullptr;
  std::uint32_t details = 0;  // position of the ObjectDetails
  std::uint8_t highest = 0;   // sub-index
  Kind kind = Kind::none;
};

class ObjectTable {
 public:
  // nullptr if there is no object.
  const Slot* find(std::uint16_t index) const {
    const Page* page = pages_[index >> 8U].get();
    if (page == nullptr) {
      return nullptr;
    }
    const Slot& slot = (*page)[index & 0xFFU];
    return slot.kind == Slot::Kind::none ? nullptr : &slot;
  }

  // The variable if it has a place of its own, as all but elements of a window do; else nullptr.
  const Variable* find_plain(Address address) const {
    const Page* page = pages_[address.index >> 8U].get();
    if (page == nullptr) {
      return nullptr;
    }
    const Slot& slot = (*page)[address.index & 0xFFU];
    if (slot.kind != Slot::Kind::plain || address.sub > slot.highest) {
      return nullptr;
    }
    const Variable& variable = slot.variables[address.sub];
    return variable.type == DataType::none ? nullptr : &variable;
  }

  // The variable, or nullptr and the reason in why. element takes a variable that has no place of
  // its own (in a window).
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

  ObjectDetails& details(const Slot& slot) const { return *details_[slot.details]; }
  VariableDetails& details(Address address) const {
    return details(*find(address.index)).variables[address.sub];
  }

  // The index must be free.
  void insert(std::uint16_t index, Slot slot, ObjectDetails details);
  void erase(std::uint16_t index);
  std::vector<std::uint16_t> indices() const;

 private:
  using Page = std::array<Slot, 256>;

  static Variable* window_element(const Slot& slot, std::uint8_t sub, Variable& element,
                                  AbortCode& why);

  std::array<std::unique_ptr<Page>, 256> pages_;
  std::vector<std::unique_ptr<ObjectDetails>> details_;
  std::vector<std::uint32_t> free_details_;
};

}  // namespace linegate::od
